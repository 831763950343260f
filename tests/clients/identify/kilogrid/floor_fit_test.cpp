// The fit by simulation: it recovers what made the data, and finds an effect that is there and none that is not.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "clients/identify/kilogrid/floor_fit.hpp"

namespace kilotwin::kilogrid {
namespace {

FloorScene scene(std::uint32_t robots, double duration_s, int which) {
  FloorScene scene{"s" + std::to_string(which), duration_s, {}, {}};
  for (std::uint32_t i = 0; i < robots; ++i) {
    scene.x_mm.push_back(150 + 100 * (i % 8));
    scene.y_mm.push_back(250 + 30 * which + 150.0 * (i / 8));
  }
  return scene;
}

/// Runs of a model, as if they had been measured.
std::vector<FloorRun> runs_of(const FloorModel& model, std::uint64_t seed, std::uint32_t robots = 40) {
  std::vector<FloorRun> runs;
  for (int i = 0; i < 3; ++i) {
    const FloorSettings s = model.settings();
    runs.push_back(
        simulate(scene(robots, 1000, i), {}, s.model, s.times, s.radio, seed + static_cast<std::uint64_t>(i)));
  }
  return runs;
}

FloorModel base_model() {
  FloorModel model;
  model.add(base_term());
  return model;
}

/// What identify_floor asks of an effect.
constexpr double kBeyondChance = 120;
const FloorProgress kQuiet = [](const std::string& s) { puts(s.c_str()); };

TEST(FloorFit, RecoversTheSpeedAndTheRange) {
  FloorModel truth = base_model();
  truth.values[0] = 9;    // straight speed; the search begins at 11.3
  truth.values[2] = 1.6;  // spread of the bias; at 1.2
  truth.values[4] = 46;   // range; at 49
  const FloorTarget target(runs_of(truth, 100), {});
  FloorModel model = base_model();
  const double before = target.misfit(simulated_statistics(target, model.settings(), 1));
  const double after = fit(model, target, 3, 1, 7, kQuiet);
  EXPECT_LT(after, 0.7 * before);
  EXPECT_NEAR(model.values[0], 9, 1.2);
  EXPECT_NEAR(model.values[4], 46, 2.8);
}

TEST(FloorFit, FindsAnEffectThatIsThereAndNoneThatIsNot) {
  FloorModel truth = base_model();
  const std::vector<FloorTerm> candidates = candidate_terms({});
  const FloorTarget without(runs_of(truth, 200), {});
  EXPECT_TRUE(choose(truth, candidates, without, kBeyondChance, 5, kQuiet).empty());

  const auto speed = std::find_if(candidates.begin(), candidates.end(),
                                  [](const FloorTerm& t) { return t.name == "speed-of-robots"; });
  truth.add(*speed);
  truth.values[truth.values.size() - 2] = 0.5;  // spread; the last is the skew
  const FloorTarget with(runs_of(truth, 300, 72), {});
  const std::vector<CandidateScore> found = choose(base_model(), candidates, with, kBeyondChance, 5, kQuiet);
  ASSERT_FALSE(found.empty());
  EXPECT_EQ(candidates[found.front().candidate].covariates.front(), "robot");
}

TEST(FloorModel, WallsAreRecordsThatActBesideThem) {
  FloorModel model = base_model();
  model.wall.emplace().fill(1);
  (*model.wall)[0] = 0.25;  // the lower wall, at its left end
  (*model.wall)[11] = 0.5;  // the right one, at its top
  const FloorSettings settings = model.settings();
  ASSERT_EQ(settings.model.effect_size(), 4);
  EXPECT_EQ(settings.model.effect(0).name(), "wall-bottom");
  EXPECT_NEAR(settings.model.effect(0).function(1).steps().value(0), -0.75, 1e-12);
  EXPECT_NEAR(settings.model.effect(1).function(1).steps().value(7), -0.5, 1e-12);
  EXPECT_EQ(settings.model.effect(1).function(0).steps().at(0), 500 - FloorModel::kBeside_mm);
}

const FloorTerm& term_of(const std::vector<FloorTerm>& terms, const std::string& name) {
  return *std::find_if(terms.begin(), terms.end(), [&](const FloorTerm& t) { return t.name == name; });
}

TEST(FloorModel, SpeedsOfTheirOwnGoingStraightLeaveTurnsAsTheyAre) {
  const std::vector<FloorTerm> candidates = candidate_terms({});
  FloorModel model = base_model();
  model.values[2] = model.values[3] = 0;  // no bias, no noise
  model.add(term_of(candidates, "straight-speed-of-robots"));
  model.values[model.values.size() - 2] = 3;
  const FloorSettings settings = model.settings();
  ASSERT_EQ(settings.model.effect_size(), 1);
  const proto::Effect& effect = settings.model.effect(0);
  EXPECT_EQ(effect.acts_on(), proto::Effect::WHEEL_OFFSET);
  ASSERT_EQ(effect.during_size(), 1);
  EXPECT_EQ(effect.during(0), proto::STRAIGHT);
  double sum = 0, squares = 0;
  const proto::Table& table = effect.function(0).table();
  for (const double value : table.value()) {
    sum += value;
    squares += value * value;
    EXPECT_GT(settings.model.motion().straight_speed_mm_s() + value, 0);  // nobody goes backwards
  }
  const double count = table.value_size();
  EXPECT_NEAR(sum / count, 0, 0.1);
  EXPECT_NEAR(std::sqrt(squares / count), 3, 0.2);
}

}  // namespace
}  // namespace kilotwin::kilogrid
