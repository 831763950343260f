// Counts are consistent for any messages, periods and positions. Meant to run with sanitizers.
#include <gtest/gtest.h>

#include <array>
#include <random>
#include <set>

#include "idl/checkpoint.pb.h"
#include "tests/services/comm/fake_hosts.hpp"

namespace kilotwin::comm {
namespace {

constexpr std::uint32_t kFuzzedRobots = 40;

struct Case {
  const char* radio;
  std::uint64_t seed;
};
void PrintTo(const Case& c, std::ostream* out) { *out << c.radio << ", seed " << c.seed; }

class RadioFuzz : public ::testing::TestWithParam<Case> {};

TEST_P(RadioFuzz, CountsAreConsistent) {
  std::mt19937_64 random(GetParam().seed);
  const auto below = [&](std::uint64_t n) { return random() % n; };
  std::vector<testing::ScenePose> poses;
  for (std::uint32_t i = 0; i < kFuzzedRobots; ++i)
    poses.push_back(
        {static_cast<double>(below(400)), static_cast<double>(below(400)), 0.01 * static_cast<double>(below(700))});
  const RunPlan plan = testing::make_plan(GetParam().radio, poses);
  testing::Swarm swarm(plan);
  // Periods from 0 to 65535, and messages of any content and type, including those of the overhead controller.
  constexpr std::array<std::uint16_t, 7> kPeriods{0, 1, 254, 255, 3906, 65534, 65535};
  std::set<IrMessage> offered;
  swarm.hosts.message = [&](std::uint32_t, Tick) {
    IrMessage message;
    for (auto& octet : message) octet = static_cast<std::uint8_t>(below(5) == 0 ? 0xff * below(2) : below(256));
    if (below(2) == 0) message[9] = static_cast<std::uint8_t>(0x80 + below(0x10));
    offered.insert(message);
    return message;
  };
  const std::array<LifeCycle, 5> lives{LifeCycle::kRunning, LifeCycle::kRunning, LifeCycle::kIdle,
                                       LifeCycle::kSleeping, LifeCycle::kFailed};
  std::uint64_t receptions = 0;
  for (int k = 0; k < 600; ++k) {
    for (int n = 0; n < 3; ++n) {
      const auto robot = static_cast<std::uint32_t>(below(kFuzzedRobots));
      swarm.hosts.tx_period[robot] =
          below(2) == 0 ? kPeriods[below(kPeriods.size())] : static_cast<std::uint16_t>(below(65536));
      swarm.hosts.sends[robot] = below(8) != 0;
      if (below(10) == 0) swarm.hosts.life_cycle[robot] = static_cast<std::uint8_t>(lives[below(lives.size())]);
      // Positions that coincide, or lie outside the arena.
      if (below(20) == 0) swarm.hosts.poses[robot] = swarm.hosts.poses[below(kFuzzedRobots)];
      if (below(50) == 0) swarm.hosts.poses[robot].x_mm = below(2) == 0 ? 1e6 : -1e9;
      if (below(10) == 0)
        swarm.hosts.poses[robot] = {static_cast<double>(below(400)), static_cast<double>(below(400)), 0};
    }
    if (below(30) == 0) {
      IrMessage message;
      for (auto& octet : message) octet = static_cast<std::uint8_t>(below(256));
      offered.insert(message);
      const std::array<OverheadCommand, 3> commands{OverheadCommand::kRepeat, OverheadCommand::kStop,
                                                    OverheadCommand::kOnce};
      swarm.hosts.overhead.packets.push_back({commands[below(3)], message});
    }
    swarm.hosts.place();
    swarm.step();
    const RadioFrame& frame = swarm.frames[0];
    for (const std::uint32_t message : frame.reception_message) {
      ASSERT_LT(message, frame.messages.size());
      ASSERT_TRUE(offered.contains(frame.messages[message]));
    }
    for (const auto gain : frame.reception_high_gain) ASSERT_TRUE(gain >= 0 && gain <= 1023);
    for (const auto gain : frame.reception_low_gain) ASSERT_TRUE(gain >= 0 && gain <= 1023);
    for (const std::uint8_t ticks : frame.kilo_ticks) ASSERT_LE(ticks, 20);
    receptions += frame.reception_robot.size();
    const auto& c = swarm.radio.counters();
    ASSERT_LE(c.sent + c.aborted, c.attempted);
    ASSERT_LE(c.attempted, c.sent + c.aborted + kFuzzedRobots);
    if (k % 100 != 50) continue;
    // A restored engine continues like the saved one.
    proto::RadioState saved;
    swarm.radio.save(saved);
    RadioEngine loaded(plan);
    const proto::RadioState* const parts[] = {&saved};
    loaded.load(swarm.now, parts);
    ASSERT_EQ(loaded.hash_part(), swarm.radio.hash_part());
  }
  EXPECT_GT(receptions, 1000u);
}

constexpr const char* kDisc = "radio { }";
constexpr const char* kSimple = "radio { model: SIMPLE simple { drop_probability: 0.1 } }";
constexpr const char* kStrength =
    "radio { model: PROPAGATION propagation { notice_db: 1 body_loss_db: 0.4 run_sd_db: 0.5 pair_sd_db: 0.5 "
    "capture_db: 6 "
    "reading_sd_db: 1 calibration_sd_db: 1 power_pattern_db: 1 power_pattern_db: -1 } }";
INSTANTIATE_TEST_SUITE_P(Radio, RadioFuzz,
                         ::testing::Values(Case{kDisc, 1}, Case{kDisc, 2}, Case{kSimple, 3}, Case{kSimple, 4},
                                           Case{kStrength, 5}, Case{kStrength, 6}, Case{kStrength, 7}));

}  // namespace
}  // namespace kilotwin::comm
