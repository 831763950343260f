#include "tests/validation/programs/outcome.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace kilotwin::validation {
namespace {

/// Outcomes of runs of two robots that agree but for the path.
Outcome outcome_of(const std::vector<double>& path_mm_of_runs) {
  Outcome outcome;
  outcome.robots = 2;
  for (const double path : path_mm_of_runs) outcome.path_mm.insert(outcome.path_mm.end(), {path - 1, path + 1});
  const std::size_t all = outcome.path_mm.size();
  for (auto* values :
       {&outcome.distance_mm, &outcome.brightness, &outcome.colours, &outcome.sent, &outcome.received})
    values->resize(all, 0);
  outcome.motors.resize(all);
  outcome.led.resize(all);
  outcome.last_tick = 100;
  // Changes of the LED at different times, so that no pair is event for event.
  outcome.led[0].push_back({static_cast<std::int64_t>(path_mm_of_runs[0]) % 50, 1});
  return outcome;
}

TEST(PermutationTest, SeparatesOnlySamplesThatDiffer) {
  const std::vector<double> low{1, 2, 3, 4, 5, 6, 7, 8, 9, 10};
  std::vector<double> high = low, shifted = low;
  for (double& value : high) value += 20;
  for (double& value : shifted) value += 0.5;
  EXPECT_LE(permutation_p(low, high), 2e-4);
  EXPECT_GE(permutation_p(low, shifted), 0.5);
  EXPECT_EQ(permutation_p(low, low), 1);
}

TEST(PermutationTest, OneValueEachDecidesNothing) {
  const std::vector<double> a{1}, b{100};
  EXPECT_EQ(permutation_p(a, b), 1);
}

TEST(Comparison, OneRunOfFewRobotsDoesNotExcuseADifference) {
  // Two robots with large differences between each other: two standard errors cover all of it.
  Outcome native = outcome_of({60}), firmware = outcome_of({90});
  native.path_mm = {0, 120};
  firmware.path_mm = {0, 180};
  const Comparison result = compare(native, firmware);
  EXPECT_FALSE(result.event_exact);
  EXPECT_FALSE(result.within_tenth);
  EXPECT_FALSE(result.agrees);
  EXPECT_EQ(result.measure, "path, mm");
}

TEST(Comparison, TenRunsDecideByTheTest) {
  const std::vector<double> wide{10, 200, 30, 150, 60, 90, 20, 180, 75, 110};
  std::vector<double> also_wide = wide;
  for (double& value : also_wide) value *= 1.3;
  const Comparison chance = compare(outcome_of(wide), outcome_of(also_wide));
  EXPECT_FALSE(chance.within_tenth);
  EXPECT_TRUE(chance.agrees);
  EXPECT_GT(chance.p, kLevel);
  const std::vector<double> narrow{101, 102, 103, 104, 105, 106, 107, 108, 109, 110};
  std::vector<double> beyond = narrow;
  for (double& value : beyond) value *= 1.2;
  const Comparison real = compare(outcome_of(narrow), outcome_of(beyond));
  EXPECT_FALSE(real.agrees);
  EXPECT_LT(real.p, kLevel);
  std::vector<double> within = narrow;
  for (double& value : within) value *= 1.05;
  EXPECT_TRUE(compare(outcome_of(narrow), outcome_of(within)).within_tenth);
}

}  // namespace
}  // namespace kilotwin::validation
