#include "clients/monitor/watched_robot.hpp"

#include <algorithm>
#include <utility>

#include "core/base/pose.hpp"
#include "core/math/elementary.h"

namespace kilotwin::monitor {
namespace {

/// Disturbances last for this long after they were seen, s.
constexpr double kDisturbed_s = 0.5;
/// A measurement may be this much older than the estimate, s.
constexpr double kOldest_s = 0.25;
/// After so many outliers in a row without an alarm the pose is found again.
constexpr std::uint32_t kLost = 60;
/// Blocks of time over which the dispersion of scores is taken, s.
constexpr double kBlock_s = 5;
/// A heading is sought over this distance of the predicted and of the measured motion, mm; error of the direction, rad.
constexpr double kPredicted_mm = 15, kMeasured_mm = 8, kDirection_rad = 0.15;

/// After an alarm a robot is left alone for so long; an alarm so soon afterwards is of the same cause, s.
constexpr double kHold_s = 60, kProbation_s = 15;

std::int64_t cycles(double seconds) { return static_cast<std::int64_t>(seconds * kNominalClockHz); }
double seconds(std::int64_t cycles) { return static_cast<double>(cycles) / kNominalClockHz; }

}  // namespace

WatchedRobot::WatchedRobot(std::uint32_t id, const Setting& setting)
    : id_(id), setting_(setting), filter_(setting.geometry, setting.prior), signatures_(setting.trackers) {}

void WatchedRobot::add_motion(Tick tick, const WheelMotion& motion) {
  if (tick.count() != newest_ + 1) known_from_ = tick.count() * setting_.tick_cycles;
  newest_ = tick.count();
  history_[static_cast<std::size_t>(newest_ % kHistory)] = motion;
  known_from_ = std::max(known_from_, (newest_ - kHistory + 1) * setting_.tick_cycles);
}

void WatchedRobot::lose() {
  phase_ = Phase::kUnknown;
  counts_ = false;
}

void WatchedRobot::disturb(std::int64_t cycle) {
  disturbed_until_ = std::max(disturbed_until_, cycle + cycles(kDisturbed_s));
}

void WatchedRobot::hold() {
  restart_tests();
  held_until_ = disturbed_until_ = at_ + cycles(kHold_s);
}

bool WatchedRobot::is_on_probation() const {
  return held_until_ >= 0 && at_ >= held_until_ && at_ < held_until_ + cycles(kProbation_s);
}

void WatchedRobot::relearn() {
  filter_.forget_biases();
  filter_.loosen();
  signatures_.clear();
  place_.clear();
  is_warm_ = false;
  is_relearning_ = true;
  driven_s_ = 0;
}

void WatchedRobot::restart_tests() {
  filter_.loosen();
  signatures_.clear();
  place_.clear();
}

WheelMotion WatchedRobot::mean_motion(std::int64_t from_cycle, std::int64_t to_cycle) const {
  const std::int64_t tick_cycles = setting_.tick_cycles;
  if (from_cycle / tick_cycles == (to_cycle - 1) / tick_cycles && from_cycle % tick_cycles != 0) {
    WheelMotion motion = motion_of(from_cycle / tick_cycles);
    motion.change_left_mm_s = motion.change_right_mm_s = 0;
    return motion;
  }
  WheelMotion mean;
  mean.gain_left = mean.gain_right = 0;
  mean.limit_mm_s = motion_of(from_cycle / tick_cycles).limit_mm_s;
  for (std::int64_t tick = from_cycle / tick_cycles; tick * tick_cycles < to_cycle; ++tick) {
    const WheelMotion& motion = motion_of(tick);
    const std::int64_t from = std::max(from_cycle, tick * tick_cycles);
    const std::int64_t to = std::min(to_cycle, (tick + 1) * tick_cycles);
    const double part = static_cast<double>(to - from) / static_cast<double>(to_cycle - from_cycle);
    mean.nominal_left_mm_s += part * motion.nominal_left_mm_s;
    mean.nominal_right_mm_s += part * motion.nominal_right_mm_s;
    mean.gain_left += part * motion.gain_left;
    mean.gain_right += part * motion.gain_right;
    mean.offset_left_mm_s += part * motion.offset_left_mm_s;
    mean.offset_right_mm_s += part * motion.offset_right_mm_s;
    mean.sideways_mm_s += part * motion.sideways_mm_s;
    mean.drift_x_mm_s += part * motion.drift_x_mm_s;
    mean.drift_y_mm_s += part * motion.drift_y_mm_s;
    mean.driven += part * motion.driven;
    mean.relative_noise_left += part * motion.relative_noise_left;
    mean.relative_noise_right += part * motion.relative_noise_right;
    mean.noise_left += part * motion.noise_left;
    mean.noise_right += part * motion.noise_right;
    mean.noise_turn += part * motion.noise_turn;
    mean.noise_position += part * motion.noise_position;
    if (tick * tick_cycles < from_cycle) continue;
    mean.change_left_mm_s += motion.change_left_mm_s;
    mean.change_right_mm_s += motion.change_right_mm_s;
  }
  return mean;
}

void WatchedRobot::step_to(std::int64_t cycle) {
  const WheelMotion motion = mean_motion(at_, cycle);
  const bool disturbed = is_disturbed();
  const Transition step =
      filter_.predict(motion, seconds(cycle - at_), setting_.monitor.command_jitter_s, disturbed);
  at_ = cycle;
  signatures_.predict(step);
  place_.predict(step);
  if (is_warm_) return;
  driven_s_ += disturbed ? 0 : step.driven_s;
}

void WatchedRobot::advance_to(std::int64_t cycle) {
  // Short gaps in one step, longer ones tick by tick.
  const std::int64_t tick_cycles = setting_.tick_cycles;
  while (cycle - at_ > 3 * tick_cycles) step_to((at_ / tick_cycles + 1) * tick_cycles);
  if (cycle > at_) step_to(cycle);
}

void WatchedRobot::begin(const MeasuredPose& measured) {
  counts_ = false;
  outliers_ = 0;
  at_ = measured.cycle;
  signatures_.forget_pose();
  place_.clear();
  if (measured.has_heading()) {
    filter_.start(measured, measured.heading_rad, measured.heading_variance);
    phase_ = Phase::kFollowed;
    return;
  }
  sought_from_ = measured;
  sought_x_mm_ = sought_y_mm_ = sought_turn_rad_ = 0;
  phase_ = Phase::kSeeksHeading;
}

void WatchedRobot::seek_heading(const MeasuredPose& measured) {
  // Dead reckoning from heading 0; the direction of the measured motion then shows the heading.
  MeasuredPose origin = sought_from_;
  origin.x_mm = sought_x_mm_;
  origin.y_mm = sought_y_mm_;
  RobotFilter reckoning(setting_.geometry, setting_.prior);
  reckoning.start(origin, sought_turn_rad_, 1);
  reckoning.predict(mean_motion(at_, measured.cycle), seconds(measured.cycle - at_), 0, false);
  sought_x_mm_ = reckoning.x_mm();
  sought_y_mm_ = reckoning.y_mm();
  sought_turn_rad_ = reckoning.heading_rad();
  at_ = measured.cycle;
  const double dx = measured.x_mm - sought_from_.x_mm, dy = measured.y_mm - sought_from_.y_mm;
  const double predicted2 = sought_x_mm_ * sought_x_mm_ + sought_y_mm_ * sought_y_mm_,
               measured2 = dx * dx + dy * dy;
  if (is_disturbed()) return begin(measured);
  if (predicted2 < kPredicted_mm * kPredicted_mm || measured2 < kMeasured_mm * kMeasured_mm) return;
  const double from_zero = kt_atan2(dy, dx) - kt_atan2(sought_y_mm_, sought_x_mm_);
  const double variance = 2 * (measured.xx + measured.yy) / measured2 + kDirection_rad * kDirection_rad;
  filter_.start(measured, wrapped(from_zero + sought_turn_rad_), variance);
  phase_ = Phase::kFollowed;
}

std::optional<Innovation> WatchedRobot::measure(const MeasuredPose& measured, std::uint32_t tracker,
                                                Dispersion& dispersion) {
  if (measured.in_doubt || !measured.is_near() || measured.cycle < known_from_) return std::nullopt;
  if (phase_ != Phase::kUnknown && at_ < known_from_) lose();  // a gap longer than the memory
  if (phase_ == Phase::kUnknown) {
    begin(measured);
    return std::nullopt;
  }
  const double time_s = seconds(measured.cycle - at_);
  if (time_s < -kOldest_s || (phase_ == Phase::kSeeksHeading && time_s <= 0)) return std::nullopt;
  if (phase_ == Phase::kSeeksHeading) {
    seek_heading(measured);
    return std::nullopt;
  }
  advance_to(measured.cycle);
  const bool disturbed = is_disturbed();
  if (disturbed && !was_disturbed_) {
    signatures_.forget_pose();
    place_.clear();
  }
  was_disturbed_ = disturbed;
  const double x_mm = filter_.x_mm(), y_mm = filter_.y_mm();
  Innovation innovation = filter_.correct(measured, std::max(0.0, -time_s));
  outliers_ = innovation.is_outlier ? outliers_ + 1 : 0;
  if (outliers_ > kLost) {
    filter_.loosen();
    signatures_.forget_pose();
    outliers_ = 0;
    ++restarts_;
  }
  counts_ = !disturbed;
  signatures_.correct(innovation, tracker, x_mm, y_mm, counts_);
  place_.correct(innovation, counts_);
  if (disturbed) signatures_.forget_pose();
  if (is_warm_ && counts_) tested_s_ += std::max(0.0, time_s);
  if (!is_warm_) warm_up(std::max(0.0, time_s), dispersion);
  return innovation;
}

void WatchedRobot::warm_up(double time_s, Dispersion& dispersion) {
  block_s_ += time_s;
  if (block_s_ >= kBlock_s) close_block(dispersion);
  if (driven_s_ < setting_.monitor.warm_up_s) return;
  is_warm_ = true;
  first_warm_ = !is_relearning_;
  signatures_.clear();
  place_.clear();
}

void WatchedRobot::close_block(Dispersion& dispersion) {
  // Every block begins in a cleared slot, so all slots hold the same.
  constexpr std::size_t kSlot = 0;
  const auto add = [&](Group group, std::size_t column) {
    const double information = signatures_.information(column, column, kSlot);
    const double score = signatures_.score(column, kSlot);
    if (information > 0) dispersion.add(group, score * score / information);
  };
  if (!is_relearning_ && counts_) {
    add(Group::kGain, kGainLeft);
    add(Group::kGain, kGainRight);
    add(Group::kBias, kBiasLeft);
    add(Group::kBias, kBiasRight);
    add(Group::kHeading, kHeading);
    add(Group::kDrift, kDriftX);
    add(Group::kDrift, kDriftY);
    add(Group::kShift, kShiftX);
    add(Group::kShift, kShiftY);
  }
  signatures_.clear();
  block_s_ = 0;
}

}  // namespace kilotwin::monitor
