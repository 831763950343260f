// When real robots get STOP: within two seconds of a station's death, on the clock of the rule and of the line.
#include "clients/ohc/stop_rule.hpp"

#include <gtest/gtest.h>

#include "clients/ohc/line_clock.hpp"

namespace kilotwin::ohc {
namespace {

using std::chrono::milliseconds;
using Time = StopRule::Time;
using News = StopRule::News;
constexpr Time kStart{std::chrono::hours(1)};

/// The loop of the real controller: a look every kLook, and packets of the line between two looks.
TEST(StopRule, StopIsOnTheLineWithinTwoSecondsOfTheLastStatus) {
  constexpr milliseconds kStatusEvery{200};
  const milliseconds packet{1000 * kSerialPacket / kOctetsPerSecond + 1};
  const milliseconds page = packet + milliseconds(static_cast<int>(1000 * kPage_s));
  for (milliseconds died{3000}; died < milliseconds(3500); died += milliseconds(7)) {
    StopRule rule;
    const auto heard_at = [&](Time now) {
      const auto status = std::min(now - kStart, Time::duration(died)) / kStatusEvery;
      return kStart + status * kStatusEvery;
    };
    Time now = kStart;
    for (int looks = 0;; ++looks) {
      ASSERT_LT(looks, 100);
      const StopRule::Verdict verdict = rule.look(heard_at(now), now);
      if (verdict.stop) {
        EXPECT_EQ(verdict.news, News::kSilent);
        break;
      }
      ASSERT_EQ(verdict.news, News::kNone);
      // While the station lives, a page always keeps the line busy beyond the next look.
      const bool lives = now - kStart < died;
      if (lives) rule.forwarded();
      now += StopRule::kLook + (lives ? page : milliseconds(0));
    }
    EXPECT_GT(now, kStart + died) << "nothing stops a station that lives";
    EXPECT_LT(now + packet - heard_at(now), std::chrono::seconds(2));
  }
}

TEST(StopRule, OneStopEndsARunThatDroveRobots) {
  StopRule rule;
  EXPECT_FALSE(rule.look(std::nullopt, kStart).stop) << "nobody drove";
  EXPECT_FALSE(rule.look(kStart, kStart).stop);
  EXPECT_TRUE(rule.look(std::nullopt, kStart + StopRule::kLook).stop);
  EXPECT_FALSE(rule.look(std::nullopt, kStart + 2 * StopRule::kLook).stop);
}

TEST(StopRule, APacketBetweenTwoLooksIsStoppedIfTheRunEndsBeforeTheSecond) {
  StopRule rule;
  EXPECT_FALSE(rule.look(std::nullopt, kStart).stop);
  rule.forwarded();
  EXPECT_TRUE(rule.look(std::nullopt, kStart + StopRule::kLook).stop);
}

/// A station that hangs may still get a packet out; the controller would repeat it.
TEST(StopRule, APacketThatIsForwardedDuringSilenceIsStoppedAgain) {
  StopRule rule;
  EXPECT_FALSE(rule.look(kStart, kStart).stop);
  Time now = kStart + StopRule::kLongestSilence + milliseconds(1);
  const StopRule::Verdict silent = rule.look(kStart, now);
  EXPECT_TRUE(silent.stop);
  EXPECT_EQ(silent.news, News::kSilent);
  EXPECT_FALSE(rule.look(kStart, now += StopRule::kLook).stop) << "once is enough";
  rule.forwarded();
  const StopRule::Verdict again = rule.look(kStart, now += StopRule::kLook);
  EXPECT_TRUE(again.stop);
  EXPECT_EQ(again.news, News::kNone) << "the silence has been told";
  const StopRule::Verdict back = rule.look(now, now += StopRule::kLook);
  EXPECT_FALSE(back.stop);
  EXPECT_EQ(back.news, News::kBack);
}

}  // namespace
}  // namespace kilotwin::ohc
