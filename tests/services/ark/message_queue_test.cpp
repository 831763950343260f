#include "services/ark/message_queue.hpp"

#include <gtest/gtest.h>

#include <map>
#include <random>

#include "idl/checkpoint.pb.h"

namespace kilotwin::ark {
namespace {

using Cycles = MessageQueue::Cycles;
constexpr Cycles kSecond = 8'000'000, kPacket = kSecond / 20;

std::vector<EnvironmentSettings> environments(std::size_t count) { return std::vector<EnvironmentSettings>(count); }

std::vector<EnvironmentSettings> fields(const std::vector<BitFieldSettings>& bits) {
  std::vector<EnvironmentSettings> all(bits.size());
  for (std::size_t i = 0; i < bits.size(); ++i) all[i].bits = bits[i];
  return all;
}

std::vector<ArkMessage> messages_of(const std::optional<IrMessage>& packet) {
  std::vector<ArkMessage> messages;
  if (!packet) return messages;
  for (const ArkMessage& message : unpack(*packet)) {
    if (message.id != kArkNobody) messages.push_back(message);
  }
  return messages;
}

TEST(MessageQueue, ANewerMessageReplacesOneThatWaits) {
  MessageQueue queue(10, environments(1), kSecond);
  queue.put(0, {4, 1, 100}, 0);
  queue.put(0, {4, 2, 200}, 10);
  EXPECT_EQ(messages_of(queue.take(20)), (std::vector<ArkMessage>{{4, 2, 200}}));
  EXPECT_EQ(queue.counts().replaced, 1u);
  EXPECT_EQ(queue.take(20), std::nullopt);
}

TEST(MessageQueue, ARobotHearsAtMostOncePerInterval) {
  MessageQueue queue(1, environments(1), kSecond);
  Cycles last = -kSecond;
  int heard = 0;
  for (Cycles now = 0; now < 20 * kSecond; now += kPacket) {
    queue.put(0, {0, 0, 7}, now);
    if (!queue.take(now)) continue;
    EXPECT_GE(now - last, kSecond);
    last = now;
    ++heard;
  }
  EXPECT_EQ(heard, 20);
}

/// At 60 messages per second the limit is reached by 60 robots with an interval of a second: nobody waits longer than a
/// packet. With 90 robots and the same interval the queue saturates: 60 per second leave, and all robots get their share.
TEST(MessageQueue, TheRateIsThatOfTheAirAndSharedEvenly) {
  for (const auto& [robots, rate] : {std::pair{30u, 30.0}, std::pair{60u, 60.0}, std::pair{90u, 60.0}}) {
    MessageQueue queue(robots, environments(1), kSecond);
    std::map<std::uint16_t, int> heard;
    constexpr int kSeconds = 120;
    for (Cycles now = 0; now < kSeconds * kSecond; now += kPacket) {
      for (std::uint32_t robot = 0; robot < robots; ++robot)
        queue.put(0, {static_cast<std::uint16_t>(robot), 0, 0}, now);
      for (const ArkMessage& message : messages_of(queue.take(now))) ++heard[message.id];
    }
    EXPECT_NEAR(static_cast<double>(queue.counts().robot_messages) / kSeconds, rate, 0.6) << robots;
    EXPECT_EQ(heard.size(), robots);
    for (const auto& [robot, count] : heard)
      EXPECT_NEAR(count, kSeconds * rate / robots, 2) << robots << " " << robot;
  }
}

/// Plugins and their users wait for the answer, whatever holds it up.
TEST(MessageQueue, TheDelayCountsFromTheFirstRequest) {
  constexpr Cycles kBin = kSecond / 100;
  for (const auto& places : {environments(2), fields({{0, 4}, {4, 4}})}) {
    MessageQueue queue(1, places, kSecond);
    queue.put(0, {0, 0, 1}, 0);
    EXPECT_TRUE(queue.take(0));
    queue.put(0, {0, 0, 1}, 10 * kBin);
    queue.put(0, {0, 0, 2}, 50 * kBin);  // replaces the first, which has waited since 0.1 s
    EXPECT_FALSE(queue.take(99 * kBin));
    EXPECT_TRUE(queue.take(100 * kBin));
    std::vector<std::uint64_t> expected(queue.counts().delays.size());
    expected[0] = expected[90] = 1;
    EXPECT_EQ(queue.counts().delays, expected);
  }
}

TEST(MessageQueue, BroadcastsGoFirstAndInOrder) {
  MessageQueue queue(2, environments(1), kSecond);
  queue.put(0, {1, 3, 5}, 0);
  queue.put_broadcast({1, 2, 3, 0, 0, 0, 0, 0, 0, 120});
  queue.put_broadcast({9, 0, 0, 0, 0, 0, 0, 0, 0, 110});
  EXPECT_EQ(queue.take(0)->back(), 120);
  EXPECT_EQ(queue.take(0)->back(), 110);
  EXPECT_EQ(messages_of(queue.take(0)), (std::vector<ArkMessage>{{1, 3, 5}}));
  EXPECT_EQ(queue.counts().broadcasts, 2u);
}

TEST(MessageQueue, EnvironmentsTakeTurnsWithoutBits) {
  MessageQueue queue(1, environments(3), kSecond);
  std::vector<std::uint8_t> types;
  for (Cycles now = 0; now < 6 * kSecond; now += kSecond) {
    for (std::uint8_t e = 0; e < 3; ++e) queue.put(e, {0, e, 0}, now);
    types.push_back(messages_of(queue.take(now)).at(0).type);
  }
  EXPECT_EQ(types, (std::vector<std::uint8_t>{0, 1, 2, 0, 1, 2}));
}

/// Any layout: what each environment put is read back from its bits of one message.
TEST(MessageQueue, BitsOfSeveralEnvironmentsTravelTogether) {
  std::mt19937 random(5);
  for (int trial = 0; trial < 300; ++trial) {
    std::vector<BitFieldSettings> bits;
    for (std::uint32_t first = static_cast<std::uint32_t>(random() % 3); first < 14;) {
      const std::uint32_t count = 1 + static_cast<std::uint32_t>(random()) % (14 - first);
      bits.push_back({first, count});
      first += count + static_cast<std::uint32_t>(random() % 2);
    }
    MessageQueue queue(3, fields(bits), kSecond);
    std::vector<std::uint32_t> values;
    for (std::uint32_t e = 0; e < bits.size(); ++e) {
      values.push_back(static_cast<std::uint32_t>(random()) & ((1u << bits[e].count) - 1));
      queue.put(e, {2, static_cast<std::uint8_t>(values[e] >> 10), static_cast<std::uint16_t>(values[e] & 1023)},
                0);
    }
    const std::vector<ArkMessage> sent = messages_of(queue.take(0));
    ASSERT_EQ(sent.size(), 1u);
    const std::uint32_t word = std::uint32_t{sent[0].type} << 10 | sent[0].payload;
    for (std::size_t e = 0; e < bits.size(); ++e)
      EXPECT_EQ(word >> bits[e].first & ((1u << bits[e].count) - 1), values[e]);
  }
}

TEST(MessageQueue, AValueTooWideForItsBitsIsNotSent) {
  MessageQueue queue(1, fields({{0, 4}, {4, 4}}), kSecond);
  queue.put(0, {0, 0, 16}, 0);
  EXPECT_EQ(queue.take(0), std::nullopt);
  EXPECT_EQ(queue.counts().too_wide, 1u);
}

TEST(MessageQueue, ALoadedQueueGoesOnAsTheSavedOne) {
  MessageQueue queue(20, environments(2), kSecond), loaded(20, environments(2), kSecond);
  std::mt19937 random(9);
  for (Cycles now = 0; now < 30 * kSecond; now += kPacket) {
    for (MessageQueue* const one : {&queue, &loaded}) {
      std::mt19937 same(static_cast<unsigned>(now / kPacket));
      for (int i = 0; i < 5; ++i)
        one->put(static_cast<std::uint32_t>(same() % 2), {static_cast<std::uint16_t>(same() % 20), 1, 2}, now);
    }
    EXPECT_EQ(queue.take(now), loaded.take(now));
    ASSERT_EQ(queue.word(), loaded.word());
    if (random() % 10 != 0) continue;
    proto::MessageQueueState state;
    queue.save(state);
    loaded = MessageQueue(20, environments(2), kSecond);
    loaded.load(state);
    ASSERT_EQ(queue.word(), loaded.word());
  }
}

}  // namespace
}  // namespace kilotwin::ark
