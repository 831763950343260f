#include "tests/system/synthetic_tracker.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <mutex>
#include <utility>

#include "core/base/pose.hpp"

namespace kilotwin::test {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kDrift = 50e-6, kMeanQueue_s = 0.002, kLongestQueue_s = 0.02;
constexpr double kNoise_mm = 0.3, kHeadingVariance_rad2 = 0.01;

}  // namespace

SyntheticTracker::SyntheticTracker(const dds::Participant& participant, TrackerKind kind,
                                   std::vector<CirclingRobot> robots)
    : kind_(std::move(kind)), robots_(std::move(robots)), writer_(participant, kind_.source) {}

void SyntheticTracker::start() {
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

void SyntheticTracker::stop() {
  thread_.request_stop();
  if (thread_.joinable()) thread_.join();
}

void SyntheticTracker::run(const std::stop_token& stop) {
  std::mutex mutex;
  std::condition_variable_any wake;
  const auto begun = Clock::now();
  std::exponential_distribution<double> queue(1 / kMeanQueue_s);
  for (std::uint64_t frame = 1; !stop.stop_requested(); ++frame) {
    const double sent_s = static_cast<double>(frame) / (kFrames_per_s * kind_.pace);
    const std::chrono::duration<double> due(sent_s + std::min(queue(random_), kLongestQueue_s));
    std::unique_lock lock(mutex);
    wake.wait_until(lock, stop, begun + std::chrono::duration_cast<Clock::duration>(due), [] { return false; });
    write(frame, sent_s);
  }
}

void SyntheticTracker::write(std::uint64_t frame, double sent_s) {
  const double capture_s = sent_s - kExposureToSent_s;
  const auto reading_ns = [this](double t_s) {
    return std::llround((kind_.clock_ahead_s + (1 + kDrift) * t_s) * 1e9);
  };
  doors::TrackedFrame sample{frame, reading_ns(capture_s), reading_ns(sent_s), false, {}};
  const double run_s = capture_s * kind_.pace;
  for (const CirclingRobot& robot : robots_) {
    if (run_s >= robot.from_s && run_s <= robot.until_s) sample.robots.push_back(see(robot, run_s));
  }
  writer_.write(sample);
  ++written_;
}

doors::TrackedRobot SyntheticTracker::see(const CirclingRobot& robot, double time_s) {
  std::normal_distribution<double> noise(0, kNoise_mm);
  const double angle = robot.rate_rad_s * time_s + robot.phase_rad;
  const double dx = robot.x_mm + robot.radius_mm * std::cos(angle) - kind_.x_mm,
               dy = robot.y_mm + robot.radius_mm * std::sin(angle) - kind_.y_mm;
  const double c = std::cos(kind_.turn_rad), s = std::sin(kind_.turn_rad);
  doors::TrackedRobot seen;
  seen.robot = robot.robot;
  seen.x_mm = c * dx + s * dy + noise(random_);
  seen.y_mm = -s * dx + c * dy + noise(random_);
  seen.heading_rad = std::remainder(angle + kPi / 2 - kind_.turn_rad, 2 * kPi);
  seen.xx_mm2 = seen.yy_mm2 = static_cast<float>(kNoise_mm * kNoise_mm);
  seen.heading_variance_rad2 = static_cast<float>(kHeadingVariance_rad2);
  seen.led = robot.led;
  return seen;
}

}  // namespace kilotwin::test
