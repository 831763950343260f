/// One tracked robot under the monitor: its filter, its signatures, and whether it is being tested.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

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

  /// The motion of the step from `tick`; ticks ascend by one.
  void add_motion(Tick tick, const WheelMotion& motion);
  /// Nothing is known of where it is: it is absent, or its commands are not known.
  void lose();
  /// Contacts or a known patch disturb it from now on for half a second.
  void disturb(std::int64_t cycle);

  /// Takes a measurement up to which the motion is known. Returns its innovation; none where the estimate begins with it, or it is
  /// too old.
  std::optional<Innovation> measure(const MeasuredPose& measured, std::uint32_t tracker, Dispersion& dispersion);

  /// After an alarm: for a minute nothing is tested or learned. Then tests begin anew, on probation at first.
  void hold();
  /// Tests have begun anew after a hold: what differs now has not gone away.
  [[nodiscard]] bool is_on_probation() const;
  /// The biases are learned again, and tests begin after another warm-up.
  void relearn();
  /// After an alarm of its tracker or the arena: the pose is found again, tests begin anew.
  void restart_tests();
  void clear_slot(Family family, std::size_t slot) { signatures_.clear(family, slot); }

  [[nodiscard]] std::uint32_t id() const { return id_; }
  [[nodiscard]] bool is_followed() const { return phase_ == Phase::kFollowed; }
  /// It is followed, and its warm-up is over.
  [[nodiscard]] bool is_tested() const { return is_followed() && is_warm_; }
  /// The last measurement entered the sums.
  [[nodiscard]] bool counts() const { return counts_; }
  [[nodiscard]] const Signatures& signatures() const { return signatures_; }
  [[nodiscard]] PlaceSignature& place() { return place_; }
  [[nodiscard]] const RobotFilter& filter() const { return filter_; }
  [[nodiscard]] double tested_s() const { return tested_s_; }
  [[nodiscard]] std::uint64_t restarts() const { return restarts_; }
  /// Whether its first warm-up has just ended; asked once.
  [[nodiscard]] bool take_first_warm() { return std::exchange(first_warm_, false); }

 private:
  enum class Phase : std::uint8_t { kUnknown, kSeeksHeading, kFollowed };
  /// Motions that are remembered, ticks.
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
  MeasuredPose sought_from_;                                        ///< begin of the stretch that shows the heading
  double sought_x_mm_ = 0, sought_y_mm_ = 0, sought_turn_rad_ = 0;  ///< motion since, as if the heading had been 0
};

}  // namespace kilotwin::monitor
