// Parts of the search on small scenes: lag of the commands, travelling waves, uncertainty, traffic that fades.
#include <gtest/gtest.h>

#include <cmath>

#include "clients/identify/fit/persistent_residuals.hpp"
#include "clients/identify/fit/uncertainty.hpp"
#include "clients/identify/fit/wall_detection.hpp"
#include "clients/identify/model/effect_records.hpp"
#include "clients/identify/search/search.hpp"
#include "clients/identify/search/travelling_waves.hpp"
#include "tests/identify/small_set.hpp"
#include "tests/identify/truth/effects.hpp"

namespace kilotwin {
namespace {

using identify::FitState;
using identify::Fitter;
using identify::MeasuredSet;

TEST(CommandLag, IsFittedInPlaceOfEffects) {
  const truth::Scene scene = small({});
  for (const double lag_s : {0.1, -0.15}) {
    MeasuredSet set = set_of(scene, played(scene));
    for (identify::Run& run : set.runs)
      for (identify::Track& track : run.tracks)
        // All of them, the first ones too: a start with another lag is an effect of the time since the start.
        for (identify::CommandChange& change : track.commands) change.time_s -= lag_s;
    FitState base(set);
    const Fitter fitter(set, 2);
    fitter.fit_base(base);
    const identify::Search found = identify::search(fitter, base, [](double, const std::string&) {});
    for (const identify::Term& term : found.fit.model.terms)
      ADD_FAILURE() << term.name << " at a lag of " << lag_s << " s";
    EXPECT_NEAR(found.fit.model.base.command_lag_s, lag_s, 0.02);
    const auto [low_s, high_s] = fitter.command_lag_interval(found.fit);
    EXPECT_LT(low_s, lag_s);
    EXPECT_GT(high_s, lag_s);
    EXPECT_LT(high_s - low_s, 0.1);
  }
}

TEST(CommandLag, IsNotUsedWithoutOne) {
  const truth::Scene scene = small({});
  const MeasuredSet set = set_of(scene, played(scene));
  FitState base(set);
  const Fitter fitter(set, 2);
  fitter.fit_base(base);
  EXPECT_EQ(fitter.fit_command_lag(base), 0);
  EXPECT_EQ(base.model.base.command_lag_s, 0);
}

TEST(TravellingWaves, AreFoundByTheirPeriodogram) {
  const truth::Scene scene = small({truth::travelling_waves()});
  const MeasuredSet set = set_of(scene, played(scene));
  FitState base(set);
  const Fitter fitter(set, 2);
  fitter.fit_base(base);
  const identify::Dictionary waves = identify::wave_dictionary_of(fitter, base, identify::extent_of(base.tracks));
  ASSERT_FALSE(waves.blocks.empty());
  const std::vector<double>& numbers = waves.blocks.front().basis.factors.front().points;
  // The truth: a wavelength of 420 mm, a period of 70 s, direction (0.8, 0.6).
  EXPECT_NEAR(numbers[0], 2 * M_PI * 0.8 / 420, 0.0015);
  EXPECT_NEAR(numbers[1], 2 * M_PI * 0.6 / 420, 0.0015);
  EXPECT_NEAR(numbers[2], 2 * M_PI / 70, 0.01);
}

TEST(Uncertainty, HoldsTheTrueBiases) {
  // 40 biases, 2 of them outside on average; more than 8 in one of 2000 sets.
  truth::Scene scene = small({});
  scene.robots = 20;
  const truth::Play play = played(scene);
  const MeasuredSet set = set_of(scene, play);
  FitState state(set);
  const Fitter fitter(set, 2);
  fitter.fit_base(state);
  const identify::Uncertainty u = identify::uncertainty_of(fitter, state);
  int outside = 0;
  for (const auto& [robot, covariance] : u.biases) {
    const truth::Wheels<double>& truth = play.individuals.at(robot).bias_mm_s;
    const Eigen::Vector2d off = state.model.bias_of(robot).mean_mm_s - Eigen::Vector2d(truth.left, truth.right);
    for (int w = 0; w < 2; ++w) outside += std::abs(off[w]) > 1.96 * std::sqrt(covariance(w, w)) ? 1 : 0;
  }
  EXPECT_LE(outside, 8);
  for (int c = 0; c < identify::kBaseColumns; ++c) EXPECT_GT(u.sd(c), 0);
}

TEST(TrafficGrid, Forgets) {
  identify::TrafficGrid grid({30, 0, 0, 10});
  grid.add(0, 5, 5, 2, 0);
  EXPECT_NEAR(grid.value(0, 5, 5, 10), 2 * std::exp(-1), 1e-5);
  grid.add(1, 5, 5, 1, 10);
  EXPECT_NEAR(grid.value(0, 5, 5, 20), (2 * std::exp(-1) + 1) * std::exp(-1), 1e-5);
}

TEST(PersistentResiduals, AreNoNoise) {
  const auto share = [](const truth::Scene& scene) {
    const MeasuredSet set = set_of(scene, played(scene));
    FitState base(set);
    const Fitter fitter(set, 2);
    fitter.fit_base(base);
    return identify::persistent_share(fitter, base);
  };
  EXPECT_LT(share(small({})), 0.1);
  EXPECT_GT(share(small({truth::slow_strip()})), 0.5);
}

TEST(Walls, TheLastOneFollowsFromTheOthers) {
  truth::Scene scene = small({});
  scene.width_mm = scene.height_mm = 450;
  MeasuredSet set = set_of(scene, played(scene));
  const double wall_mm = scene.height_mm / 2 - 16.5;
  // No robot comes near the lower wall.
  const auto keep = [&](double shift_mm) {
    for (identify::Run& run : set.runs)
      for (identify::Track& track : run.tracks) {
        std::erase_if(track.samples, [&](const identify::Sample& s) { return s.y_mm < -wall_mm + 15; });
        for (identify::Sample& s : track.samples) s.x_mm += shift_mm;
      }
    return identify::detected_walls(identify::PreparedSet(set), identify::MotionModel{});
  };
  const identify::Walls walls = keep(0);
  ASSERT_TRUE(std::isfinite(walls.x_low_mm) && std::isfinite(walls.x_high_mm) && std::isfinite(walls.y_high_mm));
  EXPECT_NEAR(walls.y_low_mm, -wall_mm, 1);
  // The centre of this arena is not the origin.
  EXPECT_TRUE(std::isinf(keep(30).y_low_mm));
}

}  // namespace
}  // namespace kilotwin
