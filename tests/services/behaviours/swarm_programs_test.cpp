// The swarm programs in behaviours/ behave as documented, with a radio that delivers all messages within range.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <set>

#include "core/base/ir_calibration.h"
#include "tests/services/behaviours/swarm.hpp"

namespace kilotwin::behaviours::test {
namespace {

constexpr std::uint8_t kOff = 0, kWhite = 0x3F;

struct Place {
  double x_mm, y_mm;
};

/// The reading of a sender at this distance, an entry of the calibration.
Air::Reception heard(std::uint32_t receiver, const IrMessage& message, double distance_mm) {
  constexpr std::array<int, KILOTWIN_IR_ENTRIES> kHigh KILOTWIN_IR_HIGH, kLow KILOTWIN_IR_LOW;
  const double steps = (distance_mm - KILOTWIN_IR_CONTACT_MM) / 5;
  const auto i = static_cast<std::size_t>(std::clamp(steps + 0.5, 0.0, KILOTWIN_IR_ENTRIES - 1.0));
  return {receiver, message, static_cast<std::int16_t>(kHigh[i]), static_cast<std::int16_t>(kLow[i])};
}

/// The radio requests a message from each robot every 16 ticks. All robots within range receive it one tick later.
Air ideal(const ActuationFrame& frame, const std::vector<Place>& places, double range_mm) {
  Air air;
  const auto robots = static_cast<std::uint32_t>(places.size());
  for (std::uint32_t robot = 0; robot < robots; ++robot) {
    if ((robot * 7 + static_cast<std::uint64_t>(frame.tick.count())) % 16 == 0) air.ask.push_back(robot);
    for (std::size_t n = 0; n < frame.offer_robot.size(); ++n) {
      const std::uint32_t sender = frame.offer_robot[n];
      const double distance_mm =
          std::hypot(places[robot].x_mm - places[sender].x_mm, places[robot].y_mm - places[sender].y_mm);
      if (sender != robot && distance_mm <= range_mm)
        air.receptions.push_back(heard(robot, frame.offer_message[n], distance_mm));
    }
  }
  air.sent = frame.offer_robot;
  return air;
}

std::vector<Place> line_of(int robots, double pitch_mm) {
  std::vector<Place> places;
  for (int i = 0; i < robots; ++i) places.push_back({pitch_mm * i, 0});
  return places;
}

std::vector<Place> square_of(int side, double pitch_mm) {
  std::vector<Place> places;
  for (int i = 0; i < side * side; ++i) places.push_back({pitch_mm * (i % side), pitch_mm * (i / side)});
  return places;
}

void run(Swarm& swarm, const std::vector<Place>& places, double range_mm, int ticks) {
  for (int k = 0; k < ticks; ++k) swarm.step(ideal(swarm.frame(), places, range_mm));
}

TEST(SwarmPrograms, GradientCountsHopsAndHeals) {
  const std::vector<Place> places = line_of(8, 40);
  Swarm swarm({ready_made("gradient.c")}, 8);
  swarm.start();
  run(swarm, places, 50, 200);
  // Each robot hears only its neighbours, so the colours follow the line.
  const std::array<std::uint8_t, 8> colours{kWhite, kRed, 0x0F, kGreen, 0x3C, kBlue, 0x33, kRed};
  for (std::uint32_t robot = 0; robot < 8; ++robot) EXPECT_EQ(swarm.led(robot), colours[robot]) << robot;
  // With twice the range, half the hops suffice.
  run(swarm, places, 90, 200);
  EXPECT_EQ(swarm.led(2), kRed);
  EXPECT_EQ(swarm.led(7), 0x3C);  // four hops
  // Out of range, all robots forget their hop counts.
  run(swarm, places, 10, 200);
  EXPECT_EQ(swarm.led(0), kWhite);
  for (std::uint32_t robot = 1; robot < 8; ++robot) EXPECT_EQ(swarm.led(robot), kOff) << robot;
}

TEST(SwarmPrograms, HopCountPassesEachWaveOnOnce) {
  const std::vector<Place> places = line_of(6, 40);
  Swarm swarm({ready_made("hop_count.c")}, 6);
  swarm.start();
  std::array<int, 6> first{}, flashes{};
  std::array<std::uint8_t, 6> last{};
  for (int k = 1; k <= 240; ++k) {
    run(swarm, places, 50, 1);
    for (std::uint32_t robot = 0; robot < 6; ++robot) {
      const std::uint8_t led = swarm.led(robot);
      if (led != kOff && last[robot] == kOff) {
        ++flashes[robot];
        if (first[robot] == 0) first[robot] = k;
        EXPECT_EQ(led, robot % 2 == 1 ? kGreen : kBlue) << robot;
      }
      last[robot] = led;
    }
  }
  // One wave in the first eight seconds, 244 ticks of 32.768 ms, and it comes to the next robot after this one.
  for (std::uint32_t robot = 1; robot < 6; ++robot) {
    EXPECT_EQ(flashes[robot], 1) << robot;
    EXPECT_GT(first[robot], first[robot - 1]) << robot;
  }
}

TEST(SwarmPrograms, SyncMakesAllFlashTogether) {
  const std::vector<Place> places = square_of(3, 40);
  Swarm swarm({ready_made("sync.c")}, 9);
  swarm.start();
  auto beginnings = [&] {
    // The ticks of one period in which robots begin to flash.
    std::vector<int> ticks(9, -1);
    std::array<std::uint8_t, 9> last{};
    for (std::uint32_t robot = 0; robot < 9; ++robot) last[robot] = swarm.led(robot);
    for (int k = 0; k < 130; ++k) {
      run(swarm, places, 70, 1);
      for (std::uint32_t robot = 0; robot < 9; ++robot) {
        if (swarm.led(robot) == kWhite && last[robot] == kOff && ticks[robot] < 0) ticks[robot] = k;
        last[robot] = swarm.led(robot);
      }
    }
    return ticks;
  };
  auto spread = [](const std::vector<int>& ticks) {
    // Length of the shortest arc of the period that holds all beginnings.
    std::set<int> sorted;
    for (const int tick : ticks) sorted.insert((tick % 124 + 124) % 124);
    int gap = 124 - *sorted.rbegin() + *sorted.begin(), before = *sorted.begin();
    for (const int tick : sorted) {
      gap = std::max(gap, tick - before);
      before = tick;
    }
    return 124 - gap;
  };
  EXPECT_GT(spread(beginnings()), 15);
  run(swarm, places, 70, 124 * 10);
  EXPECT_LE(spread(beginnings()), 4);
}

TEST(SwarmPrograms, MajorityAdoptsTheMoreFrequentOpinion) {
  const std::vector<Place> places = square_of(5, 40);
  Swarm swarm({ready_made("majority.c")}, 25);
  swarm.start();
  run(swarm, places, 400, 2);
  int red = 0;
  for (std::uint32_t robot = 0; robot < 25; ++robot) red += swarm.led(robot) == kRed;
  EXPECT_EQ(red, 17);
  run(swarm, places, 400, 400);
  for (std::uint32_t robot = 0; robot < 25; ++robot) EXPECT_EQ(swarm.led(robot), kRed) << robot;
}

TEST(SwarmPrograms, OrbitTurnsOutwardsNearAndInwardsFar) {
  Swarm swarm({ready_made("orbit.c")}, 2);
  swarm.start();
  run(swarm, line_of(2, 45), 100, 40);
  EXPECT_EQ(swarm.led(0), kWhite);
  EXPECT_EQ(swarm.frame().motor_left[0], 0);
  EXPECT_EQ(swarm.led(1), kRed);
  EXPECT_EQ(swarm.frame().motor_left[1], 0);
  EXPECT_GT(swarm.frame().motor_right[1], 0);
  run(swarm, line_of(2, 80), 100, 40);
  EXPECT_EQ(swarm.led(1), kGreen);
  EXPECT_GT(swarm.frame().motor_left[1], 0);
  EXPECT_EQ(swarm.frame().motor_right[1], 0);
  run(swarm, line_of(2, 80), 10, 120);
  EXPECT_EQ(swarm.led(1), kBlue);
  EXPECT_EQ(swarm.frame().motor_left[1], 0);
  EXPECT_EQ(swarm.frame().motor_right[1], 0);
}

TEST(SwarmPrograms, EdgeFollowerMindsTheNearestNeighbour) {
  Swarm swarm({ready_made("edge_follow.c")}, 3);
  swarm.start();
  run(swarm, {{0, 0}, {45, 0}, {0, 95}}, 100, 40);
  EXPECT_EQ(swarm.led(1), kWhite);
  EXPECT_EQ(swarm.led(0), kRed);
  EXPECT_GT(swarm.frame().motor_right[0], 0);
  // The near robot is gone, so after a while the far one counts.
  run(swarm, {{0, 0}, {500, 0}, {0, 95}}, 100, 80);
  EXPECT_EQ(swarm.led(0), kGreen);
  EXPECT_GT(swarm.frame().motor_left[0], 0);
  run(swarm, {{0, 0}, {500, 0}, {0, 500}}, 100, 80);
  EXPECT_EQ(swarm.led(0), kBlue);
  EXPECT_EQ(swarm.frame().motor_left[0], 0);
}

/// The station's message for one robot.
Air station(std::uint32_t robot, unsigned type, unsigned data) {
  IrMessage packed{0xFF, 0xC0, 0, 0xFF, 0xC0, 0, 0xFF, 0xC0, 0, 0};
  packed[3] = static_cast<std::uint8_t>(robot >> 2);
  packed[4] = static_cast<std::uint8_t>((robot & 3) << 6 | type << 2 | data >> 8);
  packed[5] = static_cast<std::uint8_t>(data & 0xFF);
  Air air;
  for (std::uint32_t receiver = 0; receiver < 4; ++receiver) air.receptions.push_back({receiver, packed});
  return air;
}

TEST(SwarmPrograms, ForagerFetchesAndBringsHome) {
  Swarm swarm({ready_made("forage.c")}, 4);
  swarm.start();
  swarm.steps(2);
  EXPECT_EQ(swarm.led(2), kGreen);
  swarm.step(station(2, 3, 90));
  swarm.steps(2);
  EXPECT_GT(swarm.frame().motor_left[2], 0);  // the food is to the left
  EXPECT_EQ(swarm.frame().motor_right[2], 0);
  swarm.step(station(2, 0, 0));
  swarm.steps(2);
  EXPECT_EQ(swarm.led(2), kBlue);
  EXPECT_EQ(swarm.frame().motor_left[2], 0);
  swarm.step(station(2, 14, 0));
  swarm.steps(2);
  EXPECT_EQ(swarm.led(2), kRed);
  swarm.step(station(2, 14, 1));  // too early: the station repeats its message
  swarm.steps(2);
  EXPECT_EQ(swarm.led(2), kRed);
  swarm.steps(100);
  swarm.step(station(2, 9, 350));
  swarm.steps(2);
  EXPECT_GT(swarm.frame().motor_left[2], 0);
  EXPECT_GT(swarm.frame().motor_right[2], 0);
  swarm.step(station(2, 14, 1));
  swarm.steps(2);
  EXPECT_EQ(swarm.led(2), kGreen);
  swarm.step(station(2, 15, 0));
  swarm.steps(2);
  EXPECT_EQ(swarm.led(2), kOff);
  EXPECT_EQ(swarm.led(1), kGreen);
}

TEST(SwarmPrograms, RelayHandsTheBatonRoundWhileItWaitsInEveryWay) {
  const std::vector<Place> places = line_of(3, 40);
  Swarm swarm({ready_made("relay.c")}, 3);
  swarm.start();
  std::vector<std::uint32_t> order;
  std::vector<int> held(3, 0);
  for (int k = 0; k < 500; ++k) {
    run(swarm, places, 100, 1);
    int with_baton = 0;
    for (std::uint32_t robot = 0; robot < 3; ++robot) {
      if (swarm.led(robot) != kRed) continue;
      ++with_baton;
      ++held[robot];
      if (order.empty() || order.back() != robot) order.push_back(robot);
    }
    EXPECT_LE(with_baton, 1) << k;
  }
  ASSERT_GE(order.size(), 6u);
  for (std::size_t n = 0; n < order.size(); ++n) EXPECT_EQ(order[n], n % 3);
  // Half a second by delay, then 31 ticks of the clock.
  EXPECT_NEAR(held[1], 46.0 * static_cast<double>((order.size() + 1) / 3), 46);
}

TEST(SwarmPrograms, PhototaxisChangesLegsAboutTheMeanOfTheLight) {
  // Light that rises for 40 ticks and falls for 40; the robot averages over some ticks.
  Swarm swarm({"#define get_ambientlight own_light\n#include \"" + ready_made("phototaxis.c") +
               "\"\n"
               "int16_t own_light() { int p = kilo_ticks % 80; return 300 + 8 * (p < 40 ? p : 80 - p); }\n"},
              1);
  swarm.start();
  std::vector<int> changes;
  std::uint8_t last = swarm.led(0);
  for (int k = 3; k < 240; ++k) {
    swarm.step();
    if (swarm.led(0) != last) changes.push_back(k % 80);
    last = swarm.led(0);
    EXPECT_EQ(swarm.frame().motor_left[0] > 0, last == kRed);
    EXPECT_EQ(swarm.frame().motor_right[0] > 0, last == kGreen);
  }
  // To the right while the average falls and is below the mean, to the left while it rises and is above it, again and again.
  ASSERT_GE(changes.size(), 5u);
  for (std::size_t n = 0; n < changes.size(); ++n) {
    EXPECT_GE(changes[n], n % 2 == 0 ? 60 : 20) << n;
    EXPECT_LE(changes[n], n % 2 == 0 ? 79 : 42) << n;
  }
}

}  // namespace
}  // namespace kilotwin::behaviours::test
