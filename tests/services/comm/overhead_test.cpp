// The overhead controller on the air: when its copies come, and what they do to robots' packets.
#include <gtest/gtest.h>

#include <string>

#include "idl/checkpoint.pb.h"
#include "services/comm/packet_bits.hpp"
#include "tests/services/comm/fake_hosts.hpp"

namespace kilotwin::comm {
namespace {

using testing::make_plan;
using testing::Swarm;

constexpr Cycles kTickCycles = 262144;
constexpr Cycles kPeriod = 83272;
const IrMessage kWord{1, 2, 3, 4, 5, 6, 7, 8, 9, 0x88};

/// Copies that have arrived before the end of tick `ticks` - 1 if the first one starts at tick `first`.
std::int64_t copies_until(std::int64_t first, std::int64_t ticks) {
  const Cycles last_start = (ticks - first) * kTickCycles - 1 - kPacket;
  return last_start < 0 ? 0 : last_start / kPeriod + 1;
}

TEST(Overhead, RepeatsEvery10_409Milliseconds) {
  EXPECT_NEAR(kPeriod / kNominalClockHz, 0.010409, 1e-9);
  // Two robots at the ends of a large arena: everybody hears it.
  const RunPlan plan = make_plan("arena { width_mm: 100000 }", {{-40000, 0, 0}, {40000, 300, 0}});
  Swarm swarm(plan);
  swarm.hosts.sends.assign(2, 0);
  for (int k = 0; k < 5; ++k) swarm.step();
  swarm.hosts.overhead.packets = {{OverheadCommand::kRepeat, kWord}};
  std::vector<std::int64_t> heard(2, 0);
  for (int k = 5; k < 500; ++k) {
    swarm.step();
    const RadioFrame& frame = swarm.frames[0];
    for (std::size_t n = 0; n < frame.reception_robot.size(); ++n) {
      ++heard[frame.reception_robot[n]];
      EXPECT_EQ(frame.messages[frame.reception_message[n]], kWord);
      EXPECT_EQ(frame.reception_high_gain[n], 148);
      EXPECT_EQ(frame.reception_low_gain[n], 110);
    }
    EXPECT_EQ(heard[0], copies_until(5, swarm.now.count()));
    EXPECT_EQ(heard[1], heard[0]);
  }
  EXPECT_GT(heard[0], 1500);
  EXPECT_EQ(swarm.radio.counters().received, 0u);  // robots' messages only
}

/// Copies heard by a silent robot in each of the ticks after the packets of one frame.
std::vector<std::size_t> heard_after(const std::vector<OverheadPacket>& packets, int ticks,
                                     std::vector<IrMessage>* messages) {
  const RunPlan plan = make_plan("", {{0, 0, 0}});
  Swarm swarm(plan);
  swarm.hosts.sends[0] = 0;
  swarm.hosts.overhead.packets = packets;
  std::vector<std::size_t> heard;
  for (int k = 0; k < ticks; ++k) {
    swarm.step();
    heard.push_back(swarm.frames[0].reception_robot.size());
    for (const std::uint32_t index : swarm.frames[0].reception_message)
      messages->push_back(swarm.frames[0].messages[index]);
  }
  return heard;
}

TEST(Overhead, OnceIsOnceAndStopIsSilence) {
  std::vector<IrMessage> messages;
  EXPECT_EQ(heard_after({{OverheadCommand::kOnce, kWord}}, 3, &messages), (std::vector<std::size_t>{1, 0, 0}));
  EXPECT_EQ(heard_after({{OverheadCommand::kStop, kWord}}, 3, &messages), (std::vector<std::size_t>{0, 0, 0}));
  const RunPlan plan = make_plan("", {{0, 0, 0}});
  Swarm swarm(plan);
  swarm.hosts.sends[0] = 0;
  swarm.hosts.overhead.packets = {{OverheadCommand::kRepeat, kWord}};
  for (int k = 0; k < 10; ++k) swarm.step();
  swarm.hosts.overhead.packets = {{OverheadCommand::kStop, {}}};
  swarm.step();  // a copy that was on the air ends in this tick
  EXPECT_LE(swarm.frames[0].reception_robot.size(), 1u);
  for (int k = 0; k < 10; ++k) {
    swarm.step();
    EXPECT_TRUE(swarm.frames[0].reception_robot.empty());
  }
}

TEST(Overhead, PacketsOfOneTickGoOutInOrder) {
  std::vector<IrMessage> messages;
  heard_after({{OverheadCommand::kRepeat, {1}},
               {OverheadCommand::kOnce, {2}},
               {OverheadCommand::kOnce, {3}},
               {OverheadCommand::kRepeat, {4}}},
              3, &messages);
  ASSERT_GE(messages.size(), 7u);
  const std::uint8_t expected[] = {1, 2, 3, 4, 4, 4, 4};
  for (std::size_t i = 0; i < 7; ++i) EXPECT_EQ(messages[i][0], expected[i]);
}

/// A packet acts at its cycle of the tick.
TEST(Overhead, PacketsActAtTheirOffsets) {
  const auto packet = [](OverheadCommand command, std::uint8_t octet, Cycles offset) {
    return OverheadPacket{command, {octet}}.at(static_cast<std::uint32_t>(offset));
  };
  std::vector<IrMessage> messages;
  const std::vector<OverheadPacket> at_offsets{packet(OverheadCommand::kRepeat, 1, 10'000),
                                               packet(OverheadCommand::kRepeat, 2, 10'000 + kPeriod + 1),
                                               packet(OverheadCommand::kOnce, 3, kTickCycles - kPacket)};
  // 1 starts at its offset, and again a period later, just before packet 2 comes; 2 and 3 follow, each after a period. The
  // last one starts 2328 cycles before the tick's end and ends in the next.
  EXPECT_EQ(heard_after(at_offsets, 3, &messages), (std::vector<std::size_t>{3, 1, 0}));
  ASSERT_EQ(messages.size(), 4u);
  EXPECT_EQ((std::array{messages[0][0], messages[1][0], messages[2][0], messages[3][0]}),
            (std::array<std::uint8_t, 4>{1, 1, 2, 3}));

  messages.clear();
  EXPECT_EQ(heard_after({packet(OverheadCommand::kRepeat, 1, 0), packet(OverheadCommand::kStop, 0, kPeriod - 1)}, 2,
                        &messages),
            (std::vector<std::size_t>{1, 0}));
  messages.clear();
  EXPECT_EQ(heard_after({packet(OverheadCommand::kRepeat, 1, 0), packet(OverheadCommand::kStop, 0, kPeriod + 1)}, 2,
                        &messages),
            (std::vector<std::size_t>{2, 0}));
  // A copy that starts in the last cycle of a tick arrives in the next one.
  messages.clear();
  EXPECT_EQ(heard_after({packet(OverheadCommand::kOnce, 7, kTickCycles - 1)}, 2, &messages),
            (std::vector<std::size_t>{0, 1}));
}

OverheadPacket page_packet(std::uint8_t page) {
  OverheadPacket packet;
  packet.command = OverheadCommand::kBootPage;
  std::array<std::uint8_t, 129> payload{page};
  for (std::size_t i = 0; i < 128; ++i) payload[1 + i] = static_cast<std::uint8_t>(i * 7 + page);
  packet.set_payload(payload);
  return packet;
}

TEST(Overhead, TheLedTogglesInSilence) {
  std::vector<IrMessage> messages;
  heard_after({{OverheadCommand::kRepeat, {1}}, {OverheadCommand::kLedToggle, {2}}}, 5, &messages);
  ASSERT_EQ(messages.size(), 1u) << "it ends the repetition";
  EXPECT_EQ(messages[0][0], 1);
}

TEST(Overhead, APageIsTwentyTwoMessagesBackToBack) {
  std::vector<IrMessage> messages;
  const std::vector<std::size_t> heard =
      heard_after({page_packet(17), {OverheadCommand::kOnce, kWord}}, 6, &messages);
  ASSERT_EQ(messages.size(), 23u);
  std::array<std::uint8_t, 128> page{};
  for (std::size_t n = 0; n < 22; ++n) {
    EXPECT_EQ(messages[n][0], 17);
    EXPECT_EQ(messages[n][1], 3 * n) << "offset in words";
    EXPECT_EQ(messages[n][9], 0x81);
    for (std::size_t i = 0; i < 6 && 6 * n + i < 128; ++i) page[6 * n + i] = messages[n][2 + i];
  }
  for (std::size_t i = 0; i < 128; ++i) EXPECT_EQ(page[i], static_cast<std::uint8_t>(i * 7 + 17));
  // Message n ends (n + 1) packets and n gaps after the start; 20 ms after the 22nd, the next packet's message begins.
  std::vector<std::size_t> expected(6, 0);
  for (Cycles n = 0; n < 22; ++n)
    ++expected[static_cast<std::size_t>((n * (kPacket + 302) + kPacket) / kTickCycles)];
  ++expected[static_cast<std::size_t>((22 * (kPacket + 302) + 160'000 + kPacket) / kTickCycles)];
  EXPECT_EQ(heard, expected);
  EXPECT_NEAR(22.0 * (kPacket + 302) / kNominalClockHz, 0.097, 0.001);
}

/// Neither STOP nor another page cuts a page short; what repeats is not kept.
TEST(Overhead, PagesGoOnToTheirEnd) {
  const RunPlan plan = make_plan("", {{0, 0, 0}});
  Swarm swarm(plan);
  swarm.hosts.sends[0] = 0;
  swarm.hosts.overhead.packets = {page_packet(0)};
  std::vector<int> count(4, 0);
  for (int k = 0; k < 30; ++k) {
    if (k == 1)
      swarm.hosts.overhead.packets = {page_packet(1),
                                      {OverheadCommand::kRepeat, {3, 0, 0, 0, 0, 0, 0, 0, 0, 0x81}}};
    if (k == 2) swarm.hosts.overhead.packets = {page_packet(2), {OverheadCommand::kStop, {}}};
    swarm.step();
    for (const std::uint32_t index : swarm.frames[0].reception_message) ++count[swarm.frames[0].messages[index][0]];
  }
  EXPECT_EQ(count, (std::vector<int>{22, 22, 22, 0}));
}

TEST(Overhead, ARawMessageWithAWrongCrcReachesNobodyAndJams) {
  const auto raw = [](std::uint16_t error) {
    OverheadPacket packet{OverheadCommand::kRaw, kWord};
    const auto crc = static_cast<std::uint16_t>(message_crc(kWord) ^ error);
    packet.rest[0] = static_cast<std::uint8_t>(crc & 255);
    packet.rest[1] = static_cast<std::uint8_t>(crc >> 8);
    return packet;
  };
  std::vector<IrMessage> messages;
  heard_after({raw(0)}, 10, &messages);
  EXPECT_EQ(messages.size(), static_cast<std::size_t>(copies_until(0, 10))) << "it repeats";
  for (const IrMessage& message : messages) EXPECT_EQ(message, kWord);
  messages.clear();
  heard_after({raw(0x0100)}, 10, &messages);
  EXPECT_TRUE(messages.empty());
  // Two robots that talk all the time lose as much to it as to a sound one.
  const auto received = [&](std::uint16_t error) {
    const RunPlan plan = make_plan("radio { range_mm: 100 }", {{0, 0, 0}, {50, 0, 0}});
    Swarm swarm(plan);
    swarm.hosts.overhead.packets = {raw(error)};
    for (int k = 0; k < 2000; ++k) swarm.step();
    return swarm.radio.counters().received;
  };
  EXPECT_EQ(received(0), received(0x8000));
}

TEST(Overhead, AGpsFrameIsItsRecordsUpToTheZeros) {
  OverheadPacket packet;
  packet.command = OverheadCommand::kGpsFrame;
  for (const std::size_t records : std::array<std::size_t, 4>{0, 1, 5, 16}) {
    std::vector<std::uint8_t> payload(129, 0);
    for (std::size_t i = 0; i < 8 * records; ++i) payload[i] = static_cast<std::uint8_t>(i + 1);
    if (records < 15) payload[8 * records + 8] = 9;  // beyond the zeros
    packet.set_payload(payload);
    std::vector<IrMessage> messages;
    heard_after({packet}, 8, &messages);
    ASSERT_EQ(messages.size(), records);
    for (std::size_t n = 0; n < records; ++n) {
      EXPECT_EQ(messages[n][0], 8 * n + 1);
      EXPECT_EQ(messages[n][7], 8 * n + 8);
      EXPECT_EQ(messages[n][8], 0);
      EXPECT_EQ(messages[n][9], 1) << "type GPS";
    }
  }
}

TEST(Overhead, AStateWithAPageInItGoesOnFromACheckpoint) {
  const RunPlan plan = make_plan("", {{0, 0, 0}});
  const auto run = [&](Swarm& swarm, int ticks) {
    std::vector<std::uint64_t> hashes;
    for (int k = 0; k < ticks; ++k) {
      swarm.step();
      hashes.push_back(swarm.radio.hash_part());
    }
    return hashes;
  };
  Swarm first(plan), second(plan);
  OverheadPacket raw{OverheadCommand::kRaw, kWord};
  raw.rest[0] = 1;
  first.hosts.overhead.packets = {page_packet(3), raw};
  run(first, 2);
  proto::RadioState state;
  first.radio.save(state);
  const proto::RadioState* const parts[] = {&state};
  second.radio.load(first.now, parts);
  second.now = first.now;
  second.emit();
  EXPECT_EQ(run(first, 20), run(second, 20));
}

/// Lone robots, each with a silent listener; their first attempt is predicted from the phase of the copies, which run from
/// tick 0 on: sensed where a copy's leading byte is over, given up where a copy starts within the own leading byte, drowned
/// where a copy overlaps otherwise.
TEST(Overhead, JamsRobotsAsThePhasesSay) {
  constexpr std::uint32_t kPairs = 1000;
  std::vector<testing::ScenePose> poses;
  for (std::uint32_t i = 0; i < kPairs; ++i) {
    const double x = 500.0 * (i % 32), y = 500.0 * (i / 32);
    poses.push_back({x, y, 0});
    poses.push_back({x + 50, y, 0});
  }
  const RunPlan plan = make_plan("radio { range_mm: 100 }", poses);
  const TickTimers timers(plan);
  Swarm swarm(plan);
  for (std::uint32_t i = 0; i < kPairs; ++i) swarm.hosts.sends[2 * i + 1] = 0;
  swarm.hosts.overhead.packets = {{OverheadCommand::kRepeat, kWord}};
  enum Fate { kSensed, kDrowned, kClean, kGivenUp };
  std::vector<Fate> fate;
  std::vector<std::int64_t> due;
  int number[4] = {};
  for (std::uint32_t i = 0; i < kPairs; ++i) {
    const Cycles start = timers.next(2 * i) + 15 * timers.period(2 * i), into = start % kPeriod,
                 until_next = kPeriod - into;
    if (into >= 16 && into < 34970)
      fate.push_back(kSensed);
    else if (into < 16)
      fate.push_back(kDrowned);
    else if (until_next >= 34970)
      fate.push_back(kClean);
    else if (until_next >= 538 && until_next < 2418)
      fate.push_back(kGivenUp);
    else
      fate.push_back(kDrowned);
    due.push_back((start + kPacket) / kTickCycles + 1);
    ++number[fate.back()];
  }
  for (const int n : number) EXPECT_GT(n, 10);
  std::vector<std::int64_t> sent(kPairs, 0), heard(kPairs, 0);
  while (swarm.now.count() < 19) {
    swarm.step();
    const RadioFrame& frame = swarm.frames[0];
    for (const std::uint32_t robot : frame.sent)
      if (sent[robot / 2] == 0) sent[robot / 2] = swarm.now.count();
    for (std::size_t n = 0; n < frame.reception_robot.size(); ++n) {
      const std::uint32_t pair = frame.reception_robot[n] / 2;
      if (frame.messages[frame.reception_message[n]][9] != 0x88 && heard[pair] == 0)
        heard[pair] = swarm.now.count();
    }
  }
  for (std::uint32_t i = 0; i < kPairs; ++i) {
    switch (fate[i]) {
      case kClean:
        EXPECT_EQ(sent[i], due[i]);
        EXPECT_EQ(heard[i], due[i]);
        break;
      case kDrowned:
        EXPECT_EQ(sent[i], due[i]);
        EXPECT_TRUE(heard[i] == 0 || heard[i] > due[i] + 10);
        break;
      case kSensed: EXPECT_TRUE(sent[i] == 0 || sent[i] > due[i]); break;
      case kGivenUp: break;
    }
  }
  EXPECT_GE(swarm.radio.counters().aborted, static_cast<std::uint64_t>(number[kGivenUp]));
}

/// A copy that starts with a tick is heard by a robot that began to send in the tick before.
TEST(Overhead, InterruptsAcrossTheBorderOfTicks) {
  int cases[2] = {};
  for (std::uint64_t seed = 1; seed <= 2000; ++seed) {
    const RunPlan plan = make_plan("radio { oscillator_sd: 0 } seed: " + std::to_string(seed), {{0, 0, 0}});
    const TickTimers timers(plan);
    const Cycles start = timers.next(0) + 15 * timers.period(0), border = (start / kTickCycles + 1) * kTickCycles;
    if (border - start >= kListening) continue;
    Swarm swarm(plan);
    while (swarm.now.count() < border / kTickCycles) swarm.step();
    swarm.hosts.overhead.packets = {{OverheadCommand::kOnce, kWord}};
    swarm.step();
    const bool noticed = border - start >= kDeaf;
    EXPECT_EQ(swarm.radio.counters().aborted, noticed ? 1u : 0u);
    ++cases[noticed];
  }
  EXPECT_GT(cases[0], 0);
  EXPECT_GT(cases[1], 0);
}

/// Copies that overlap a robot's packet are lost within its range and at itself, and nowhere else.
TEST(Overhead, IsDrownedOutNearASender) {
  const RunPlan plan = make_plan("radio { range_mm: 100 }", {{0, 0, 0}, {50, 0, 0}, {500, 0, 0}});
  Swarm swarm(plan);
  swarm.hosts.sends = {1, 0, 0};
  swarm.hosts.overhead.packets = {{OverheadCommand::kRepeat, kWord}};
  std::vector<std::int64_t> heard(3, 0);
  while (swarm.now.count() < 1000) {
    swarm.step();
    const RadioFrame& frame = swarm.frames[0];
    for (std::size_t n = 0; n < frame.reception_robot.size(); ++n) {
      heard[frame.reception_robot[n]] += frame.messages[frame.reception_message[n]] == kWord;
    }
  }
  EXPECT_EQ(heard[2], copies_until(0, 1000));
  EXPECT_EQ(heard[0], heard[1]);
  EXPECT_LT(heard[0], heard[2]);
  EXPECT_GE(heard[0], heard[2] - 2 * static_cast<std::int64_t>(swarm.radio.counters().attempted));
}

}  // namespace
}  // namespace kilotwin::comm
