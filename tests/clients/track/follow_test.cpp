// Tracks of sightings without pictures: confirmation, loss, identity.
#include "clients/track/follow.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace kilotwin::track {
namespace {

Sighting at(double x_mm, double y_mm) { return {x_mm, y_mm, Covariance::round(0.2), Led::kOff, std::nullopt}; }

const Track* track_of(const Follower& follower, std::uint32_t id) {
  for (const Track& track : follower.tracks()) {
    if (track.id == id) return &track;
  }
  return nullptr;
}

TEST(Follow, TracksKeepTheirRobotsAndTheErrorShrinks) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> noise(0, 0.3);
  Follower follower;
  double squares = 0;
  int count = 0;
  for (int frame = 0; frame < 300; ++frame) {
    const double t = frame / 30.0;
    std::vector<Sighting> sightings;
    for (int i = 0; i < 20; ++i) {
      const double x = 40.0 * i + 10 * t * std::cos(i), y = 10 * t * std::sin(i);
      sightings.push_back({x + noise(random), y + noise(random), Covariance::round(0.3), Led::kOff, std::nullopt});
    }
    follower.predict(t);
    follower.update(sightings);
    ASSERT_EQ(follower.tracks().size(), 20u);
    for (std::uint32_t i = 0; i < 20 && frame > 60; ++i) {
      const Track& track = *track_of(follower, i);
      squares += std::pow(track.position.x_mm() - (40.0 * i + 10 * t * std::cos(i)), 2);
      ++count;
    }
  }
  EXPECT_LT(std::sqrt(squares / count), 0.25);
  EXPECT_EQ(follower.doubts(), 0u);
}

TEST(Follow, ANewRobotIsConfirmedByThreeFramesAndAGhostIsNot) {
  Follower follower;
  follower.update({at(0, 0)});
  ASSERT_EQ(follower.tracks().size(), 1u);
  for (int frame = 1; frame < 10; ++frame) {
    follower.predict(frame / 30.0);
    std::vector<Sighting> sightings{at(0, 0), at(100, 0)};
    if (frame == 1) sightings.push_back(at(0, 100));  // a reflection
    follower.update(sightings);
    const Track* second = track_of(follower, 1);
    EXPECT_EQ(second != nullptr, frame >= 3) << frame;
  }
  EXPECT_EQ(follower.tracks().size(), 2u);
}

TEST(Follow, AHiddenRobotIsPredictedThenLostThenFoundAgain) {
  Follower follower;
  double t = 0;
  const auto step = [&](bool seen) {
    t += 1 / 30.0;
    follower.predict(t);
    follower.update(seen ? std::vector<Sighting>{at(10 * t, 0)} : std::vector<Sighting>{});
    return follower.tracks().at(0).state;
  };
  for (int i = 0; i < 60; ++i) EXPECT_EQ(step(true), TrackState::kSeen);
  for (int i = 0; i < 10; ++i) EXPECT_EQ(step(false), TrackState::kPredicted);
  // Predicted along its path.
  EXPECT_NEAR(follower.tracks()[0].position.x_mm(), 10 * t, 1.5);
  for (int i = 0; i < 30; ++i) step(false);
  EXPECT_EQ(step(false), TrackState::kLost);
  EXPECT_EQ(step(true), TrackState::kSeen);
  EXPECT_EQ(follower.tracks().size(), 1u);
  EXPECT_EQ(follower.tracks()[0].id, 0u);
}

TEST(Follow, TwoRobotsThatVanishTogetherAndComeBackNearAreInDoubt) {
  Follower follower;
  double t = 0;
  for (int i = 0; i < 30; ++i) {
    follower.predict(t);
    follower.update({at(0, 0), at(35, 0), at(300, 0)});
    t += 1 / 30.0;
  }
  for (int i = 0; i < 60; ++i) {
    follower.predict(t);
    follower.update({at(300, 0)});
    t += 1 / 30.0;
  }
  follower.predict(t);
  follower.update({at(17, 18), at(18, -18), at(300, 0)});
  EXPECT_EQ(track_of(follower, 0)->state, TrackState::kDoubt);
  EXPECT_EQ(track_of(follower, 1)->state, TrackState::kDoubt);
  EXPECT_EQ(track_of(follower, 2)->state, TrackState::kSeen);
  EXPECT_EQ(follower.doubts(), 2u);
  follower.clear_doubt(0);
  follower.predict(t + 1 / 30.0);
  follower.update({at(17, 18), at(18, -18), at(300, 0)});
  EXPECT_EQ(track_of(follower, 0)->state, TrackState::kSeen);
}

TEST(LedOfATrack, ChangesAtOnceToAClearClassAndElseWithTheSecondPicture) {
  Follower follower;
  int frame = 0;
  const auto see = [&](Led led, bool clear) {
    Sighting sighting = at(0, 0);
    sighting.led = led;
    sighting.led_clear = clear;
    follower.predict(frame++ / 30.0);
    follower.update({sighting});
    return follower.tracks().front().led;
  };
  EXPECT_EQ(see(Led::kRed, false), Led::kRed) << "there is nothing else yet";
  EXPECT_EQ(see(Led::kYellow, false), Led::kRed) << "a picture exposed while the light turned from red to green";
  EXPECT_EQ(see(Led::kGreen, true), Led::kGreen);
  EXPECT_EQ(see(Led::kCyan, false), Led::kGreen);
  EXPECT_EQ(see(Led::kCyan, false), Led::kCyan);
  EXPECT_EQ(see(Led::kOff, true), Led::kOff);
}

TEST(LedDirection, IsLearnedFromStraightPaths) {
  LedBearing bearing;
  EXPECT_FALSE(bearing.mount());
  std::mt19937_64 random(4);
  std::normal_distribution<double> noise(0, 0.1);
  std::uniform_real_distribution<double> any(-3, 3);
  for (int i = 0; i < 500; ++i) {
    const double heading = any(random);
    bearing.add(heading - 0.83 + noise(random), heading);
  }
  ASSERT_TRUE(bearing.mount());
  EXPECT_NEAR(bearing.mount()->from_heading_rad, -0.83, 0.03);
  // Robots that slide along walls give readings of other directions.
  LedBearing among_slides;
  for (int i = 0; i < 500; ++i) {
    const double heading = any(random);
    among_slides.add(heading - 0.83 + (i % 4 == 0 ? 1.2 : noise(random)), heading);
  }
  ASSERT_TRUE(among_slides.mount());
  EXPECT_NEAR(among_slides.mount()->from_heading_rad, -0.83, 0.03);
  // Slides of all angles up to 90 degrees, on one side: their mean would be 16 degrees off.
  LedBearing along_walls;
  std::uniform_real_distribution<double> slide(0, kPi / 2);
  for (int i = 0; i < 2000; ++i) {
    const double heading = any(random);
    along_walls.add(heading - 0.83 + (i % 3 == 0 ? slide(random) : 0.3 * noise(random)), heading);
  }
  ASSERT_TRUE(along_walls.mount());
  EXPECT_NEAR(along_walls.mount()->from_heading_rad, -0.83, 0.03);
  // The deviation of the readings.
  LedBearing coarse;
  for (int i = 0; i < 2000; ++i) {
    const double heading = any(random);
    coarse.add(heading - 0.83 + 2 * noise(random), heading);
  }
  ASSERT_TRUE(coarse.mount());
  EXPECT_NEAR(coarse.mount()->sd_rad, 0.2, 0.03);
  // Readings that do not agree teach nothing.
  LedBearing loose;
  for (int i = 0; i < 500; ++i) loose.add(any(random), any(random));
  EXPECT_FALSE(loose.mount());
}

TEST(LedDirection, ThatIsKnownGivesTheHeadingOfARobotThatNeverMoves) {
  const auto heading_of = [](std::optional<double> known_rad, int dark = 0) {
    FollowLimits limits;
    limits.led_from_heading_rad = known_rad;
    Follower follower(limits);
    Sighting sighting = at(0, 0);
    sighting.led = Led::kRed;
    sighting.led_bearing_rad = 1.0;
    for (int frame = 0; frame < 200; ++frame) {
      follower.predict(frame / 30.0);
      follower.update({sighting});
    }
    sighting.led_bearing_rad.reset();
    for (int frame = 200; frame < 200 + dark; ++frame) {
      follower.predict(frame / 30.0);
      follower.update({sighting});
    }
    return follower.tracks().front().heading();
  };
  EXPECT_FALSE(heading_of(std::nullopt));
  const std::optional<Heading> heading = heading_of(-0.8);
  ASSERT_TRUE(heading);
  EXPECT_NEAR(heading->heading_rad, 1.8, 1e-3);
  // Two hundred pictures of one robot do not tell how it differs from the others.
  EXPECT_GE(heading->variance_rad2, kRobotsDiffer_rad * kRobotsDiffer_rad);
  EXPECT_GE(heading_of(-0.8, 10)->variance_rad2, heading->variance_rad2) << "a lamp that goes out tells nothing";
}

}  // namespace
}  // namespace kilotwin::track
