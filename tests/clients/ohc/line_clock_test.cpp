// The serial line's speed: octets are through one after the other, 3840 in a second, however they are handed over.
#include "clients/ohc/line_clock.hpp"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace kilotwin::ohc {
namespace {

constexpr double kOctet_s = 1.0 / 3840;

TEST(LineClock, APacketTakesThirtyFourMilliseconds) {
  LineClock line;
  const SerialPacket packet = encode({OverheadCommand::kRepeat, {1, 2, 3}});
  line.put(packet, 5.0);
  EXPECT_NEAR(line.done_s(), 5.0 + 132 * kOctet_s, 1e-9);
  for (std::size_t i = 0; i < packet.size(); ++i) {
    const double due_s = 5.0 + static_cast<double>(i + 1) * kOctet_s;
    EXPECT_FALSE(line.take(due_s - 1e-6));
    const auto octet = line.take(due_s + 1e-6);
    ASSERT_TRUE(octet);
    EXPECT_EQ(octet->value, packet[i]);
    EXPECT_NEAR(octet->at_s, due_s, 1e-9);
  }
  EXPECT_TRUE(line.idle());
  EXPECT_FALSE(line.take(1e9));
}

/// An idle line saves nothing up: after a pause it is no faster than before.
TEST(LineClock, NoOctetOvertakesTheLine) {
  std::mt19937 random(1);
  LineClock line;
  std::vector<std::uint8_t> sent, got;
  double now_s = 0, last_s = -1;
  for (int n = 0; n < 20000; ++n) {
    now_s += static_cast<double>(random() % 1000) * 1e-5;
    if (random() % 8 == 0) {
      std::vector<std::uint8_t> octets(random() % 200);
      for (std::uint8_t& octet : octets) octet = static_cast<std::uint8_t>(random());
      line.put(octets, now_s);
      sent.insert(sent.end(), octets.begin(), octets.end());
    }
    while (const auto octet = line.take(now_s)) {
      EXPECT_LE(octet->at_s, now_s);
      EXPECT_GE(octet->at_s, last_s + kOctet_s - 1e-9);
      last_s = octet->at_s;
      got.push_back(octet->value);
    }
  }
  while (const auto octet = line.take(1e9)) got.push_back(octet->value);
  EXPECT_EQ(got, sent);
  EXPECT_GT(got.size(), 100000u);
}

}  // namespace
}  // namespace kilotwin::ohc
