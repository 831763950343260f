// The queue of the serial line: in order, none for long, and no page is lost.
#include "clients/ohc/packet_queue.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace kilotwin::ohc {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using QueueTime = PacketQueue::Time;

constexpr microseconds kLine{34'375};  // a packet on the line
constexpr QueueTime kQueueStart{std::chrono::hours(1)};
const OverheadPacket kStop{};

OverheadPacket numbered(OverheadCommand command, int number) {
  return {command, {static_cast<std::uint8_t>(number & 255), static_cast<std::uint8_t>(number >> 8)}};
}

int number_of(const OverheadPacket& packet) { return packet.message[0] | packet.message[1] << 8; }

TEST(PacketQueue, PacketsGoInOrderAndNoneBeforeItsTime) {
  PacketQueue queue;
  EXPECT_EQ(queue.next_due(), std::nullopt);
  queue.put(numbered(OverheadCommand::kRepeat, 1), kQueueStart + milliseconds(10));
  queue.put(numbered(OverheadCommand::kRepeat, 2), kQueueStart + milliseconds(5));  // it came later
  EXPECT_EQ(queue.next_due(), kQueueStart + milliseconds(10));
  EXPECT_EQ(queue.take(kQueueStart + milliseconds(9)), std::nullopt);
  EXPECT_EQ(queue.take(kQueueStart + milliseconds(10)), numbered(OverheadCommand::kRepeat, 1));
  EXPECT_EQ(queue.take(kQueueStart + milliseconds(10)), numbered(OverheadCommand::kRepeat, 2));
  EXPECT_EQ(queue.take(kQueueStart + milliseconds(10)), std::nullopt);
  EXPECT_EQ(queue.dropped(), 0u);
}

/// A station without a limit sends 96 packets a second, the line takes 29.
TEST(PacketQueue, AStopWaitsAMomentHoweverMuchIsSent) {
  PacketQueue queue;
  constexpr microseconds kAir{10'409};
  QueueTime sent = kQueueStart, line = kQueueStart;
  int last = -1, taken = 0;
  for (int number = 0; number < 1000; ++number, sent += kAir) {
    queue.put(numbered(OverheadCommand::kOnce, number), sent);
    for (; line <= sent; line += kLine) {
      const auto packet = queue.take(line);
      if (!packet) continue;
      EXPECT_GT(number_of(*packet), last) << "in order";
      last = number_of(*packet);
      ++taken;
    }
  }
  EXPECT_NEAR(taken, 1000.0 * kAir / kLine, 3) << "the line is never idle";
  queue.put(kStop, sent);
  QueueTime stopped = line;
  for (; queue.take(stopped) != kStop; stopped += kLine) ASSERT_LT(stopped, sent + std::chrono::seconds(5));
  EXPECT_LE(stopped - sent, PacketQueue::kLongestWait + 2 * kLine);
  EXPECT_GT(queue.dropped(), 600u);
}

TEST(PacketQueue, NoPageIsLostInABurst) {
  PacketQueue queue;
  constexpr int kPages = 220;
  for (int page = 0; page < kPages; ++page) {
    queue.put(numbered(OverheadCommand::kBootPage, page), kQueueStart);
    if (page % 10 == 0) queue.put(numbered(OverheadCommand::kRepeat, page), kQueueStart);
  }
  std::vector<int> pages;
  QueueTime line = kQueueStart;
  for (; queue.next_due(); line += kLine) {
    const auto packet = queue.take(line);
    if (packet && packet->command == OverheadCommand::kBootPage) pages.push_back(number_of(*packet));
  }
  ASSERT_EQ(pages.size(), kPages);
  for (int page = 0; page < kPages; ++page) EXPECT_EQ(pages[static_cast<std::size_t>(page)], page);
}

TEST(PacketQueue, TheLastMessageIsKeptHoweverLongItWaits) {
  PacketQueue queue;
  queue.put(numbered(OverheadCommand::kRepeat, 1), kQueueStart);
  queue.put(numbered(OverheadCommand::kRepeat, 2), kQueueStart + std::chrono::seconds(9));
  EXPECT_EQ(queue.take(kQueueStart + std::chrono::seconds(8)), numbered(OverheadCommand::kRepeat, 1));
  EXPECT_EQ(queue.take(kQueueStart + std::chrono::seconds(20)), numbered(OverheadCommand::kRepeat, 2));
}

TEST(PacketQueue, ItIsBoundedAndCanBeCleared) {
  PacketQueue queue;
  for (int page = 0; page < 300; ++page) queue.put(numbered(OverheadCommand::kBootPage, page), kQueueStart);
  EXPECT_EQ(queue.dropped(), 300 - PacketQueue::kMost);
  EXPECT_EQ(queue.take(kQueueStart), numbered(OverheadCommand::kBootPage, 300 - int{PacketQueue::kMost}));
  queue.clear();
  EXPECT_EQ(queue.take(kQueueStart), std::nullopt);
  EXPECT_EQ(queue.dropped(), 299u);
}

}  // namespace
}  // namespace kilotwin::ohc
