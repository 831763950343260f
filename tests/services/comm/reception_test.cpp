// Reception: range, overlap, loss, readings.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string>

#include "services/comm/neighbourhood.hpp"
#include "tests/services/comm/fake_hosts.hpp"

namespace kilotwin::comm {
namespace {

using testing::make_plan;
using testing::Swarm;

/// Runs a swarm and calls f(frame, index) for every reception.
template <class F> void run(Swarm& swarm, std::int64_t ticks, F f) {
  for (std::int64_t k = 0; k < ticks; ++k) {
    swarm.step();
    for (const RadioFrame& frame : swarm.frames) {
      for (std::size_t n = 0; n < frame.reception_robot.size(); ++n) f(frame, n);
    }
  }
}

TEST(Reception, ReachesToTheRangeAndNoFarther) {
  const double far = std::nextafter(80.0, 100.0);
  const RunPlan plan = make_plan("radio { range_mm: 100 }", {{0, 0, 0}, {60, 80, 0}, {-60, far, 0}, {0, -100, 0}});
  Swarm swarm(plan);
  swarm.hosts.sends = {1, 0, 0, 0};
  std::vector<int> heard(4, 0);
  run(swarm, 320, [&](const RadioFrame& frame, std::size_t n) { ++heard[frame.reception_robot[n]]; });
  EXPECT_GE(heard[1], 19);
  EXPECT_EQ(heard, (std::vector<int>{0, heard[1], 0, heard[1]}));
}

TEST(Reception, DeliversMessagesAndCountsPairs) {
  const RunPlan plan =
      make_plan("radio { range_mm: 100 } recording { messages: true }", {{0, 0, 0}, {50, 0, 0}, {500, 0, 0}});
  Swarm swarm(plan);
  swarm.hosts.message = [](std::uint32_t robot, Tick) {
    return IrMessage{9, 8, 7, 6, 5, 4, 3, 2, 1, static_cast<std::uint8_t>(robot)};
  };
  std::vector<std::uint32_t> heard(2, 0);
  run(swarm, 640, [&](const RadioFrame& frame, std::size_t n) {
    const IrMessage& message = frame.messages[frame.reception_message[n]];
    const std::uint32_t receiver = frame.reception_robot[n];
    ASSERT_LT(receiver, 2u);
    EXPECT_EQ(message, (IrMessage{9, 8, 7, 6, 5, 4, 3, 2, 1, static_cast<std::uint8_t>(1 - receiver)}));
    ++heard[receiver];
  });
  std::vector<std::uint32_t> table;
  for (const PairCount& pair : swarm.radio.pair_counts())
    table.insert(table.end(), {pair.receiver, pair.sender, pair.count});
  ASSERT_EQ(table.size(), 15u);
  EXPECT_EQ(table, (std::vector<std::uint32_t>{0, 0, table[2], 0, 1, heard[0], 1, 0, heard[1], 1, 1, table[11], 2,
                                               2, table[14]}));
  EXPECT_GE(table[2], heard[1]);
  EXPECT_GE(table[11], heard[0]);
  EXPECT_EQ(table[2] + table[11] + table[14], swarm.radio.counters().sent);
}

/// A packet with a wrong CRC takes its time on the air like any other, and reaches the receivers' hosts with its error.
TEST(Reception, PacketsWithAWrongCrcCountAsSentAlone) {
  for (const char* const model : {"radio { range_mm: 100 }", "radio { range_mm: 100 model: SIMPLE }"}) {
    const RunPlan plan = make_plan(model, {{0, 0, 0}, {50, 0, 0}});
    Swarm swarm(plan);
    swarm.hosts.crc_error = [](std::uint32_t robot, Tick) { return static_cast<std::uint16_t>(robot * 0x8001); };
    std::uint32_t heard[2] = {};
    run(swarm, 640, [&](const RadioFrame& frame, std::size_t n) {
      ++heard[frame.reception_robot[n]];
      const std::uint32_t m = frame.reception_message[n];
      const std::uint16_t error = frame.message_crc_error.empty() ? 0 : frame.message_crc_error.at(m);
      EXPECT_EQ(error, frame.reception_robot[n] == 0 ? 0x8001 : 0);
    });
    EXPECT_GT(heard[0], 30u) << model;
    EXPECT_GT(heard[1], 30u) << model;
    EXPECT_EQ(swarm.radio.radio_counts()[0].received, 0u) << model;
    EXPECT_EQ(swarm.radio.radio_counts()[1].received, heard[1]) << model;
    EXPECT_EQ(swarm.radio.counters().received, heard[1]) << model;
  }
}

/// A - B - C; A and C are out of each other's range. Their first attempts fall into the same kilo_tick with independent uniform
/// phases. They overlap with probability 2 q - q^2, with q = air time / period. 3000 rows of three robots; a true generator
/// exceeds the bound of 4.5 standard deviations once in 150000 seeds.
TEST(Reception, HiddenTerminalsLoseAsOftenAsTheyOverlap) {
  constexpr std::uint32_t kLines = 3000;
  std::vector<testing::ScenePose> poses;
  for (std::uint32_t i = 0; i < kLines; ++i) {
    const double x = 500.0 * (i % 60), y = 500.0 * (i / 60);
    for (const double dx : {-90.0, 0.0, 90.0}) poses.push_back({x + dx, y, 0});
  }
  const RunPlan plan = make_plan("radio { range_mm: 100 oscillator_sd: 0 }", poses);
  Swarm swarm(plan);
  for (std::uint32_t i = 0; i < kLines; ++i) swarm.hosts.sends[3 * i + 1] = 0;
  std::uint64_t received = 0;
  run(swarm, 18, [&](const RadioFrame&, std::size_t) { ++received; });
  const auto& c = swarm.radio.counters();
  EXPECT_EQ(c.attempted, 2 * kLines);
  EXPECT_EQ(c.sent, 2 * kLines);
  EXPECT_EQ(c.received, received);
  EXPECT_EQ(c.received + c.collided, 2 * kLines);
  // Exactly the rows with overlapping phases, also if one packet ends a tick before the other.
  const TickTimers timers(plan);
  std::uint64_t overlaps = 0;
  for (std::uint32_t i = 0; i < kLines; ++i)
    overlaps += std::abs(timers.next(3 * i) - timers.next(3 * i + 2)) < kPacket;
  EXPECT_EQ(c.collided, 2 * overlaps);
  const double q = 34970.0 / 262144.0, p = 2 * q - q * q;
  EXPECT_NEAR(static_cast<double>(c.collided) / 2, p * kLines, 4.5 * std::sqrt(kLines * p * (1 - p)));
}

TEST(Reception, IsLostAtTheStatedRate) {
  // Senders far apart, each with one receiver.
  std::vector<testing::ScenePose> poses;
  for (int i = 0; i < 200; ++i) {
    poses.push_back({400.0 * i, 0, 0});
    poses.push_back({400.0 * i + 50, 0, 0});
  }
  const RunPlan plan = make_plan("radio { range_mm: 100 loss: 0.3 } arena { width_mm: 200000 }", poses);
  Swarm swarm(plan);
  for (std::size_t i = 1; i < 400; i += 2) swarm.hosts.sends[i] = 0;
  run(swarm, 640, [](const RadioFrame&, std::size_t) {});
  const auto& c = swarm.radio.counters();
  EXPECT_EQ(c.collided, 0u);
  EXPECT_EQ(c.received + c.faded, c.sent);
  const double n = static_cast<double>(c.sent);
  EXPECT_GT(n, 7000);
  EXPECT_NEAR(static_cast<double>(c.faded), 0.3 * n, 4.5 * std::sqrt(n * 0.3 * 0.7));
}

TEST(Reception, NeedsAReceiverThatListens) {
  const std::string groups = "robots { count: 3 } robots { count: 1 body: TRACKED } radio { range_mm: 100 }";
  const RunPlan plan = make_plan(groups, {{0, 0, 0}, {50, 0, 0}, {0, 50, 0}, {-50, 0, 0}});
  Swarm swarm(plan);
  swarm.hosts.sends.assign(4, 1);
  swarm.hosts.life_cycle[1] = static_cast<std::uint8_t>(LifeCycle::kIdle);
  swarm.hosts.life_cycle[2] = static_cast<std::uint8_t>(LifeCycle::kSleeping);
  swarm.step();
  run(swarm, 320, [](const RadioFrame& frame, std::size_t n) { EXPECT_EQ(frame.reception_robot[n], 1u); });
  const auto& c = swarm.radio.counters();
  EXPECT_GE(c.sent, 19u);
  EXPECT_EQ(c.received, c.sent);  // By the idle robot; the sleeping and the real robot neither receive nor send.
  EXPECT_EQ(c.collided, 0u);
}

TEST(Ranging, FollowsTheCalibration) {
  const Ranging ranging;
  const double low[] = {880, 750, 639, 544, 464, 395, 336, 287, 244, 208, 177, 151, 129, 110};
  const double high[] = {1000, 1000, 864, 736, 627, 534, 455, 388, 330, 281, 240, 204, 174, 148};
  for (std::size_t i = 0; i < 14; ++i) {
    const Gains gains = ranging.gains(33 + 5.0 * static_cast<double>(i));
    EXPECT_EQ(gains.low, low[i]);
    EXPECT_EQ(gains.high, high[i]);
  }
  EXPECT_EQ(ranging.gains(35.5).low, 815);
  EXPECT_EQ(ranging.gains(30.5).low, 945);
  EXPECT_EQ(ranging.gains(20).low, 1023);
  EXPECT_EQ(ranging.gains(20).high, 1000);
  for (double d = 98; d < 400; d += 0.7) {
    EXPECT_NEAR(ranging.gains(d).low, 110 * std::exp(-(d - 98) / 31.2), 0.9) << d;
    EXPECT_LE(ranging.gains(d + 0.7).high, ranging.gains(d).high);
  }
  EXPECT_EQ(ranging.gains(1e6).high, 0);
}

TEST(Neighbourhood, FindsAllInRangeAnywhere) {
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    const double width = seed % 3 == 0 ? 300 : seed % 3 == 1 ? 3000 : 300000;
    const auto poses = testing::random_crowd(200, width, width, 0, seed);
    Neighbourhood neighbourhood(130, 130, 200);
    for (std::uint32_t i = 0; i < 200; ++i) neighbourhood.place(i, poses[i].x_mm, poses[i].y_mm);
    neighbourhood.sort();
    for (std::uint32_t i = 0; i < 200; ++i) {
      std::vector<std::uint32_t> found, expected;
      neighbourhood.visit(i, [&](std::uint32_t other, double) { found.push_back(other); });
      std::sort(found.begin(), found.end());
      std::vector<std::uint32_t> cells;
      neighbourhood.visit_cells(i, 2, [&](std::uint32_t cell) { cells.push_back(cell); });
      for (std::uint32_t j = 0; j < 200; ++j) {
        const double dx = poses[i].x_mm - poses[j].x_mm, dy = poses[i].y_mm - poses[j].y_mm;
        if (j != i && dx * dx + dy * dy <= 130 * 130) expected.push_back(j);
        if (dx * dx + dy * dy <= 4 * 130 * 130) {
          EXPECT_EQ(std::count(cells.begin(), cells.end(), neighbourhood.cell_of(j)), 1);
        }
      }
      ASSERT_EQ(found, expected);
    }
  }
}

}  // namespace
}  // namespace kilotwin::comm
