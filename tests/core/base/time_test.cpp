#include "core/base/time.hpp"

#include <gtest/gtest.h>

#include "core/base/pose.hpp"

namespace kilotwin {
namespace {

TEST(TickLength, OfTheFirmware) {
  const TickLength length(1u << 18);
  EXPECT_EQ(length.seconds(), 0.032768);
  EXPECT_EQ(length.seconds_at(Tick{1000}), 1000 * 0.032768);
  EXPECT_EQ(length.at_or_after(0), Tick{0});
  EXPECT_EQ(length.at_or_after(1e-9), Tick{1});
  EXPECT_EQ(length.at_or_after(60), Tick{1832});  // 1831.05 ticks
}

TEST(TickLength, AtOrAfterIsTheFirstSuchTick) {
  for (const std::uint32_t cycles : {1u << 15, 1u << 18, 262145u, 1u << 20}) {
    const TickLength length(cycles);
    for (std::int64_t tick = 0; tick < 5000; ++tick) {
      const double seconds = length.seconds_at(Tick{tick});
      EXPECT_EQ(length.at_or_after(seconds * (1 + 1e-12) + 1e-9), Tick{tick + 1});
      EXPECT_EQ(length.at_or_after(seconds * (1 - 1e-12)), Tick{tick});
    }
  }
}

TEST(Pose, WrappedLiesInTheHalfOpenTurn) {
  EXPECT_EQ(wrapped(kPi), -kPi);
  EXPECT_EQ(wrapped(-kPi), -kPi);
  EXPECT_EQ(wrapped(0.25), 0.25);
  for (double angle = -20; angle < 20; angle += 0.013) {
    const double in = wrapped(angle);
    EXPECT_GE(in, -kPi);
    EXPECT_LT(in, kPi);
    const double turns = (angle - in) / (2 * kPi);
    EXPECT_NEAR(turns, static_cast<double>(static_cast<int>(turns + (turns < 0 ? -0.5 : 0.5))), 1e-12);
  }
}

}  // namespace
}  // namespace kilotwin
