#include "services/physics/drive.hpp"

#include <algorithm>
#include <map>
#include <utility>

#include "core/effects/motion_change.hpp"
#include "core/math/elementary.h"
#include "core/plan/motion_settings.hpp"

namespace kilotwin::physics {
namespace {

/// sin(t) / t and (1 - cos(t)) / t^2 as functions of t^2.
struct TurnSeries {
  double sine, versine;
};

inline TurnSeries series_of(double square) {
  const double sine =
      1 + square * (-1.0 / 6 + square * (1.0 / 120 + square * (-1.0 / 5040 + square * (1.0 / 362880))));
  const double versine =
      0.5 + square * (-1.0 / 24 + square * (1.0 / 720 + square * (-1.0 / 40320 + square * (1.0 / 3628800))));
  return {sine, versine};
}

inline Arc arc_from(TurnSeries s, double run_mm, double turn_rad, double axle_offset_mm) {
  const double sin_turn = turn_rad * s.sine;
  const double one_minus_cos = turn_rad * (turn_rad * s.versine);
  return {run_mm * s.sine - axle_offset_mm * one_minus_cos,
          run_mm * (turn_rad * s.versine) + axle_offset_mm * sin_turn, 1 - one_minus_cos, sin_turn};
}

/// The same, with an additional motion to the left of the heading.
inline Arc arc_from(TurnSeries s, double run_mm, double sideways_mm, double turn_rad, double axle_offset_mm) {
  Arc arc = arc_from(s, run_mm, turn_rad, axle_offset_mm);
  arc.forward_mm -= sideways_mm * (turn_rad * s.versine);
  arc.sideways_mm += sideways_mm * s.sine;
  return arc;
}

/// Replaces a drift (x, y) over the tick by the drift of the first of 1 / part equal sub-steps. The drift turns with the body
/// in each sub-step. The result is such that all sub-steps together give (x, y): it is rotated back by half of the
/// remaining turn, and lengthened by the loss from turning.
void drift_of_sub_step(double turn_rad, double part, double& x, double& y) {
  constexpr double kTooSmall_rad = 1e-9;
  if (part == 1) return;
  if (turn_rad < kTooSmall_rad && turn_rad > -kTooSmall_rad) {
    x *= part;
    y *= part;
    return;
  }
  double s, c;
  kt_sincos(-0.5 * (turn_rad - turn_rad * part), &s, &c);
  const double scale = kt_sin(0.5 * turn_rad * part) / kt_sin(0.5 * turn_rad);
  const double to_x = scale * (c * x - s * y);
  y = scale * (s * x + c * y);
  x = to_x;
}

/// The same quantities for turns of any size, without series.
TurnSeries large_turn(double turn_rad) {
  double sin_half, cos_half;
  kt_sincos(0.5 * turn_rad, &sin_half, &cos_half);
  return {2 * sin_half * cos_half / turn_rad, 2 * (sin_half / turn_rad) * (sin_half / turn_rad)};
}

inline bool is_small(double turn_rad) { return turn_rad <= kSeriesTurn_rad && turn_rad >= -kSeriesTurn_rad; }

double magnitude(double v) { return v < 0 ? -v : v; }

}  // namespace

Arc arc_of(double run_mm, double turn_rad, double axle_offset_mm) {
  const TurnSeries s = is_small(turn_rad) ? series_of(turn_rad * turn_rad) : large_turn(turn_rad);
  return arc_from(s, run_mm, turn_rad, axle_offset_mm);
}

void Drives::reserve(std::size_t bodies) {
  if (body.size() >= bodies) return;
  bodies = (bodies + 7) / 8 * 8;
  body.resize(bodies);
  for (auto* column : {&left_mm_s, &right_mm_s, &heading_rad, &part, &x_mm, &y_mm, &cos_turn, &sin_turn, &turn_rad})
    column->resize(bodies);
}

void Drives::spread(std::size_t bodies) {
  if (count == bodies) return;
  std::size_t end = bodies;
  for (std::size_t d = count; d-- > 0; end = body[d]) {
    const std::size_t i = body[d];
    for (auto* column : {&x_mm, &y_mm, &cos_turn, &sin_turn, &turn_rad}) {
      double* const values = column->data();
      values[i] = values[d];
      for (std::size_t k = i + 1; k < end; ++k) values[k] = 0;
    }
  }
  for (auto* column : {&x_mm, &y_mm, &cos_turn, &sin_turn, &turn_rad})
    std::fill_n(column->begin(), static_cast<std::ptrdiff_t>(end), 0);
}

DriveModel::DriveModel(const RunPlan& plan)
    : random_(plan.seed()),
      tick_s_(plan.tick_length.seconds()),
      wheel_base_mm_(plan.motion_settings().wheel_base_mm),
      axle_offset_mm_(plan.motion_settings().axle_offset_mm),
      motors_(plan),
      effects_(plan),
      bias_(plan.robots(), {0, 0}) {
  const DriveKernel* kernels[3];
  drive_kernels(kernels);
  kernel_ = kernels[0];
  const MotionSettings& motion = plan.motion_settings();
  const RobotParameters parameters(plan);
  make_curves(motion, parameters);
  double top_bias = 0;
  if (motion.noise) {
    for (std::uint32_t robot = 0; robot < plan.robots(); ++robot) {
      bias_[robot] = parameters.bias(robot);
      top_bias = std::max({top_bias, magnitude(bias_[robot].left_mm_s), magnitude(bias_[robot].right_mm_s)});
    }
    if (motion.factor_variance_s > 0) factor_sd_ = __builtin_sqrt(motion.factor_variance_s / tick_s_);
  }

  double top_straight = 0, top_turn = 0;
  for (const Curves& curves : curves_of_) {
    top_straight =
        std::max({top_straight, curves_[curves.straight_left][255], curves_[curves.straight_right][255]});
    top_turn = std::max({top_turn, curves_[curves.turn_left][255], curves_[curves.turn_right][255]});
  }
  // The centre's speed is linear in the wheels' speeds, so the parts of nominal speeds and biases add up. The bias part is
  // largest with both wheels forward, or one forward and one backward. The factor f scales both parts. Two wheels
  // forward at different speeds give at most the speed of both at the faster one, or of the faster one alone.
  const double lever = axle_offset_mm_ / wheel_base_mm_;
  const double top_nominal =
      std::max(top_straight, std::max(top_straight, top_turn) * __builtin_sqrt(0.25 + lever * lever));
  const double top_any = std::max(top_straight, top_turn) + top_bias;
  const double widest = std::max(1.0, 2 * magnitude(lever));
  top_speed_mm_s_ = top_nominal + top_bias * widest + kTopNormal * factor_sd_ * top_any * widest;
  if (effects_.empty()) return;
  limits_ = effects_.limits(top_any * (1 + kTopNormal * factor_sd_));
  // A drift has two components. Within a turning sub-step it is slightly faster than its mean.
  top_speed_mm_s_ += limits_.wheel_mm_s * widest + limits_.sideways_mm_s + 1.5 * limits_.drift_mm_s;
}

void DriveModel::make_curves(const MotionSettings& motion, const RobotParameters& parameters) {
  std::map<std::pair<bool, std::uint8_t>, std::uint16_t> known;
  const auto curve_of = [&](bool turn, std::uint8_t calibrated) {
    const auto [entry, is_new] = known.try_emplace({turn, calibrated}, static_cast<std::uint16_t>(curves_.size()));
    if (is_new) {
      Curve& curve = curves_.emplace_back();
      for (std::size_t duty = std::size_t{motors_.dead_band_duty()} + 1; duty < 256; ++duty) {
        const double slope = motion.duty_slope, of_calibrated = static_cast<double>(duty) / calibrated;
        const double ratio = slope * of_calibrated + (1 - slope);
        curve[duty] = (turn ? motion.turn_speed_mm_s : motion.straight_speed_mm_s) *
                      std::clamp(ratio, 0.0, motion.top_speed_ratio);
      }
    }
    return entry->second;
  };
  for (std::uint32_t robot = 0; robot < parameters.robots(); ++robot) {
    const Calibration& own = parameters.calibration(robot);
    curves_of_.push_back({curve_of(true, own.turn_left), curve_of(true, own.turn_right),
                          curve_of(false, own.straight_left), curve_of(false, own.straight_right)});
  }
}

/// Mean wheel speeds over a tick that starts with a kick and continues with the duties. The arc of the mean differs by
/// micrometres from the two arcs in sequence.
DriveModel::Speeds DriveModel::speeds_with_kick(std::uint32_t robot, Duties duties) const {
  const Curves& curves = curves_of_[robot];
  const WheelBias& bias = bias_[robot];
  const double kick = motors_.kick_part(duties.spin_up), after = (duties.left | duties.right) != 0 ? 1 - kick : 0;
  const Speeds full = nominal(curves, 255, 255), set = nominal(curves, duties.left, duties.right);
  return {kick * (full.left_mm_s + bias.left_mm_s) + after * (set.left_mm_s + bias.left_mm_s),
          kick * (full.right_mm_s + bias.right_mm_s) + after * (set.right_mm_s + bias.right_mm_s)};
}

void DriveModel::add(Drives& drives, std::uint32_t body, std::uint32_t robot, Tick from, Duties duties,
                     double heading_rad, double part) const {
  auto [left, right] = nominal(curves_of_[robot], duties.left, duties.right);
  left += bias_[robot].left_mm_s;
  right += bias_[robot].right_mm_s;
  if (duties.spin_up != 0) {
    const Speeds mean = speeds_with_kick(robot, duties);
    left = mean.left_mm_s;
    right = mean.right_mm_s;
  }
  if (factor_sd_ > 0) {
    left *= 1 + factor_sd_ * random_.normal(Stream::kWheelFactor, robot, from, 0);
    right *= 1 + factor_sd_ * random_.normal(Stream::kWheelFactor, robot, from, 1);
  }
  if (!duties.any()) left = right = 0;
  const std::size_t n = drives.count++;
  drives.body[n] = body;
  drives.left_mm_s[n] = left;
  drives.right_mm_s[n] = right;
  drives.heading_rad[n] = heading_rad;
  drives.part[n] = part;
}

void DriveModel::add(Drives& drives, const std::vector<std::uint8_t>& selected,
                     const std::vector<std::uint32_t>& robot, Tick from, const std::vector<Duties>& duties,
                     const std::vector<double>& heading_rad, double part) const {
  drives.reserve(robot.size());
  const bool plain = !(factor_sd_ > 0);
  const Curve* const curves = curves_.data();
  double* const left_mm_s = drives.left_mm_s.data();
  double* const right_mm_s = drives.right_mm_s.data();
  for (std::uint32_t i = 0; i < robot.size(); ++i) {
    if (selected[i] == 0) continue;
    const Duties own = duties[i];
    if (!plain || own.spin_up != 0 || own.left == 0 || own.right == 0) {
      add(drives, i, robot[i], from, own, heading_rad[i], part);
      continue;
    }
    // The common case, inlined.
    const std::size_t n = drives.count++;
    const Curves& of = curves_of_[robot[i]];
    const WheelBias& bias = bias_[robot[i]];
    left_mm_s[n] = curves[of.straight_right][own.right] + bias.left_mm_s;
    right_mm_s[n] = curves[of.straight_left][own.left] + bias.right_mm_s;
    drives.body[n] = i;
    drives.heading_rad[n] = heading_rad[i];
    drives.part[n] = part;
  }
}

void DriveModel::change(Drives& drives, Tick from, const RobotColumns& known, const ArenaFields* fields) {
  const std::size_t count = drives.count;
  MotionChanges& changes = drives.changes;
  effects_.evaluate(from, known, std::span(drives.body).first(count), fields, changes);
  for (std::size_t i = 0; i < count; ++i) {
    double& left = drives.left_mm_s[i];
    double& right = drives.right_mm_s[i];
    left = changed_speed(left, changes.left_gain[i], changes.left_mm_s[i], limits_.wheel_mm_s);
    right = changed_speed(right, changes.right_gain[i], changes.right_mm_s[i], limits_.wheel_mm_s);
  }
  if (!effects_.drift()) return;
  for (std::size_t i = 0; i < count; ++i) {
    changes.sideways_mm_s[i] = limited(changes.sideways_mm_s[i], limits_.sideways_mm_s);
    changes.drift_x_mm_s[i] = limited(changes.drift_x_mm_s[i], limits_.drift_mm_s);
    changes.drift_y_mm_s[i] = limited(changes.drift_y_mm_s[i], limits_.drift_mm_s);
  }
}

void DriveModel::integrate(Drives& drives) const {
  if (effects_.drift()) {
    for (std::size_t i = 0; i < drives.count; ++i) integrate_one<true>(drives, i);
    return;
  }
  const DriveColumns columns{drives.left_mm_s.data(), drives.right_mm_s.data(), drives.heading_rad.data(),
                             drives.part.data(),      drives.turn_rad.data(),   drives.x_mm.data(),
                             drives.y_mm.data(),      drives.cos_turn.data(),   drives.sin_turn.data()};
  const DriveGeometry geometry{0.5 * tick_s_, tick_s_ / wheel_base_mm_, axle_offset_mm_};
  if (kernel_->integrate(geometry, columns, (drives.count + 7) / 8)) return;
  for (std::size_t i = 0; i < drives.count; ++i) {
    if (!is_small(drives.turn_rad[i] * drives.part[i])) integrate_one<false>(drives, i);
  }
}

/// As the kernel, for drifts and for turns of any size.
template <bool kDrift> void DriveModel::integrate_one(Drives& drives, std::size_t i) const {
  const double left = drives.left_mm_s[i], right = drives.right_mm_s[i], part = drives.part[i];
  const double whole_turn = (right - left) * (tick_s_ / wheel_base_mm_), turn = whole_turn * part;
  const double run_mm = (left + right) * (0.5 * tick_s_) * part;
  const TurnSeries series = is_small(turn) ? series_of(turn * turn) : large_turn(turn);
  Arc arc = arc_from(series, run_mm, turn, axle_offset_mm_);
  if constexpr (kDrift) {
    const double sideways_mm = drives.changes.sideways_mm_s[i] * tick_s_ * part;
    arc = arc_from(series, run_mm, sideways_mm, turn, axle_offset_mm_);
  }
  double s, c;
  kt_sincos(drives.heading_rad[i], &s, &c);
  double x = c * arc.forward_mm - s * arc.sideways_mm, y = s * arc.forward_mm + c * arc.sideways_mm;
  if constexpr (kDrift) {
    double drift_x = drives.changes.drift_x_mm_s[i] * tick_s_, drift_y = drives.changes.drift_y_mm_s[i] * tick_s_;
    drift_of_sub_step(whole_turn, part, drift_x, drift_y);
    x += drift_x;
    y += drift_y;
  }
  drives.turn_rad[i] = whole_turn;
  drives.x_mm[i] = x;
  drives.y_mm[i] = y;
  drives.cos_turn[i] = arc.cos_turn;
  drives.sin_turn[i] = arc.sin_turn;
}

}  // namespace kilotwin::physics
