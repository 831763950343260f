#include "services/comm/tick_timers.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "tests/support/scenes.hpp"

namespace kilotwin::comm {
namespace {

RunPlan plan_of(std::uint32_t robots, double sd, std::uint64_t seed = 1) {
  return testing::make_plan("radio { oscillator_sd: " + std::to_string(sd) + " } seed: " + std::to_string(seed),
                            testing::grid_crowd(robots, 40, testing::Facing::kRight));
}

TEST(TickTimers, RatesAndPhasesHaveTheirDistributions) {
  constexpr std::uint32_t kRobots = 4000;
  const TickTimers timers(plan_of(kRobots, 0.005));
  double sum = 0, squares = 0, phase = 0;
  for (std::uint32_t i = 0; i < kRobots; ++i) {
    const double rate = 262144.0 / static_cast<double>(timers.period(i)) - 1;
    sum += rate;
    squares += rate * rate;
    EXPECT_GE(timers.next(i), 0);
    EXPECT_LT(timers.next(i), timers.period(i));
    phase += static_cast<double>(timers.next(i)) / static_cast<double>(timers.period(i));
  }
  // Five standard errors of each estimate.
  EXPECT_NEAR(sum / kRobots, 0, 5 * 0.005 / std::sqrt(kRobots));
  EXPECT_NEAR(std::sqrt(squares / kRobots), 0.005, 5 * 0.005 / std::sqrt(2.0 * kRobots));
  EXPECT_NEAR(phase / kRobots, 0.5, 5 / std::sqrt(12.0 * kRobots));
}

TEST(TickTimers, CountOneTickPerPeriodOfTheirOwnOscillator) {
  TickTimers timers(plan_of(50, 0.05));
  for (std::uint32_t i = 0; i < 50; ++i) {
    const Cycles first = timers.next(i);
    std::int64_t ticks = 0;
    for (Cycles end = 262144; end <= 2000 * 262144; end += 262144) {
      timers.begin_tick();
      timers.pass(i, end);
      ticks += timers.counts()[i];
    }
    EXPECT_EQ(ticks, (2000 * 262144 - 1 - first) / timers.period(i) + 1);
  }
}

/// The timer is a counter of 8 bits. Regular interrupts keep their phase for any value of the compare register in between.
TEST(TickTimers, BackOffInsertsOneInterrupt) {
  for (int value = 0; value < 256; ++value) {
    TickTimers timers(plan_of(1, 0));
    const Cycles first = timers.next(0), period = timers.period(0);
    timers.interrupt(0);
    timers.back_off(0, first + kListening - 1, static_cast<std::uint8_t>(value));
    // The counter is at most 2 when the start pulse is detected: the values 0 and 1 match one period later.
    const Cycles expected = first + (value < 2 ? period : 0) + (value + 1) * kTimerCount;
    EXPECT_EQ(timers.next(0), expected) << value;
    EXPECT_EQ(timers.next_clock(0), 255 + value);
    timers.interrupt(0);
    EXPECT_EQ(timers.next(0), first + (value < 2 ? 2 : value == 255 ? 2 : 1) * period) << value;
    EXPECT_EQ(timers.next_clock(0), 2 * 255 + value);
  }
}

TEST(TickTimers, PredictInterruptsExactly) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    TickTimers timers(plan_of(1, 0.05, seed));
    timers.interrupt(0);
    timers.back_off(0, timers.next(0) - timers.period(0) + 1000, static_cast<std::uint8_t>(seed));
    for (Cycles from = 0; from < 300 * 262144; from += 262144) {
      const bool predicted = timers.exceeds(0, 3906, from, from + 262144);
      timers.pass(0, from);
      bool exceeded = false;
      for (; timers.next(0) < from + 262144; timers.interrupt(0))
        exceeded = exceeded || timers.next_clock(0) > 3906;
      ASSERT_EQ(predicted, exceeded) << seed << " " << from;
    }
  }
}

}  // namespace
}  // namespace kilotwin::comm
