#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <random>

#include "services/ark/virtual_environment.hpp"

namespace kilotwin::ark {
namespace {

std::unique_ptr<VirtualEnvironment> hub(double x_mm, double y_mm, double radius_mm) {
  return make_environment(HubSettings{x_mm, y_mm, radius_mm}, 2000);
}

ArkMessage seen_from(VirtualEnvironment& environment, double x_mm, double y_mm, double heading_rad,
                     std::uint32_t robot = 7) {
  return environment.sense({robot, {x_mm, y_mm, heading_rad}, 0}).value();
}

TEST(HubEnvironment, TellsInsideFromOutside) {
  const auto environment = hub(100, -50, 300);
  EXPECT_EQ(seen_from(*environment, 100, -50, 0).type, 1);
  EXPECT_EQ(seen_from(*environment, 400, -50, 0).type, 1);  // the rim
  EXPECT_EQ(seen_from(*environment, 400.001, -50, 0).type, 0);
  EXPECT_EQ(seen_from(*environment, 100 + 180, -50 - 240, 0).type, 1);
  EXPECT_EQ(seen_from(*environment, 100, -50, 0, 1022).id, 1022);
}

TEST(HubEnvironment, BearsAnticlockwiseFromTheHeading) {
  const auto environment = hub(0, 0, 10);
  EXPECT_EQ(seen_from(*environment, -100, 0, 0).payload, 0);
  EXPECT_EQ(seen_from(*environment, 0, -100, 0).payload, 90);
  EXPECT_EQ(seen_from(*environment, 100, 0, 0).payload, 180);
  EXPECT_EQ(seen_from(*environment, 0, 100, 0).payload, 270);
  EXPECT_EQ(seen_from(*environment, 0, 100, kPi / 2).payload, 180);
  EXPECT_EQ(seen_from(*environment, -100, 0, 0.25 * kPi / 180).payload,
            0);  // -0.25 degrees is nearest to 0, not to 360
  EXPECT_EQ(seen_from(*environment, -100, 0, kPi / 180).payload, 359);
}

TEST(HubEnvironment, IsWithinHalfADegreeEverywhere) {
  const auto environment = hub(30, 40, 10);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> place(-1000, 1000), angle(-kPi, kPi);
  for (int n = 0; n < 100000; ++n) {
    const double x = place(random), y = place(random), heading = angle(random);
    const ArkMessage message = seen_from(*environment, x, y, heading);
    ASSERT_LT(message.payload, 360);
    const double exact = (std::atan2(40 - y, 30 - x) - heading) * 180 / kPi;
    ASSERT_LE(std::abs(std::remainder(message.payload - exact, 360)), 0.5 + 1e-9);
  }
}

}  // namespace
}  // namespace kilotwin::ark
