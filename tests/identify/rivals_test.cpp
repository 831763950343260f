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

double error_mm(const Rival& rival, const Play& play) {
  return rmse_mm(predict(rival, play.train, play.test[0], 10));
}

TEST(Rivals, PredictARobotWithoutNoise) {
  Scene scene = small({});
  scene.factor_sd = scene.tracker_sd_mm = scene.heading_sd_rad = 0;
  scene.contacts = false;
  scene.width_mm = scene.height_mm = 0;
  const Play played = play(scene, 4);
  const std::vector<RateRow> rows = rate_rows(played.train);
  EXPECT_LT(error_mm(sparse_regression(rows, scene.robots), played), 2);
}

TEST(Rivals, FindASlowDecline) {
  const Scene scene = small({battery_by_the_clock()});
  const Play played = play(scene, 4);
  const std::vector<RateRow> rows = rate_rows(played.train);
  const Rival sparse = sparse_regression(rows, scene.robots);
  EXPECT_TRUE(std::count(sparse.covariates.begin(), sparse.covariates.end(), "time") == 1);
  // A rival that has no covariate: the rates of one instant for all.
  Rival blind = sparse;
  blind.rates = [&](const Instant& at) {
    Instant first = at;
    first.time_s = first.driven_s = 0;
    return sparse.rates(first);
  };
  const double without_mm = error_mm(blind, played);
  for (const auto fit : {&sparse_regression, &gaussian_process, &neural_network})
    EXPECT_LT(error_mm(fit(rows, scene.robots), played), 0.8 * without_mm);
}

}  // namespace
}  // namespace kilotwin::truth
