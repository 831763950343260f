// Results do not depend on the division over partitions and hosts, or on saving and loading. Message counts are consistent for
// any programs.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <iterator>
#include <memory>
#include <random>
#include <string>

#include "core/base/error.hpp"
#include "core/base/state_hash.hpp"
#include "idl/checkpoint.pb.h"
#include "tests/services/comm/fake_hosts.hpp"

namespace kilotwin::comm {
namespace {

using testing::make_plan;
using testing::Swarm;

/// All hosts' frames of a tick as one host would get them.
RadioFrame merged(const std::vector<RadioFrame>& frames) {
  RadioFrame all;
  all.tick = frames[0].tick;
  const auto append = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
  for (const RadioFrame& frame : frames) {
    EXPECT_EQ(frame.first_robot, all.kilo_ticks.size());
    append(all.kilo_ticks, frame.kilo_ticks);
    append(all.ask, frame.ask);
    append(all.sent, frame.sent);
    append(all.reception_robot, frame.reception_robot);
    append(all.reception_high_gain, frame.reception_high_gain);
    append(all.reception_low_gain, frame.reception_low_gain);
    // One message per reception, so that the numbering of messages does not matter.
    for (const std::uint32_t index : frame.reception_message) {
      all.messages.push_back(frame.messages.at(index));
      all.message_crc_error.push_back(frame.message_crc_error.empty() ? 0 : frame.message_crc_error.at(index));
    }
  }
  return all;
}

void expect_equal(const RadioFrame& a, const RadioFrame& b) {
  ASSERT_EQ(a.tick, b.tick);
  ASSERT_EQ(a.kilo_ticks, b.kilo_ticks);
  ASSERT_EQ(a.ask, b.ask);
  ASSERT_EQ(a.sent, b.sent);
  ASSERT_EQ(a.reception_robot, b.reception_robot);
  ASSERT_EQ(a.reception_high_gain, b.reception_high_gain);
  ASSERT_EQ(a.reception_low_gain, b.reception_low_gain);
  ASSERT_EQ(a.messages, b.messages);
  ASSERT_EQ(a.message_crc_error, b.message_crc_error);
}

constexpr std::uint32_t kDividedRobots = 150;

RunPlan crowd_plan(const std::string& experiment, std::uint32_t columns = 1, std::uint32_t rows = 1,
                   std::uint32_t hosts = 1) {
  return make_plan(experiment + " arena { width_mm: 900 height_mm: 900 } recording { messages: true }",
                   testing::random_crowd(kDividedRobots, 800, 800, 33, 7), columns, rows, hosts);
}

/// Robots cross borders, change their motors, sleep and wake; the overhead controller sends packets now and then. A pure
/// function of the tick.
void stir(testing::FakeHosts& hosts, Tick now) {
  std::mt19937_64 random(static_cast<std::uint64_t>(now.count()) * 7919 + 1);
  const auto draw = [&](std::uint64_t n) { return random() % n; };
  for (std::uint32_t i = 0; i < kDividedRobots; ++i) {
    hosts.poses[i].x_mm += static_cast<double>(draw(9)) - 4;
    hosts.poses[i].y_mm += static_cast<double>(draw(9)) - 4;
    if (draw(50) == 0) hosts.sends[i] ^= 1;
    if (draw(100) == 0) {
      constexpr std::uint8_t kLives[] = {0, 1, 2, 3, 4, 4, 4, 4, 4, 4, 5, 6, 255};
      hosts.life_cycle[i] = kLives[draw(std::size(kLives))];
    }
    if (draw(100) == 0) hosts.tx_period[i] = static_cast<std::uint16_t>(draw(3) == 0 ? draw(65536) : draw(2000));
  }
  hosts.place();
  if (draw(20) == 0) {
    for (std::uint64_t n = draw(4); n-- > 0;) {
      constexpr OverheadCommand kCommands[] = {OverheadCommand::kStop, OverheadCommand::kRepeat,
                                               OverheadCommand::kOnce};
      hosts.overhead.packets.push_back(
          {kCommands[draw(3)], {static_cast<std::uint8_t>(draw(256)), 1, 2, 3, 4, 5, 6, 7, 8, 0x7f}});
    }
  }
}

TEST(Determinism, ResultsDoNotDependOnPartitionsAndHosts) {
  const std::string experiment = "radio { range_mm: 120 loss: 0.1 oscillator_sd: 0.02 } ";
  const RunPlan one = crowd_plan(experiment);
  Swarm whole(one);
  const RunPlan plans[] = {crowd_plan(experiment, 3, 2, 4), crowd_plan(experiment, 1, 5, 64),
                           crowd_plan(experiment, 4, 4, 3)};
  std::vector<std::unique_ptr<Swarm>> divided;
  for (const RunPlan& plan : plans) divided.push_back(std::make_unique<Swarm>(plan));
  for (int k = 0; k < 1500; ++k) {
    stir(whole.hosts, whole.now);
    whole.step();
    for (const auto& swarm : divided) {
      stir(swarm->hosts, swarm->now);
      swarm->step();
      ASSERT_EQ(swarm->radio.hash_part(), whole.radio.hash_part()) << k;
      expect_equal(merged(swarm->frames), merged(whole.frames));
      if (HasFatalFailure()) return;
    }
  }
  EXPECT_GT(whole.radio.counters().received, 10000u);
  EXPECT_GT(whole.radio.counters().collided, 1000u);
  EXPECT_GT(whole.radio.counters().aborted, 50u);
}

/// The chain of hashes is the same for every compiler, optimisation level and machine. It changes only with the model of the
/// channel.
TEST(Determinism, MatchesTheGoldenHash) {
  const RunPlan plan = crowd_plan("radio { range_mm: 120 loss: 0.1 oscillator_sd: 0.02 } ");
  Swarm swarm(plan);
  std::uint64_t chain = 0;
  for (int k = 0; k < 500; ++k) {
    stir(swarm.hosts, swarm.now);
    swarm.step();
    chain = hash_chain(chain, swarm.radio.hash_part());
    for (const std::int16_t gain : swarm.frames[0].reception_high_gain)
      chain = hash_chain(chain, static_cast<std::uint64_t>(gain));
  }
  EXPECT_EQ(chain, 0x7ec06c30bb2bfe06u);
}

TEST(Determinism, LoadedEngineContinuesLikeTheSavedOne) {
  for (const char* cycles : {"262144", "32768", "100003", "1048576"}) {
    const RunPlan plan = crowd_plan("tick_cycles: " + std::string(cycles) + " radio { range_mm: 120 loss: 0.05 } ");
    Swarm swarm(plan);
    swarm.hosts.crc_error = [](std::uint32_t robot, Tick tick) {
      return static_cast<std::uint16_t>((robot + tick.count()) % 5 == 0 ? robot : 0);
    };
    auto loaded = std::make_unique<RadioEngine>(plan);
    bool following = false;
    std::mt19937_64 random(5);
    RadioFrame frame;
    std::size_t straddled = 0;
    for (int k = 0; k < 1000; ++k) {
      stir(swarm.hosts, swarm.now);
      if (following) loaded->step(swarm.now, swarm.hosts.inputs(swarm.now));
      swarm.step();
      if (random() % 7 == 0) {
        proto::RadioState part;
        swarm.radio.save(part);
        for (const std::int64_t end : part.transmission_end())
          straddled += end >= swarm.now.count() * plan.tick_length.cycles();
        const std::string octets = part.SerializeAsString();
        proto::RadioState read;
        ASSERT_TRUE(read.ParseFromString(octets));
        const proto::RadioState* const parts[] = {&read};
        loaded = std::make_unique<RadioEngine>(plan);
        loaded->load(swarm.now, parts);
        following = true;
      }
      if (!following) continue;
      loaded->emit(HostId{0}, frame);
      expect_equal(merged({frame}), merged(swarm.frames));
      if (HasFatalFailure()) return;
      ASSERT_EQ(loaded->hash_part(), swarm.radio.hash_part()) << k;
      ASSERT_EQ(loaded->counters().received, swarm.radio.counters().received);
      ASSERT_EQ(loaded->counters().collided, swarm.radio.counters().collided);
      ASSERT_EQ(loaded->counters().aborted, swarm.radio.counters().aborted);
      ASSERT_EQ(loaded->pair_counts().size(), swarm.radio.pair_counts().size());
    }
    EXPECT_GT(straddled, 10u);
  }
}

TEST(Determinism, RejectsAnotherExperimentsState) {
  const RunPlan plan = crowd_plan("");
  const RunPlan other = make_plan("", testing::grid_crowd(3, 40, testing::Facing::kRight));
  RadioEngine engine(plan), small(other);
  proto::RadioState part;
  small.save(part);
  const proto::RadioState* const parts[] = {&part};
  EXPECT_THROW(engine.load(Tick{0}, parts), RunError);
  EXPECT_THROW(engine.load(Tick{0}, {}), RunError);
}

TEST(Determinism, HashDependsOnSeedAndInputs) {
  const RunPlan plan = crowd_plan("seed: 1"), other = crowd_plan("seed: 2");
  EXPECT_NE(RadioEngine(plan).hash_part(), RadioEngine(other).hash_part());
  Swarm a(plan), b(plan);
  b.hosts.message = [](std::uint32_t, Tick) { return IrMessage{1}; };
  bool differs = false;
  for (int k = 0; k < 40; ++k) {
    a.step();
    b.step();
    differs = differs || a.radio.hash_part() != b.radio.hash_part();
  }
  EXPECT_TRUE(differs);
}

/// Random life cycles, periods, messages and tick lengths: frames stay well-formed, and every message is accounted for.
TEST(Fuzz, CountsAreConsistent) {
  for (std::uint32_t round = 0; round < 12; ++round) {
    const std::uint32_t cycles[] = {262144, 32768, 1048576, 200001};
    const RunPlan plan =
        crowd_plan("tick_cycles: " + std::to_string(cycles[round % 4]) + " seed: " + std::to_string(round) +
                   " radio { range_mm: " + std::to_string(40 + 30 * round) + " oscillator_sd: 0.05 } ");
    Swarm swarm(plan);
    std::mt19937_64 random(round);
    std::vector<std::vector<IrMessage>> given(kDividedRobots);
    std::vector<std::size_t> reported(kDividedRobots, 0);
    swarm.hosts.message = [&](std::uint32_t robot, Tick) {
      IrMessage message;
      for (std::uint8_t& octet : message) octet = static_cast<std::uint8_t>(random());
      message[0] = static_cast<std::uint8_t>(robot);
      message[9] = static_cast<std::uint8_t>(message[9] & 0x7e);  // 0x7f is reserved for the overhead controller
      given[robot].push_back(message);
      return message;
    };
    std::uint64_t received = 0;
    for (int k = 0; k < 600; ++k) {
      stir(swarm.hosts, swarm.now);
      swarm.step();
      const RadioFrame& frame = swarm.frames[0];
      ASSERT_EQ(frame.kilo_ticks.size(), kDividedRobots);
      ASSERT_TRUE(std::is_sorted(frame.reception_robot.begin(), frame.reception_robot.end()));
      ASSERT_TRUE(std::adjacent_find(frame.ask.begin(), frame.ask.end(), std::greater_equal<>()) ==
                  frame.ask.end());
      ASSERT_TRUE(std::adjacent_find(frame.sent.begin(), frame.sent.end(), std::greater_equal<>()) ==
                  frame.sent.end());
      for (const std::uint32_t robot : frame.sent) ASSERT_LE(++reported[robot], given[robot].size());
      for (std::size_t n = 0; n < frame.reception_robot.size(); ++n) {
        const IrMessage& message = frame.messages.at(frame.reception_message[n]);
        ASSERT_GE(frame.reception_low_gain[n], 0);
        ASSERT_LE(frame.reception_high_gain[n], 1000);
        if (message[9] == 0x7f) continue;
        ++received;
        ASSERT_NE(frame.reception_robot[n], message[0]);
        const auto& from = given.at(message[0]);
        ASSERT_NE(std::find(from.begin(), from.end(), message), from.end());
      }
      const auto& c = swarm.radio.counters();
      ASSERT_EQ(c.received, received);
      ASSERT_LE(c.sent + c.aborted, c.attempted);
      ASSERT_LE(c.attempted - c.sent - c.aborted, kDividedRobots);
    }
    EXPECT_GT(swarm.radio.counters().sent, 100u);
  }
}

}  // namespace
}  // namespace kilotwin::comm
