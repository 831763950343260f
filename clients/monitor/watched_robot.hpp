/// A tracked robot that the monitor observes: its pose filter, its test statistics (signatures), and the state of its tests.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <utility>

#include "clients/monitor/dispersion.hpp"
#include "clients/monitor/places.hpp"
#include "clients/monitor/robot_filter.hpp"
#include "clients/monitor/settings.hpp"
#include "clients/monitor/signatures.hpp"
#include "core/base/time.hpp"

namespace kilotwin::monitor {

class WatchedRobot {
 public:
  struct Setting {
    Geometry geometry;
    BiasPrior prior;
    MonitorSettings monitor;
    std::int64_t tick_cycles = 0;
    std::uint32_t trackers = 1;
  };
  WatchedRobot(std::uint32_t id, const Setting& setting);

  /// Adds the motion that the model predicts for the step from `tick`. Ticks ascend by one.
  void add_motion(Tick tick, const WheelMotion& motion);
  /// Discards the pose estimate: the robot is absent, or its commands are unknown.
  void lose();
  /// Suspends the tests for half a second from `cycle`, because a contact or a known patch acts on the robot.
  void disturb(std::int64_t cycle);

  /// Updates the filter by a measurement; the motion must be known up to its time. Returns the innovation. Returns none if the
  /// measurement starts the estimate or is too old.
  std::optional<Innovation> measure(const MeasuredPose& measured, std::uint32_t tracker, Dispersion& dispersion);

  /// After an alarm: suspends tests and learning for a minute. Tests then restart, on probation at first.
  void hold();
  /// Whether tests have just restarted after a hold. A detection then means that the earlier effect persists.
  [[nodiscard]] bool is_on_probation() const;
  /// Estimates the biases again; tests restart after another warm-up.
  void relearn();
  /// After an alarm of its tracker or of the arena: estimates the pose again and restarts the tests.
  void restart_tests();
  void clear_slot(Family family, std::size_t slot) { signatures_.clear(family, slot); }

  [[nodiscard]] std::uint32_t id() const { return id_; }
  [[nodiscard]] bool is_followed() const { return phase_ == Phase::kFollowed; }
  /// Whether the filter has converged and the warm-up is over.
  [[nodiscard]] bool is_tested() const { return is_followed() && is_warm_; }
  /// Whether the last measurement was added to the test statistics.
  [[nodiscard]] bool counts() const { return counts_; }
  [[nodiscard]] const Signatures& signatures() const { return signatures_; }
  [[nodiscard]] PlaceSignature& place() { return place_; }
  [[nodiscard]] const RobotFilter& filter() const { return filter_; }
  [[nodiscard]] double tested_s() const { return tested_s_; }
  [[nodiscard]] std::uint64_t restarts() const { return restarts_; }
  /// Whether the first warm-up has ended; true once.
  [[nodiscard]] bool take_first_warm() { return std::exchange(first_warm_, false); }

 private:
  enum class Phase : std::uint8_t { kUnknown, kSeeksHeading, kFollowed };
  /// Length of the motion history, ticks.
  static constexpr std::int64_t kHistory = 64;

  [[nodiscard]] const WheelMotion& motion_of(std::int64_t tick) const {
    return history_[static_cast<std::size_t>(tick % kHistory)];
  }
  [[nodiscard]] WheelMotion mean_motion(std::int64_t from_cycle, std::int64_t to_cycle) const;
  void begin(const MeasuredPose& measured);
  void seek_heading(const MeasuredPose& measured);
  void advance_to(std::int64_t cycle);
  void step_to(std::int64_t cycle);
  void warm_up(double time_s, Dispersion& dispersion);
  void close_block(Dispersion& dispersion);
  [[nodiscard]] bool is_disturbed() const { return at_ < disturbed_until_; }

  const std::uint32_t id_;
  const Setting setting_;
  RobotFilter filter_;
  Signatures signatures_;
  PlaceSignature place_;
  std::array<WheelMotion, kHistory> history_{};
  std::int64_t newest_ = -1;     ///< last tick of history_
  std::int64_t known_from_ = 0;  ///< cycle from which history_ is complete
  Phase phase_ = Phase::kUnknown;
  std::int64_t at_ = 0;  ///< cycle of the estimate
  std::int64_t disturbed_until_ = -1, held_until_ = -1;
  bool was_disturbed_ = false, counts_ = false;
  bool is_warm_ = false, is_relearning_ = false, first_warm_ = false;
  double driven_s_ = 0;  ///< in this warm-up
  double block_s_ = 0;
  std::uint32_t outliers_ = 0;  ///< in a row
  std::uint64_t restarts_ = 0;
  double tested_s_ = 0;
  MeasuredPose sought_from_;  ///< start of the motion from which the heading is estimated
  double sought_x_mm_ = 0, sought_y_mm_ = 0, sought_turn_rad_ = 0;  ///< motion since, as if the heading had been 0
};

}  // namespace kilotwin::monitor
