// Filters of tracked robots: laws of the estimate, then memberships, then state.
#include "services/ark/tracking/tracked_swarm.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "idl/checkpoint.pb.h"
#include "tests/support/scenes.hpp"

namespace kilotwin::ark {
namespace {

constexpr std::int64_t kTick = 262144;
constexpr double kTick_s = 0.032768;
constexpr float kUnknown = std::numeric_limits<float>::infinity();

RunPlan plan_of(const std::string& more = "", std::uint32_t robots = 1) {
  return testing::make_plan("robots { count: " + std::to_string(robots) + " body: TRACKED } " + more,
                            testing::grid_crowd(robots, 60, testing::Facing::kRight));
}

struct Truth {
  double x, y, heading;
};

/// A sample of robot 0 with noise of the stated standard deviations.
TrackerSample sample_of(const Truth& at, std::int64_t cycle, float sd_mm = 0.5f, float heading_variance = 0.01f,
                        TrackedState state = TrackedState::kSeen, std::uint8_t led = kUnknownLed) {
  TrackerSample sample;
  sample.capture_cycle = cycle;
  sample.robot = {0};
  sample.state = {static_cast<std::uint8_t>(state)};
  sample.x = {static_cast<float>(at.x)};
  sample.y = {static_cast<float>(at.y)};
  sample.heading_rad = {static_cast<float>(at.heading)};
  sample.xx = sample.yy = {sd_mm * sd_mm};
  sample.xy = {0};
  sample.heading_variance_rad2 = {heading_variance};
  sample.led = {led};
  return sample;
}

/// Follows a motion through a camera at about 30 Hz; every frame arrives `latency_s` after its capture.
struct Camera {
  TrackedSwarm& swarm;
  double latency_s = 0.08, sd_mm = 0.5, heading_sd_rad = 0.1;
  bool tells_heading = true;
  std::mt19937_64 random{5};
  std::int64_t next_capture = 0;
  Tick now{};
  TrackingFrame frame{};

  template <class Motion> void step(Motion motion) {
    std::normal_distribution<double> normal;
    std::vector<TrackerSample> samples;
    const auto latency = static_cast<std::int64_t>(latency_s * kNominalClockHz);
    for (; next_capture + latency < now.count() * kTick; next_capture += 266'667) {
      Truth seen = motion(static_cast<double>(next_capture) / kNominalClockHz);
      seen.x += sd_mm * normal(random);
      seen.y += sd_mm * normal(random);
      seen.heading += heading_sd_rad * normal(random);
      samples.push_back(sample_of(seen, next_capture, static_cast<float>(sd_mm),
                                  tells_heading ? static_cast<float>(heading_sd_rad * heading_sd_rad) : kUnknown));
    }
    swarm.take(now, samples);
    swarm.emit(now, frame);
    swarm.commit({});
    ++now;
  }
};

/// Root mean square errors of the prediction for the next tick, after two seconds.
template <class Motion> std::pair<double, double> errors_of(Camera& camera, Motion motion, int ticks = 600) {
  double square = 0, heading_square = 0;
  int n = 0;
  for (int k = 0; k < ticks; ++k) {
    camera.step(motion);
    if (k < 60) continue;
    EXPECT_EQ(camera.frame.robot.size(), 1u);
    const Truth truth = motion(static_cast<double>(camera.now.count()) * kTick_s);
    square += std::pow(camera.frame.x_mm[0] - truth.x, 2) + std::pow(camera.frame.y_mm[0] - truth.y, 2);
    heading_square += std::pow(std::remainder(camera.frame.heading_rad[0] - truth.heading, 2 * M_PI), 2);
    ++n;
  }
  return {std::sqrt(square / n), std::sqrt(heading_square / n)};
}

Truth at_rest(double) { return {10, -20, 0.3}; }
Truth straight(double t) { return {-100 + 10 * t * std::cos(0.5), 10 * t * std::sin(0.5), 0.5}; }
/// A pivot about a leg: the centre circles it.
Truth pivot(double t) {
  constexpr double kRate = 0.8, kArm_mm = 16.5;
  return {kArm_mm * std::sin(kRate * t), -kArm_mm * std::cos(kRate * t), std::remainder(kRate * t, 2 * M_PI)};
}

TEST(TrackedSwarm, PredictsOverTheLatency) {
  const RunPlan plan = plan_of();
  for (const auto motion : {at_rest, straight, pivot}) {
    TrackedSwarm swarm(plan);
    Camera camera{swarm};
    const auto [error_mm, heading_rad] = errors_of(camera, motion);
    // Without a prediction the error would be that of 113 ms at 10 or 13 mm/s.
    EXPECT_LT(error_mm, 1.0);
    EXPECT_LT(heading_rad, 0.12);
  }
}

TEST(TrackedSwarm, IsExactForExactSamples) {
  const RunPlan plan = plan_of();
  for (const double latency_s : {0.01, 0.2}) {
    TrackedSwarm swarm(plan);
    Camera camera{swarm, latency_s, 0, 0};
    EXPECT_LT(errors_of(camera, straight).first, 1e-3) << latency_s;
    TrackedSwarm turning(plan);
    Camera other{turning, latency_s, 0, 0};
    EXPECT_LT(errors_of(other, pivot).first, 0.05) << latency_s;
  }
}

TEST(TrackedSwarm, FindsTheHeadingFromMotion) {
  const RunPlan plan = plan_of();
  TrackedSwarm swarm(plan);
  Camera camera{swarm};
  camera.tells_heading = false;
  EXPECT_LT(errors_of(camera, straight).second, 0.2);
}

TEST(TrackedSwarm, TrackersLieInTheArenaAsTheirBlocksSay) {
  // The same place told by a tracker in pixels from the upper left corner, y down, and by one that is turned by 90 degrees.
  const RunPlan plan = plan_of(
      "tracker { source: \"a\" x_mm: -500 y_mm: 400 scale: 0.5 mirrored: true } "
      "tracker { source: \"b\" x_mm: 10 heading_deg: 90 scale: 1000 }");
  const Truth truth{100, 50, 0.25};
  TrackedSwarm swarm(plan);
  TrackingFrame frame;
  for (int k = 0; k < 50; ++k) {
    TrackerSample a = sample_of({(truth.x + 500) / 0.5, (400 - truth.y) / 0.5, -truth.heading}, k * kTick);
    TrackerSample b =
        sample_of({truth.y / 1000, -(truth.x - 10) / 1000, truth.heading - M_PI / 2}, k * kTick + 1000, 0.0005f);
    b.source = 1;
    swarm.take(Tick{k}, std::vector{a, b});
    swarm.emit(Tick{k}, frame);
    swarm.commit({});
  }
  EXPECT_NEAR(frame.x_mm[0], truth.x, 0.01);
  EXPECT_NEAR(frame.y_mm[0], truth.y, 0.01);
  EXPECT_NEAR(frame.heading_rad[0], truth.heading, 0.001);
}

TEST(TrackedSwarm, BridgesThenLosesThenTakesBack) {
  const RunPlan plan = plan_of("tracking { bridge_s: 0.5 }");
  TrackedSwarm swarm(plan);
  Camera camera{swarm};
  std::vector<MembershipChange> due;
  swarm.changes_due(due);
  EXPECT_TRUE(due.empty());  // never seen: it stands where the layout put it
  for (int k = 0; k < 60; ++k) camera.step(straight);
  EXPECT_EQ(camera.frame.state[0], static_cast<std::uint8_t>(TrackedState::kSeen));
  std::int64_t last_seen = camera.now.count() - 1;
  int bridged = 0;
  for (; camera.now < Tick{120}; ++camera.now) {
    swarm.take(camera.now, {});
    swarm.emit(camera.now, camera.frame);
    swarm.changes_due(due);
    swarm.commit({});
    if (camera.frame.robot.empty()) break;
    EXPECT_TRUE(due.empty());
    ++bridged;
  }
  // From the capture of the last sample, which was taken in 80 ms and up to a frame earlier.
  EXPECT_NEAR(static_cast<double>(camera.now.count() - last_seen) * kTick_s, 0.5 - 0.08, 0.05);
  EXPECT_GT(bridged, 8);
  ASSERT_EQ(due.size(), 1u);
  EXPECT_EQ(due[0].membership, Membership::kLost);
  swarm.commit(due);
  EXPECT_FALSE(swarm.is_member(0));
  const std::int64_t at = camera.now.count() * kTick;
  for (int n = 0; n < 3; ++n) {
    swarm.take(camera.now, std::vector{sample_of({0, 0, 0}, at + n * 1000)});
    swarm.changes_due(due);
    EXPECT_EQ(due.size(), n == 2 ? 1u : 0u);
    swarm.commit({});
  }
  EXPECT_EQ(due[0].membership, Membership::kJoined);
}

TEST(TrackedSwarm, ARobotOutsideTheArenaHasLeft) {
  const RunPlan plan = plan_of("arena { width_mm: 600 height_mm: 400 }");
  TrackedSwarm swarm(plan);
  std::vector<MembershipChange> due;
  for (const auto& [y_mm, left] : {std::pair{195.0, false}, std::pair{210.0, false}, std::pair{230.0, true}}) {
    TrackedSwarm fresh(plan);
    fresh.take(Tick{0}, std::vector{sample_of({0, y_mm, 0}, 0)});
    fresh.changes_due(due);
    EXPECT_EQ(!due.empty(), left) << y_mm;
    if (left) {
      EXPECT_EQ(due[0].membership, Membership::kLeft);
    }
  }
}

TEST(TrackedSwarm, OutliersAreRefusedAndAMovedRobotIsFollowed) {
  const RunPlan plan = plan_of();
  TrackedSwarm swarm(plan);
  Camera camera{swarm};
  for (int k = 0; k < 100; ++k) camera.step(at_rest);
  const auto take = [&](const TrackerSample& sample) {
    swarm.take(camera.now, std::vector{sample});
    swarm.emit(camera.now, camera.frame);
    swarm.commit({});
    ++camera.now;
  };
  const auto cycle = [&] { return camera.now.count() * kTick; };
  take(sample_of({200, 0, 0}, cycle()));
  EXPECT_NEAR(camera.frame.x_mm[0], 10, 1);
  take(sample_of(at_rest(0), cycle()));
  // A robot whose identity is in doubt is believed only near the estimate, however often it is told.
  for (int n = 0; n < 5; ++n) take(sample_of({200, 0, 0}, cycle(), 0.5f, 0.01f, TrackedState::kInDoubt));
  EXPECT_NEAR(camera.frame.x_mm[0], 10, 1);
  EXPECT_EQ(camera.frame.state[0], static_cast<std::uint8_t>(TrackedState::kInDoubt));
  EXPECT_EQ(swarm.jumps(), 0u);
  for (int n = 0; n < 3; ++n) take(sample_of({200, 0, 0}, cycle()));
  EXPECT_NEAR(camera.frame.x_mm[0], 200, 1);
  EXPECT_EQ(swarm.jumps(), 1u);
}

TEST(TrackedSwarm, ShowsTheLedThatWasSeenLast) {
  const RunPlan plan = plan_of();
  TrackedSwarm swarm(plan);
  TrackingFrame frame;
  swarm.take(Tick{0}, std::vector{sample_of({0, 0, 0}, 0, 1, 1, TrackedState::kSeen, 7)});
  swarm.emit(Tick{0}, frame);
  swarm.commit({});
  EXPECT_EQ(frame.led[0], 7);
  for (const std::uint8_t led : {std::uint8_t{7}, kUnknownLed}) {
    swarm.take(Tick{1}, std::vector{sample_of({0, 0, 0}, 1000, 1, 1, TrackedState::kSeen, led)});
    swarm.emit(Tick{1}, frame);
    swarm.commit({});
    EXPECT_EQ(frame.led[0], 7);
  }
}

/// Robots 0, 1, 2 and 3 lie on the x axis at 0, 60, 120 and 180 mm; robot 0 listens.
TEST(TrackedSwarm, WhatAListenerHeardIsSaidByTheRobotThatSentIt) {
  const RunPlan plan =
      testing::make_plan("robots { count: 3 body: TRACKED says { heard: true } } robots { count: 1 body: TRACKED }",
                         {{0, 0, 0}, {60, 0, 0}, {120, 0, 0}, {180, 0, 0}});
  TrackedSwarm swarm(plan);
  TrackerSample seen;
  for (std::uint32_t robot = 0; robot < 4; ++robot) {
    const TrackerSample one = sample_of({60.0 * robot, 0, 0}, 0);
    seen.robot.push_back(robot);
    for (const auto& [to, from] :
         {std::pair{&seen.x, &one.x}, std::pair{&seen.y, &one.y}, std::pair{&seen.heading_rad, &one.heading_rad},
          std::pair{&seen.xx, &one.xx}, std::pair{&seen.xy, &one.xy}, std::pair{&seen.yy, &one.yy},
          std::pair{&seen.heading_variance_rad2, &one.heading_variance_rad2}})
      to->push_back(from->front());
    seen.state.push_back(0);
    seen.led.push_back(0);
  }
  Tick now;
  const auto said = [&](const std::vector<HeardMessage>& heard) {
    TrackerSample sample;
    sample.heard = heard;
    std::vector<TrackerSample> samples;
    if (now == Tick{0}) samples.push_back(seen);
    samples.push_back(sample);
    swarm.take(now, samples);
    TrackingFrame frame;
    swarm.emit(now, frame);
    swarm.commit({});
    ++now;
    std::vector<std::pair<std::uint32_t, int>> result;
    for (std::size_t n = 0; n < frame.said_robot.size(); ++n)
      result.emplace_back(frame.said_robot[n], frame.said_message[n][0]);
    return result;
  };
  using Said = std::vector<std::pair<std::uint32_t, int>>;
  constexpr std::uint32_t kNobody = HeardMessage::kUnknown;
  EXPECT_EQ(said({{2, 0, -1, {7}}}), (Said{{2, 7}})) << "the message names the sender";
  EXPECT_EQ(said({{kNobody, 0, -1, {8}}}), (Said{{1, 8}})) << "else it is the nearest robot";
  EXPECT_EQ(said({{kNobody, 0, 110, {9}}}), (Said{{2, 9}})) << "or the one at that distance";
  EXPECT_EQ(said({{kNobody, 0, 300, {9}}}), (Said{{2, 9}})) << "of those whose messages are declared";
  EXPECT_EQ(said({{2, 0, -1, {1}}, {1, 0, -1, {2}}, {2, 0, -1, {3}}}), (Said{{1, 2}, {2, 3}})) << "the last counts";
  EXPECT_EQ(said({}), Said{});
}

/// The state of a tick is without its samples: whoever loads it and takes them again comes to the same, once.
TEST(TrackedSwarm, LoadedStateTakesTheTicksSamplesOnce) {
  const RunPlan plan = plan_of("", 3);
  TrackedSwarm swarm(plan);
  std::mt19937_64 random(3);
  for (int k = 0; k < 300; ++k) {
    TrackerSample sample;
    sample.capture_cycle = k * kTick - 100'000;
    for (std::uint32_t robot = 0; robot < 3; ++robot) {
      if (random() % 3 == 0) continue;
      const TrackerSample one = sample_of({60.0 * robot + static_cast<double>(random() % 5), k * 0.2, 1}, 0);
      sample.robot.push_back(robot);
      sample.state.push_back(random() % 9 == 0 ? 3 : 0);
      for (const auto& [to, from] :
           {std::pair{&sample.x, &one.x}, std::pair{&sample.y, &one.y},
            std::pair{&sample.heading_rad, &one.heading_rad}, std::pair{&sample.xx, &one.xx},
            std::pair{&sample.xy, &one.xy}, std::pair{&sample.yy, &one.yy},
            std::pair{&sample.heading_variance_rad2, &one.heading_variance_rad2}})
        to->push_back(from->front());
      sample.led.push_back(static_cast<std::uint8_t>(random() % 64));
    }
    const std::vector samples{sample};
    const std::uint64_t before = swarm.hash_part();
    swarm.take(Tick{k}, samples);
    EXPECT_EQ(swarm.hash_part(), before);
    proto::StationState part;
    swarm.save(part);
    proto::StationState read;
    ASSERT_TRUE(read.ParseFromString(part.SerializeAsString()));
    TrackedSwarm loaded(plan);
    loaded.load(Tick{k}, read);
    EXPECT_EQ(loaded.hash_part(), before);
    loaded.take(Tick{k}, samples);
    TrackingFrame a, b;
    swarm.emit(Tick{k}, a);
    loaded.emit(Tick{k}, b);
    EXPECT_EQ(a.x_mm, b.x_mm);
    EXPECT_EQ(a.heading_rad, b.heading_rad);
    EXPECT_EQ(a.state, b.state);
    EXPECT_EQ(a.led, b.led);
    swarm.commit({});
    loaded.commit({});
    ASSERT_EQ(swarm.hash_part(), loaded.hash_part()) << k;
  }
}

}  // namespace
}  // namespace kilotwin::ark
