#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <random>

#include "tests/services/ark/plugin_bench.hpp"

namespace kilotwin::ark {
namespace {

PluginBench hub(double x_mm, double y_mm, double radius_mm) {
  return {
      "hub",
      {{"x_mm", std::to_string(x_mm)}, {"y_mm", std::to_string(y_mm)}, {"radius_mm", std::to_string(radius_mm)}},
      1023};
}

ArkMessage seen_from(PluginBench& bench, double x_mm, double y_mm, double heading_rad, std::uint32_t robot = 7) {
  return bench.sense({robot, {x_mm, y_mm, heading_rad}}).value();
}

TEST(HubPlugin, TellsInsideFromOutside) {
  PluginBench bench = hub(100, -50, 300);
  EXPECT_EQ(seen_from(bench, 100, -50, 0).type, 1);
  EXPECT_EQ(seen_from(bench, 400, -50, 0).type, 1);  // the rim
  EXPECT_EQ(seen_from(bench, 400.001, -50, 0).type, 0);
  EXPECT_EQ(seen_from(bench, 100 + 180, -50 - 240, 0).type, 1);
  EXPECT_EQ(seen_from(bench, 100, -50, 0, 1022).id, 1022);
}

TEST(HubPlugin, TellsNothingToRobotsOutOfSight) {
  PluginBench bench = hub(0, 0, 300);
  EXPECT_EQ(bench.sense({7, {0, 0, 0}, station::OFF, false}), std::nullopt);
}

TEST(HubPlugin, BearsAnticlockwiseFromTheHeading) {
  PluginBench bench = hub(0, 0, 10);
  EXPECT_EQ(seen_from(bench, -100, 0, 0).payload, 0);
  EXPECT_EQ(seen_from(bench, 0, -100, 0).payload, 90);
  EXPECT_EQ(seen_from(bench, 100, 0, 0).payload, 180);
  EXPECT_EQ(seen_from(bench, 0, 100, 0).payload, 270);
  EXPECT_EQ(seen_from(bench, 0, 100, kPi / 2).payload, 180);
  EXPECT_EQ(seen_from(bench, -100, 0, 0.25 * kPi / 180).payload, 0);  // -0.25 degrees is nearest to 0, not to 360
  EXPECT_EQ(seen_from(bench, -100, 0, kPi / 180).payload, 359);
}

TEST(HubPlugin, IsWithinHalfADegreeEverywhere) {
  PluginBench bench("hub", {{"x_mm", "30"}, {"y_mm", "40"}, {"radius_mm", "10"}}, 1);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> place(-1000, 1000), angle(-kPi, kPi);
  for (int n = 0; n < 20000; ++n) {
    const double x = place(random), y = place(random), heading = angle(random);
    const ArkMessage message = seen_from(bench, x, y, heading, 0);
    ASSERT_LT(message.payload, 360);
    const double exact = (std::atan2(40 - y, 30 - x) - heading) * 180 / kPi;
    ASSERT_LE(std::abs(std::remainder(message.payload - exact, 360)), 0.5 + 1e-9);
  }
}

TEST(HubPlugin, RefusesAParameterThatItDoesNotKnow) {
  PluginBench bench("hub", {{"radius", "300"}}, 3);
  EXPECT_NE(bench.set_up.failure.find("\"radius\""), std::string::npos) << bench.set_up.failure;
  PluginBench word("hub", {{"radius_mm", "wide"}}, 3);
  EXPECT_NE(word.set_up.failure.find("it takes a number"), std::string::npos) << word.set_up.failure;
}

}  // namespace
}  // namespace kilotwin::ark
