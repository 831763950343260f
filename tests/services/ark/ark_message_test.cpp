#include "services/ark/ark_message.hpp"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace kilotwin::ark {
namespace {

TEST(ArkMessage, HasTheLayoutThatRobotsRead) {
  const ArkMessage messages[] = {{0x2a5, 0xb, 0x3c7}, {1, 2, 3}};
  const IrMessage packed = pack(messages);
  // 10 1010 0101 | 1011 | 11 1100 0111; 00 0000 0001 | 0010 | 00 0000 0011; nobody.
  EXPECT_EQ(packed, (IrMessage{0xa9, 0x6f, 0xc7, 0x00, 0x48, 0x03, 0xff, 0xc0, 0x00, 0}));
  EXPECT_EQ(pack({}), (IrMessage{0xff, 0xc0, 0x00, 0xff, 0xc0, 0x00, 0xff, 0xc0, 0x00, 0}));
}

TEST(ArkMessage, ComesBackAsItWasPacked) {
  std::mt19937 random(1);
  for (int round = 0; round < 20000; ++round) {
    std::vector<ArkMessage> messages(random() % 4);
    for (ArkMessage& m : messages) {
      m = {static_cast<std::uint16_t>(random() % 1023), static_cast<std::uint8_t>(random() % 16),
           static_cast<std::uint16_t>(random() % 1024)};
    }
    const auto back = unpack(pack(messages));
    for (std::size_t i = 0; i < 3; ++i)
      ASSERT_EQ(back[i], i < messages.size() ? messages[i] : (ArkMessage{1023, 0, 0}));
  }
}

}  // namespace
}  // namespace kilotwin::ark
