/// Camera trackers that make up what they see, and write it to the public topic as any tracker does.
#pragma once

#include <atomic>
#include <cstdint>
#include <limits>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "clients/doors/tracked_frame.hpp"

namespace kilotwin::test {

/// A robot that drives round a circle, in the arena's frame.
struct CirclingRobot {
  std::uint32_t robot = 0;
  double x_mm = 0, y_mm = 0, radius_mm = 100;  ///< of the circle
  double rate_rad_s = 0.1, phase_rad = 0;
  double from_s = 0, until_s = std::numeric_limits<double>::infinity();  ///< when the tracker sees it
  std::uint8_t led = 0;
};

/// Properties of a tracker. Its frame lies at (x_mm, y_mm) of the arena, turned by turn_rad.
struct TrackerKind {
  std::string source = "ceiling";
  double clock_ahead_s = 37;
  double x_mm = 0, y_mm = 0, turn_rad = 0;
  double pace = 1;  ///< of the run: robots move, and frames come, as many times faster
};

/// 30 frames per second of the run, written 8 ms after their exposure, and delayed by queues of 2 ms on average. The clock is 50 ppm fast;
/// positions have 0.3 mm of noise.
class SyntheticTracker {
 public:
  static constexpr double kFrames_per_s = 30, kExposureToSent_s = 0.008;

  SyntheticTracker(const dds::Participant& participant, TrackerKind kind, std::vector<CirclingRobot> robots);
  ~SyntheticTracker() { stop(); }
  [[nodiscard]] bool is_heard() const { return writer_.readers() > 0; }
  void start();
  void stop();
  [[nodiscard]] std::uint64_t written() const { return written_; }

 private:
  void run(const std::stop_token& stop);
  void write(std::uint64_t frame, double sent_s);
  [[nodiscard]] doors::TrackedRobot see(const CirclingRobot& robot, double time_s);

  const TrackerKind kind_;
  const std::vector<CirclingRobot> robots_;
  doors::FrameWriter writer_;
  std::mt19937_64 random_{11};
  std::atomic<std::uint64_t> written_{0};
  std::jthread thread_;
};

}  // namespace kilotwin::test
