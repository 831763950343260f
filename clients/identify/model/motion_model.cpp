#include "clients/identify/model/motion_model.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "clients/identify/model/block_sums.hpp"

namespace kilotwin::identify {

bool is_camera_map(const Term& term) {
  return std::any_of(term.blocks.begin(), term.blocks.end(), [](const Block& block) {
    const auto of_place = [](Covariate c) { return c == Covariate::kX || c == Covariate::kY; };
    return is_measured(block.target) &&
           std::any_of(block.basis.factors.begin(), block.basis.factors.end(), [&](const Factor& f) {
             return of_place(f.axis.of) || (f.of_two() && of_place(f.and_axis.of));
           });
  });
}

RobotBias MotionModel::bias_of(std::uint32_t robot) const {
  if (const auto known = robots.find(robot); known != robots.end()) return known->second;
  RobotBias unknown;
  unknown.mean_mm_s.setConstant(base.bias_mean_mm_s);
  unknown.covariance = Eigen::Matrix2d::Identity() * base.bias_sd_mm_s * base.bias_sd_mm_s;
  return unknown;
}

Eigen::Vector2d nominal_speeds(const BaseParameters& base, Motion motion) {
  switch (motion) {
    case Motion::kStop: return {0, 0};
    case Motion::kStraight: return {base.straight_mm_s, base.straight_mm_s};
    case Motion::kLeft: return {0, base.turn_mm_s};
    case Motion::kRight: return {base.turn_mm_s, 0};
  }
  return {0, 0};
}

namespace {

/// Calls take(block, value) for the blocks of the measurement model that act under a command, with the weighted sum of their columns in a
/// situation.
template <class Take> void for_each_measurement(const std::vector<Term>& terms, const Situation& s, Take&& take) {
  std::array<double, kMostColumns> columns;
  const Basis* held = nullptr;  // whose columns are there
  for (const Term& term : terms) {
    const double* coefficients = term.coefficients.data();
    for (const Block& block : term.blocks) {
      const auto n = static_cast<Eigen::Index>(block.basis.size());
      const Eigen::Map<const Eigen::VectorXd> own(coefficients, n);
      coefficients += n;
      if (!is_measured(block.target) || (block.during >> static_cast<int>(s.commands.command) & 1) == 0 ||
          block.basis.lacks_key(s))
        continue;
      // Both axes often have the same basis.
      constexpr Eigen::Index kWorthIt = 8;
      if (n < kWorthIt || held == nullptr || !(*held == block.basis)) {
        block.basis.evaluate(s, 0, columns.data());
        held = &block.basis;
      }
      take(block, Eigen::Map<const Eigen::VectorXd>(columns.data(), n).dot(own));
    }
  }
}

/// Adds the values of a block at the left and the right wheel. They are equal unless the block is per wheel.
void add(const Block& block, double left, double right, double wheel_base_mm, MotionChange& change, Rates& rates) {
  using Kind = EffectSettings::Target;
  const auto offset = [&](Kind kind, double along, double across) {
    unit_offsets(kind, true, true, along, across, wheel_base_mm).add_to(change, left);
  };
  switch (block.target) {
    case Target::kGain:
      change.left_gain *= 1 + left;
      change.right_gain *= 1 + right;
      break;
    case Target::kGainLeft: change.left_gain *= 1 + left; break;
    case Target::kGainRight: change.right_gain *= 1 + right; break;
    case Target::kOffset:
      change.left_mm_s += left;
      change.right_mm_s += right;
      break;
    case Target::kOffsetLeft: change.left_mm_s += left; break;
    case Target::kOffsetRight: change.right_mm_s += right; break;
    case Target::kTurn:
      rates.turn_effects_rad_s += left;
      offset(Kind::kTurnRate, 0, 0);
      break;
    case Target::kAhead: offset(Kind::kBodyDrift, 1, 0); break;
    case Target::kSideways: offset(Kind::kBodyDrift, 0, 1); break;
    case Target::kWorldX: offset(Kind::kWorldDrift, 1, 0); break;
    case Target::kWorldY: offset(Kind::kWorldDrift, 0, 1); break;
    default: break;
  }
}

}  // namespace

Rates MotionModel::rates(const Situation& s, const Eigen::Vector2d& bias_mm_s) const {
  BlockSums sums(*this);
  return rates(s, bias_mm_s, sums);
}

Rates MotionModel::rates(const Situation& s, const Eigen::Vector2d& bias_mm_s, BlockSums& sums) const {
  Rates r;
  if (s.commands.driven()) {
    const Eigen::Vector2d v = nominal_speeds(base, s.commands.command) + bias_mm_s;
    r.left_base_mm_s = v[0];
    r.right_base_mm_s = v[1];
  }
  MotionChange change;
  sums.for_each(s, [&](const Block& block, double left, double right) {
    add(block, left, right, base.wheel_base_mm, change, r);
  });
  static_cast<DriveSpeeds&>(r) = changed_speeds(r.left_base_mm_s, r.right_base_mm_s, change, kEffectsLimit_mm_s);
  r.left_gain = change.left_gain;
  r.right_gain = change.right_gain;
  return r;
}

bool MotionModel::looks_at(const Axis& axis) const {
  for (const Term& term : terms)
    for (const Block& block : term.blocks)
      for (const Factor& factor : block.basis.factors)
        if (factor.axis == axis) return true;
  return false;
}

bool MotionModel::measures() const {
  return std::any_of(terms.begin(), terms.end(), [](const Term& term) {
    return std::any_of(term.blocks.begin(), term.blocks.end(),
                       [](const Block& b) { return is_measured(b.target); });
  });
}

Eigen::Vector3d MotionModel::measured(double x_mm, double y_mm, double heading_rad, const Situation& at) const {
  const double c = std::cos(heading_rad), s = std::sin(heading_rad);
  double ahead = base.ahead_mm, left = base.left_mm, scale = 1, x = 0, y = 0, turn = 0, picture = 0;
  if (measures()) {
    Situation there = at;
    there.x_mm = x_mm + base.centre_mm * c;
    there.y_mm = y_mm + base.centre_mm * s;
    there.heading_rad = heading_rad;
    for_each_measurement(terms, there, [&](const Block& block, double v) {
      switch (block.target) {
        case Target::kMeasuredX: x += v; break;
        case Target::kMeasuredY: y += v; break;
        case Target::kMeasuredAhead: ahead += v; break;
        case Target::kMeasuredLeft: left += v; break;
        case Target::kMeasuredScale: scale *= 1 + v; break;
        case Target::kMeasuredTurn: picture += v; break;
        default: turn += v; break;
      }
    });
  }
  const double point_x = x_mm + ahead * c - left * s, point_y = y_mm + ahead * s + left * c;
  return {point_x * scale - point_y * picture + x, point_y * scale + point_x * picture + y,
          heading_rad + turn + picture};
}

Eigen::Vector3d MotionModel::pose_of(const Sample& sample, const Situation& at) const {
  const bool turned = !std::isnan(sample.heading_rad);
  Eigen::Vector3d pose(sample.x_mm, sample.y_mm, turned ? sample.heading_rad : 0);
  // Fixed-point iteration: measurement effects vary little over a few mm.
  for (int pass = 0; pass < (measures() ? 6 : 2); ++pass) {
    const Eigen::Vector3d seen = measured(pose[0], pose[1], pose[2], at);
    pose[0] += sample.x_mm - seen[0];
    pose[1] += sample.y_mm - seen[1];
    if (turned) pose[2] += wrapped_angle(sample.heading_rad - seen[2]);
  }
  return pose;
}

Arc arc_of(const Rates& r, double wheel_base_mm, double heading_rad, double h_s) {
  const double turn = (r.right_mm_s - r.left_mm_s) / wheel_base_mm, forward = r.forward_mm_s();
  // sin(half) / half. The series is exact to the last digit at small angles, as in nearly all steps.
  const double half = turn * h_s / 2, half2 = half * half;
  // Half of the turn in a step; a larger value takes the series where it loses digits.
  constexpr double kLittle_rad = 0.06;
  const double shorter =
      std::abs(half) < kLittle_rad ? 1 - half2 / 6 * (1 - half2 / 20 * (1 - half2 / 42)) : std::sin(half) / half;
  const double c = std::cos(heading_rad + half) * shorter, s = std::sin(heading_rad + half) * shorter;
  return {h_s * (forward * c - r.sideways_mm_s * s + r.drift_x_mm_s),
          h_s * (forward * s + r.sideways_mm_s * c + r.drift_y_mm_s), turn * h_s, c, s};
}

}  // namespace kilotwin::identify
