// Held-out gain: the log-likelihood ratio on held-out tracks, in nats, additive over tracks.
#include "clients/identify/predict/held_out_gain.hpp"

#include <gtest/gtest.h>

#include "core/random/random.hpp"

namespace kilotwin::identify {
namespace {

constexpr double kSpeed_mm_s = 12, kTracker_mm = 0.7, kEvery_s = 0.5;
constexpr int kSamples = 40;

/// Robots that drive straight at 12 mm/s. Every other one is held out.
MeasuredSet straight_on(std::uint32_t robots) {
  const Random random(8);
  MeasuredSet set;
  set.has_commands = set.has_headings = true;
  Run& run = set.runs.emplace_back();
  run.name = "r";
  for (std::uint32_t r = 0; r < robots; ++r) {
    Track& track = run.tracks.emplace_back();
    track.robot = r;
    track.held_out = r % 2 == 1;
    track.commands = {{-1e300, Motion::kStraight}};
    for (int i = 0; i < kSamples; ++i) {
      const Tick at{static_cast<std::uint32_t>(i)};
      const double noise[] = {random.normal(Stream::kMeasurementNoise, r, at, 0),
                              random.normal(Stream::kMeasurementNoise, r, at, 1)};
      Sample s;
      s.time_s = i * kEvery_s;
      s.x_mm = kSpeed_mm_s * s.time_s + kTracker_mm * noise[0];
      s.y_mm = 200.0 * r + kTracker_mm * noise[1];
      s.heading_rad = 0;
      track.samples.push_back(s);
    }
  }
  return set;
}

MotionModel at_speed(double straight_mm_s) {
  MotionModel model;
  model.base.straight_mm_s = straight_mm_s;
  model.noise.position_mm2 = kTracker_mm * kTracker_mm;
  for (std::uint32_t r = 0; r < 8; ++r) model.robots[r].covariance.setZero();
  return model;
}

TEST(HeldOutGain, IsTheLogLikelihoodRatio) {
  const MeasuredSet set = straight_on(8);
  PreparedSet prepared(set);
  const MotionModel right = at_speed(kSpeed_mm_s), wrong = at_speed(kSpeed_mm_s - 1);
  const HeldOutGain gain = held_out_gain(right, wrong, prepared, Tracks::kAll, 1);
  EXPECT_GT(gain.nat, 5 * gain.nat_se);
  EXPECT_GT(gain.nat_se, 0);
  const HeldOutGain less = held_out_gain(wrong, right, prepared, Tracks::kAll, 1);
  EXPECT_DOUBLE_EQ(less.nat, -gain.nat);
  EXPECT_DOUBLE_EQ(less.nat_se, gain.nat_se);
  EXPECT_EQ(held_out_gain(right, right, prepared, Tracks::kAll, 1).nat, 0);
}

TEST(HeldOutGain, TrainingTracksDoNotCount) {
  MeasuredSet set = straight_on(8);
  const MotionModel right = at_speed(kSpeed_mm_s), wrong = at_speed(kSpeed_mm_s - 1);
  const auto gain = [&](Tracks of) {
    PreparedSet prepared(set);
    return held_out_gain(right, wrong, prepared, of, 1).nat;
  };
  const double all = gain(Tracks::kAll), held_out = gain(Tracks::kHeldOut);
  for (Track& track : set.runs.front().tracks) track.held_out = !track.held_out;
  EXPECT_NEAR(held_out + gain(Tracks::kHeldOut), all, 1e-9 * all);
  EXPECT_LT(held_out, 0.7 * all);
}

}  // namespace
}  // namespace kilotwin::identify
