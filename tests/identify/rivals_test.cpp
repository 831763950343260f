// The rivals of `kilotwin identify` do what they should: their figures are worth a comparison.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/identify/rivals/rates.hpp"
#include "tests/identify/truth/effects.hpp"
#include "tests/identify/truth/play.hpp"
#include "tests/identify/truth/scenarios.hpp"

namespace kilotwin::truth {
namespace {

Scene small(std::vector<Effect> effects) {
  Scene scene = scenario("nothing-tidy");
  scene.robots = 8;
  scene.train_runs = 2;
  scene.train_s = 160;
  scene.test_runs = 1;
  scene.effects = std::move(effects);
  return scene;
}

/// The largest correction of a base model.
double largest_mm(const std::vector<Prediction>& corrections) {
  double largest = 0;
  for (const Prediction& p : corrections) largest = std::max(largest, std::hypot(p.predicted.x, p.predicted.y));
  return largest;
}

TEST(Rivals, AddNothingToARobotWithoutNoise) {
  Scene scene = small({});
  scene.factor_sd = scene.tracker_sd_mm = scene.heading_sd_rad = 0;
  scene.contacts = false;
  scene.width_mm = scene.height_mm = 0;
  const Play played = play(scene, 4);
  const std::vector<RateRow> rows = rate_rows(played.train);
  const Rival base = base_alone(rows, scene.robots);
  EXPECT_LT(largest_mm(corrections(sparse_regression(rows, scene.robots), base, played.train, played.test[0], 10)),
            2);
  for (int robot = 0; robot < scene.robots; ++robot) {
    const Wheels<double>& bias = played.individuals[static_cast<std::size_t>(robot)].bias_mm_s;
    EXPECT_NEAR(base.straight_mm_s[robot], scene.straight_mm_s + (bias.left + bias.right) / 2, 0.2);
  }
}

TEST(Rivals, FindASlowDecline) {
  const Scene scene = small({battery_by_the_clock()});
  const Play played = play(scene, 4);
  const std::vector<RateRow> rows = rate_rows(played.train);
  const Rival base = base_alone(rows, scene.robots), sparse = sparse_regression(rows, scene.robots);
  EXPECT_TRUE(std::count(sparse.covariates.begin(), sparse.covariates.end(), "time") == 1);
  // Early robots are faster than the mean of the run, late ones slower.
  const double late_s = played.test[0].duration_s - 20;
  for (const auto fit : {&sparse_regression, &gaussian_process, &neural_network}) {
    const Rival rival = fit(rows, scene.robots);
    Instant at = rows.front().instants.front();
    at.motion = Motion::kStraight;
    at.time_s = at.driven_s = 5;
    const double early_mm_s = rival.rates(at)[0];
    at.time_s = at.driven_s = late_s;
    EXPECT_GT(early_mm_s, rival.rates(at)[0] + 1);
  }
  EXPECT_GT(largest_mm(corrections(sparse, base, played.train, played.test[0], 10)), 5);
}

}  // namespace
}  // namespace kilotwin::truth
