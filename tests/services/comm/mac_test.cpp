// Medium access: tx_clock and period, carrier sense, abort and back-off, the slot.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "idl/checkpoint.pb.h"
#include "tests/services/comm/fake_hosts.hpp"

namespace kilotwin::comm {
namespace {

using testing::make_plan;
using testing::Swarm;

constexpr Cycles kTick = 262144;
constexpr std::uint8_t kIdle = static_cast<std::uint8_t>(LifeCycle::kIdle);
constexpr std::uint8_t kRunning = static_cast<std::uint8_t>(LifeCycle::kRunning);
const std::string kExact = "radio { oscillator_sd: 0 range_mm: 100 } ";

RunPlan seeded(const std::string& experiment, std::uint64_t seed, const std::vector<testing::ScenePose>& poses) {
  return make_plan(experiment + " seed: " + std::to_string(seed), poses);
}

/// A plan of two robots 40 mm apart. Their timers have the same rate and differ in phase by this number of cycles; robot
/// `earlier` is first.
struct Duel {
  RunPlan plan;
  std::uint32_t earlier;
  Cycles apart;
};
Duel make_duel(Cycles least, Cycles most) {
  const std::vector<testing::ScenePose> poses{{0, 0, 0}, {40, 0, 0}};
  for (std::uint64_t seed = 1;; ++seed) {
    const TickTimers timers(seeded(kExact, seed, poses));
    const Cycles difference = timers.next(1) - timers.next(0);
    const Cycles apart = difference < 0 ? -difference : difference;
    if (apart >= least && apart <= most) return {seeded(kExact, seed, poses), difference < 0 ? 1u : 0u, apart};
  }
}

TEST(Mac, LoneRobotSendsOncePerSixteenTicks) {
  for (const char* sd : {"0", "0.01"}) {
    const RunPlan plan = make_plan("radio { oscillator_sd: " + std::string(sd) + " }", {{0, 0, 0}});
    Swarm swarm(plan);
    std::size_t kilo_ticks = 0, sent = 0;
    for (; kilo_ticks < 150 * 32; swarm.step()) {
      kilo_ticks += swarm.frames[0].kilo_ticks[0];
      sent += swarm.frames[0].sent.size();
    }
    swarm.step();  // The last packet may still be on the air.
    sent += swarm.frames[0].sent.size();
    EXPECT_EQ(sent, 300u);
    EXPECT_EQ(swarm.radio.counters().attempted, 300u);
  }
}

TEST(Mac, PacketTakesItsAirTime) {
  int straddling = 0;
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    const RunPlan plan = seeded("", seed, {{0, 0, 0}});
    const TickTimers timers(plan);
    const Cycles start = timers.next(0) + 15 * timers.period(0), end = start + 34970;
    straddling += start / kTick != end / kTick;
    Swarm swarm(plan);
    while (swarm.now.count() <= end / kTick) {
      swarm.step();
      EXPECT_EQ(swarm.frames[0].sent.size(), swarm.now.count() == end / kTick + 1 ? 1u : 0u) << seed;
    }
  }
  EXPECT_GT(straddling, 10);
}

TEST(Mac, SimultaneousStartsAreNotDetected) {
  const Duel duel = make_duel(0, kNoticed - 1);
  Swarm swarm(duel.plan);
  while (swarm.now.count() < 20) swarm.step();
  const auto& counters = swarm.radio.counters();
  EXPECT_EQ(counters.attempted, 2u);
  EXPECT_EQ(counters.sent, 2u);
  EXPECT_EQ(counters.aborted, 0u);
  EXPECT_EQ(counters.received, 0u);
  EXPECT_EQ(counters.collided, 2u);
}

/// Robot 1 does not detect robot 0, so it starts while robot 0 polls its receiver.
TEST(Mac, StartPulseInTheLeadingOctetAbortsTheEarlierPacket) {
  const std::string one_way =
      "radio { model: PROPAGATION oscillator_sd: 0 propagation { packet_sd_db: 0 link { sender: 0 receiver: 1 "
      "offset_db: "
      "-100 } } }";
  const std::vector<testing::ScenePose> poses{{0, 0, 0}, {40, 0, 0}};
  const auto apart = [&](std::uint64_t seed) {
    const TickTimers timers(seeded(one_way, seed, poses));
    return timers.next(1) - timers.next(0);
  };
  std::uint64_t seed = 1;
  // Both clocks exceed the period, so both robots send at their first interrupts.
  const auto ready = [&](std::uint64_t s) {
    const TickTimers timers(seeded(one_way, s, poses));
    return timers.next_clock(0) > 3906 && timers.next_clock(1) > 3906 && timers.next(0) < kTick &&
           timers.next(1) < kTick;
  };
  while (apart(seed) < kDeaf || apart(seed) >= kListening || !ready(seed)) ++seed;
  const RunPlan plan = seeded(one_way, seed, poses);
  Swarm swarm(plan);
  std::vector<std::uint32_t> sent;
  std::vector<int> kilo_ticks(2, 0);
  while (swarm.now.count() < 14) {
    swarm.step();
    sent.insert(sent.end(), swarm.frames[0].sent.begin(), swarm.frames[0].sent.end());
    for (std::size_t i = 0; i < 2; ++i) kilo_ticks[i] += swarm.frames[0].kilo_ticks[i];
  }
  EXPECT_EQ(sent, (std::vector<std::uint32_t>{1, 0}));
  EXPECT_EQ(swarm.radio.counters().attempted, 3u);
  EXPECT_EQ(swarm.radio.counters().aborted, 1u);
  EXPECT_EQ(swarm.radio.counters().received, 1u);
  // Same rate, almost the same phase: the back-off causes one additional tick.
  EXPECT_EQ(kilo_ticks[0], kilo_ticks[1] + 1);
}

TEST(Mac, LaterRobotWaitsForItsNextTick) {
  for (const auto& [least, most] : {std::pair{kNoticed, kNoticed + 100}, std::pair{kListening, kListening + 500},
                                    std::pair{kPacket - 3000, kPacket - 1}}) {
    const Duel duel = make_duel(least, most);
    const TickTimers timers(duel.plan);
    const std::uint32_t later = 1 - duel.earlier;
    Swarm swarm(duel.plan);
    std::vector<Cycles> reported(2, -1);
    while (swarm.now.count() < 22) {
      swarm.step();
      for (const std::uint32_t robot : swarm.frames[0].sent) reported[robot] = swarm.now.count();
    }
    const auto reported_at = [&](std::uint32_t robot, std::int64_t periods) {
      return (timers.next(robot) + periods * timers.period(robot) + kPacket) / kTick + 1;
    };
    EXPECT_EQ(reported[duel.earlier], reported_at(duel.earlier, 15));
    EXPECT_EQ(reported[later], reported_at(later, 16));
    EXPECT_EQ(swarm.radio.counters().attempted, 2u);
    EXPECT_EQ(swarm.radio.counters().received, 2u);
  }
}

TEST(Mac, RobotsInContactThatAlwaysSendDetectEveryConflict) {
  std::vector<testing::ScenePose> poses;
  for (int pair = 0; pair < 50; ++pair) {
    poses.push_back({500.0 * pair, 0, 0});
    poses.push_back({500.0 * pair + 33, 0, 0});
  }
  const RunPlan plan = make_plan("radio { range_mm: 100 }", poses);
  Swarm swarm(plan);
  swarm.hosts.tx_period.assign(poses.size(), 0);
  while (swarm.now.count() < 2000) swarm.step();
  const auto& c = swarm.radio.counters();
  EXPECT_GT(c.sent, 40000u);
  EXPECT_LE(c.attempted - c.sent - c.aborted, poses.size());
  EXPECT_EQ(c.received + c.collided, c.sent);
  // Robots collide only if both start within 16 of the 262144 cycles of a tick; start pulses are always detected.
  EXPECT_LT(static_cast<double>(c.collided), 0.002 * static_cast<double>(c.sent));
  EXPECT_EQ(c.aborted, 0u);
}

/// A program never sends, so tx_clock runs through its 16 bits. The radio asks the robot exactly when it exceeds tx_period.
TEST(Mac, AsksExactlyBeforePossibleAttempts) {
  const RunPlan plan =
      make_plan("radio { oscillator_sd: 0.05 }", testing::grid_crowd(20, 200, testing::Facing::kRight));
  Swarm swarm(plan);
  swarm.hosts.sends.assign(20, 0);
  TickTimers timers(plan);
  swarm.step();
  for (std::uint32_t i = 0; i < 20; ++i) timers.pass(i, kTick);
  std::size_t asks = 0;
  for (; swarm.now.count() < 700; swarm.step()) {
    const Cycles now = swarm.now.count() * kTick;
    std::vector<std::uint32_t> expected;
    for (std::uint32_t i = 0; i < 20; ++i) {
      timers.pass(i, now);
      TickTimers ahead = timers;
      ahead.pass(i, now + kTick);
      bool exceeds = false;
      for (; ahead.next(i) < now + 2 * kTick; ahead.interrupt(i)) exceeds = exceeds || ahead.next_clock(i) > 3906;
      if (exceeds) expected.push_back(i);
    }
    asks += expected.size();
    ASSERT_EQ(swarm.frames[0].ask, expected) << swarm.now.count();
  }
  EXPECT_GT(asks, 10000u);
  EXPECT_EQ(swarm.radio.counters().attempted, 0u);
}

/// The robot is stopped at each tick around its first message: requested, answered, on the air, reported.
TEST(Mac, SlotIsEmptiedOutsideRunning) {
  std::uint64_t unreported = 0;
  for (std::int64_t stop = 10; stop < 20; ++stop) {
    const RunPlan plan = make_plan(kExact, {{0, 0, 0}});
    Swarm swarm(plan);
    std::size_t sent = 0;
    const auto run = [&](std::int64_t ticks) {
      for (std::int64_t k = 0; k < ticks; ++k) {
        swarm.step();
        sent += swarm.frames[0].sent.size();
      }
    };
    run(stop);
    swarm.hosts.life_cycle[0] = kIdle;
    run(3);  // Transmissions on the air have ended.
    const auto stopped = swarm.radio.counters();
    EXPECT_EQ(stopped.attempted, stopped.sent);
    unreported += stopped.sent - sent;
    run(40);
    EXPECT_TRUE(swarm.frames[0].ask.empty());
    EXPECT_EQ(swarm.radio.counters().attempted, stopped.attempted);
    swarm.hosts.life_cycle[0] = kRunning;
    run(64);
    EXPECT_GE(swarm.radio.counters().sent, stopped.sent + 3);
  }
  EXPECT_LE(unreported, 1u);
}

/// The robot is stopped at the border of the ticks between which its packet is on the air. The packet is received completely,
/// but its success is not reported.
TEST(Mac, TransmissionsOfStoppedRobotsEndUnreported) {
  int straddling = 0;
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    const RunPlan plan = seeded(kExact, seed, {{0, 0, 0}, {40, 0, 0}});
    const TickTimers timers(plan);
    const Cycles start = timers.next(0) + 15 * timers.period(0);
    if (start / kTick == (start + kPacket) / kTick) continue;
    ++straddling;
    Swarm swarm(plan);
    swarm.hosts.sends[1] = 0;
    while (swarm.now.count() < start / kTick) swarm.step();
    swarm.hosts.life_cycle[0] = kIdle;  // from the next tick on
    std::size_t reported = 0;
    RadioEngine loaded(plan);
    for (int k = 0; k < 20; ++k) {
      swarm.step();
      reported += swarm.frames[0].sent.size();
      if (k > 0) continue;
      proto::RadioState part;
      swarm.radio.save(part);
      const proto::RadioState* const parts[] = {&part};
      loaded.load(swarm.now, parts);
      loaded.step(swarm.now, swarm.hosts.inputs(swarm.now));
      RadioFrame frame;
      loaded.emit(HostId{0}, frame);
      EXPECT_TRUE(frame.sent.empty());
      EXPECT_EQ(loaded.counters().sent, 1u);
    }
    EXPECT_EQ(reported, 0u);
    EXPECT_EQ(swarm.radio.counters().sent, 1u);
    EXPECT_EQ(swarm.radio.counters().received, 1u);
  }
  EXPECT_GE(straddling, 5);
}

TEST(Mac, OnlyRunningRobotsSend) {
  const RunPlan plan = make_plan("", testing::grid_crowd(8, 200, testing::Facing::kRight));
  Swarm swarm(plan);
  const LifeCycle all[] = {LifeCycle::kSleeping, LifeCycle::kIdle,     LifeCycle::kBattery, LifeCycle::kSetup,
                           LifeCycle::kRunning,  LifeCycle::kCharging, LifeCycle::kMoving,  LifeCycle::kFailed};
  for (std::size_t i = 0; i < 8; ++i) swarm.hosts.life_cycle[i] = static_cast<std::uint8_t>(all[i]);
  swarm.step();
  for (int k = 0; k < 100; ++k) {
    swarm.step();
    for (const std::uint32_t robot : swarm.frames[0].sent) EXPECT_EQ(robot, 4u);
    for (const std::uint8_t ticks : swarm.frames[0].kilo_ticks) EXPECT_LE(ticks, 2u);
  }
  EXPECT_GE(swarm.radio.counters().sent, 5u);
}

TEST(Mac, PeriodCanChangeAnyTime) {
  const RunPlan plan = make_plan(kExact, {{0, 0, 0}});
  Swarm swarm(plan);
  const auto sent_in = [&](std::uint16_t period, int ticks) {
    swarm.hosts.tx_period[0] = period;
    for (int k = 0; k < 20; ++k) swarm.step();
    const auto before = swarm.radio.counters().sent;
    for (int k = 0; k < ticks; ++k) swarm.step();
    return swarm.radio.counters().sent - before;
  };
  EXPECT_NEAR(static_cast<double>(sent_in(3906, 320)), 20, 1);
  EXPECT_NEAR(static_cast<double>(sent_in(2039, 320)), 40, 1);  // 8 * 255 exceeds it
  EXPECT_NEAR(static_cast<double>(sent_in(2040, 360)), 40, 1);  // 8 * 255 does not
  EXPECT_EQ(sent_in(65535, 600), 0u);
}

}  // namespace
}  // namespace kilotwin::comm
