// A model without effects says how much it leaves unexplained, and which covariate shows it: one test per kind.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "clients/identify/identify.hpp"
#include "clients/identify/predict/evaluation.hpp"
#include "tests/identify/small_set.hpp"

namespace kilotwin {
namespace {

/// The remainder that the base model alone leaves: no effect can be named.
struct Left {
  identification::Unexplained unexplained;
  double error_mm = 0;  ///< on the tracks that give the error
};

/// Twelve robots in the open, three runs of 150 s. The last run is held out; every second robot of it gives the error.
truth::Scene open_floor(std::vector<truth::Effect> effects) {
  truth::Scene scene = small(std::move(effects));
  scene.robots = 12;
  scene.train_runs = 3;
  scene.train_s = 150;
  scene.width_mm = scene.height_mm = 0;
  scene.contacts = false;
  return scene;
}

truth::Effect planted(std::function<void(const truth::Situation&, truth::Push&)> push) {
  return {"planted", "", {}, {}, std::move(push), {}};
}

Left left_by_base_model(const truth::Scene& scene, std::uint64_t seed) {
  identify::MeasuredSet set = set_of(scene, played(scene, seed));
  identify::hold_out_part(set);
  identify::Options options;
  options.find_effects = false;
  const identification::Result result = identify::identify(set, nullptr, options).found.result();
  return {result.unexplained(), result.after().rmse_mm().number_value()};
}

/// `first`: the covariates of the pattern that is shown first, or other names of the same covariates.
void expect_said(const truth::Effect& effect, const std::vector<std::vector<std::string>>& first) {
  constexpr std::uint64_t kSeed = 5;
  constexpr double kFactor = 1.5;
  const Left with = left_by_base_model(open_floor({effect}), kSeed),
             without = left_by_base_model(open_floor({}), kSeed);
  const identification::Unexplained& said = with.unexplained;
  ASSERT_TRUE(said.large()) << said.in_words();
  // The error of the same set, played without the effect, is what no model could explain.
  const double planted = 1 - without.error_mm * without.error_mm / (with.error_mm * with.error_mm);
  EXPECT_GT(planted, 0.3);
  EXPECT_GT(said.share(), planted / kFactor) << planted << ": " << said.in_words();
  EXPECT_LT(said.share(), planted * kFactor) << planted << ": " << said.in_words();
  ASSERT_GT(said.patterns_size(), 0) << said.in_words();
  const auto& over = said.patterns(0).covariates();
  EXPECT_NE(std::find(first.begin(), first.end(), std::vector<std::string>(over.begin(), over.end())), first.end())
      << said.in_words();
}

TEST(UnexplainedKinds, NothingIsSaidWithoutAnEffect) {
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    const identification::Unexplained u = left_by_base_model(open_floor({}), seed).unexplained;
    EXPECT_FALSE(u.large()) << u.in_words();
    EXPECT_EQ(u.patterns_size(), 0);
  }
}

TEST(UnexplainedKinds, OverPlace) {
  expect_said(planted([](const truth::Situation& at, truth::Push& push) {
                push.drift_mm_s.y += at.disc.x > 0 ? 1.2 : -1.2;
              }),
              {{"x"}});
}

TEST(UnexplainedKinds, OverTime) {
  expect_said(planted([](const truth::Situation& at, truth::Push& push) {
                push.drift_mm_s.x += 1.5 * std::sin(at.time_s / 12);
              }),
              {{"time"}});
}

TEST(UnexplainedKinds, OverHeading) {
  expect_said(planted([](const truth::Situation& at, truth::Push& push) {
                const double gain = 1 + 0.35 * std::sin(2 * at.heading_rad);
                push.gain.left *= gain;
                push.gain.right *= gain;
              }),
              {{"heading"}});
}

TEST(UnexplainedKinds, OverCommand) {
  expect_said(planted([](const truth::Situation& at, truth::Push& push) {
                if (at.motion == truth::Motion::kStraight) push.slip_mm_s.y += 2;
              }),
              {{"command"}, {"straight"}, {"turning"}});
}

TEST(UnexplainedKinds, OverRobot) {
  expect_said(planted([](const truth::Situation& at, truth::Push& push) {
                if (at.robot % 3 == 0 && at.driven()) push.slip_mm_s.y += 2.5;
              }),
              {{"robot"}});
}

TEST(UnexplainedKinds, OverAPair) {
  expect_said(planted([](const truth::Situation& at, truth::Push& push) {
                push.drift_mm_s.y += (at.disc.x > 0) == (at.time_s < 75) ? 1.5 : -1.5;
              }),
              {{"time", "x"}});
}

}  // namespace
}  // namespace kilotwin
