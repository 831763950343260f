#include "clients/ark-bridge/bridge.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "core/base/pose.hpp"
#include "services/ark/ark_message.hpp"
#include "tests/clients/doors/doors.hpp"

namespace kilotwin::doors::test {
namespace {

using Message = std::array<std::uint8_t, 10>;

Message packed(std::initializer_list<ark::ArkMessage> messages) {
  const IrMessage made = ark::pack(std::vector(messages));
  Message message{};
  std::copy_n(made.begin(), message.size(), message.begin());
  return message;
}

std::vector<TrackedRobot> tracked(const std::vector<ArkRobot>& robots, const Door& d, Tally& tally) {
  return tracked_of(robots, d, tally);
}

TEST(ArkBridge, SplitsAPacketIntoTheMessagesOfRealRobots) {
  const Door d = door("name: 'ark' ark {} robots { first_number: 5 }", 6, 2);
  Tally tally;
  const auto orders = orders_of(kRepeatCommand, packed({{1, 2, 3}, {2, 15, 1023}, {5, 0, 512}}), d.names, tally);
  ASSERT_EQ(orders.size(), 2u) << "robot 1 is simulated";
  EXPECT_EQ(std::get<ArkSignal>(orders[0]), (ArkSignal{5, 15, 1023}));
  EXPECT_EQ(std::get<ArkSignal>(orders[1]), (ArkSignal{8, 0, 512}));
}

/// The three messages of any packet come out as they went in.
TEST(ArkBridge, SplittingLosesNothing) {
  const Door d = door("name: 'ark' ark {}", 1023);
  Tally tally;
  std::mt19937_64 random(5);
  for (int i = 0; i < 2000; ++i) {
    std::vector<ark::ArkMessage> sent;
    for (std::size_t k = 0; k < ark::kArkSlots; ++k) {
      sent.push_back({static_cast<std::uint16_t>(random() % 1023), static_cast<std::uint8_t>(random() % 16),
                      static_cast<std::uint16_t>(random() % 1024)});
    }
    const IrMessage made = ark::pack(sent);
    Message message{};
    std::copy_n(made.begin(), message.size(), message.begin());
    const auto orders = orders_of(kOnceCommand, message, d.names, tally);
    ASSERT_EQ(orders.size(), sent.size());
    for (std::size_t k = 0; k < sent.size(); ++k)
      EXPECT_EQ(std::get<ArkSignal>(orders[k]), (ArkSignal{sent[k].id, sent[k].type, sent[k].payload}));
  }
}

TEST(ArkBridge, PassesBroadcastsAndStopsOn) {
  const Door d = door("name: 'ark' ark {}", 4);
  Tally tally;
  const Message message{1, 2, 3, 4, 5, 6, 7, 8, 9, 120};
  const auto orders = orders_of(kRepeatCommand, message, d.names, tally);
  ASSERT_EQ(orders.size(), 1u);
  EXPECT_EQ(std::get<ArkBroadcast>(orders[0]), (ArkBroadcast{120, {1, 2, 3, 4, 5, 6, 7, 8, 9}}));
  const auto stop = orders_of(kStopCommand, message, d.names, tally);
  ASSERT_EQ(stop.size(), 1u);
  EXPECT_TRUE(std::holds_alternative<ArkStop>(stop[0]));
}

TEST(ArkBridge, CountsWhatArkCannotSend) {
  const Door d = door("name: 'ark' ark {}", 4);
  Tally tally;
  Message message{};
  for (const int type : {0x80, 0x82, 0x88, 0xff}) {
    message[9] = static_cast<std::uint8_t>(type);
    EXPECT_TRUE(orders_of(kRepeatCommand, message, d.names, tally).empty());
  }
  message[9] = 1;
  for (const int command : {1, 3, 4, 5, 7, 255})
    EXPECT_TRUE(orders_of(static_cast<std::uint8_t>(command), message, d.names, tally).empty()) << command;
  EXPECT_EQ(tally.left_out_for("packets that an experiment of ARK cannot send"), 10u);
}

TEST(ArkBridge, PixelsBecomeMillimetresAndVelocitiesHeadings) {
  const Door d = door("name: 'ark' ark {}", 8);
  Tally tally;
  const auto robots =
      tracked({{7, 1000, 1000, 0, -1, 1}, {3, 0, 2000, 1, 0, 3}, {5, 1500, 500, 0.5, 0.5, 9}}, d, tally);
  ASSERT_EQ(robots.size(), 3u);
  EXPECT_EQ(robots[0].robot, 3u);
  EXPECT_DOUBLE_EQ(robots[0].x_mm, -1000);
  EXPECT_DOUBLE_EQ(robots[0].y_mm, -1000);
  EXPECT_NEAR(robots[0].heading_rad, 0, 1e-12);
  EXPECT_EQ(robots[0].led, 3 << 4);
  EXPECT_EQ(robots[1].robot, 5u);
  EXPECT_NEAR(robots[1].heading_rad, -kPi / 4, 1e-12) << "down in the picture";
  EXPECT_EQ(robots[1].led, kLedUnknown);
  EXPECT_EQ(robots[2].robot, 7u);
  EXPECT_DOUBLE_EQ(robots[2].x_mm, 0);
  EXPECT_DOUBLE_EQ(robots[2].y_mm, 0);
  EXPECT_NEAR(robots[2].heading_rad, kPi / 2, 1e-12);
}

TEST(ArkBridge, VelocitiesPerFrameBecomeMillimetresPerSecond) {
  Tally tally;
  const std::vector<ArkRobot> robots{{0, 1, 1, 0.5, -0.25, 0}, {1, 9, 9, 1, 1, 0}, {2, 5, 5, 0, 0, 0}};
  const Door d = door("name: 'ark' ark { frame_rate_hz: 20 } placement { turn_deg: 90 unit_mm: 2 }", 8);
  const auto placed = tracked(robots, d, tally);
  ASSERT_EQ(placed.size(), 3u);
  // 20, 10 mm/s in the picture with y up, turned by 90 degrees.
  EXPECT_NEAR(placed[0].vx_mm_s, -10, 1e-5);
  EXPECT_NEAR(placed[0].vy_mm_s, 20, 1e-5);
  EXPECT_TRUE(std::isnan(placed[1].vx_mm_s) && std::isnan(placed[1].vy_mm_s)) << "ARK has not seen it moving";
  EXPECT_EQ(placed[2].vx_mm_s, 0) << "at rest is a velocity too";
  const Door without = door("name: 'ark' ark {}", 8);
  EXPECT_TRUE(std::isnan(tracked(robots, without, tally).at(0).vx_mm_s)) << "the rate is not known";
}

TEST(ArkBridge, ARobotThatDoesNotMoveHasNoHeading) {
  const Door d = door("name: 'ark' ark {}", 8);
  Tally tally;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const auto& [vx, vy] : {std::pair{0.0, 0.0}, {1.0, 1.0}, {0.1, -0.1}, {nan, 1.0}}) {
    const auto robots = tracked({{0, 1, 1, vx, vy, 0}}, d, tally);
    EXPECT_TRUE(std::isinf(robots.at(0).heading_variance_rad2)) << vx << " " << vy;
  }
}

TEST(ArkBridge, CountsRobotsThatItCannotPlace) {
  const Door d = door("name: 'ark' ark {}", 4, 2);
  Tally tally;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto robots =
      tracked({{0, 1, 1, 0, 0, 0}, {9, 1, 1, 0, 0, 0}, {1, nan, 1, 0, 0, 0}, {0, 2, 2, 0, 0, 0}}, d, tally);
  ASSERT_EQ(robots.size(), 1u);
  EXPECT_EQ(robots[0].robot, 2u);
  EXPECT_DOUBLE_EQ(robots[0].x_mm, -999) << "the first of two counts";
  EXPECT_EQ(tally.left_out_for("poses that belong to no tracked robot"), 1u);
  EXPECT_EQ(tally.left_out_for("poses that are not finite"), 1u);
  EXPECT_EQ(tally.left_out_for("poses of a robot that the frame has already"), 1u);
}

}  // namespace
}  // namespace kilotwin::doors::test
