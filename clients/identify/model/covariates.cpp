#include "clients/identify/model/covariates.hpp"

#include <algorithm>
#include <cmath>

namespace kilotwin::identify {

double wrapped_angle(double rad) { return std::remainder(rad, 2 * M_PI); }

namespace {

/// Motor-on time of one motor (0, 1) or of either (2): total, or discounted with time constant kDecayTimes_s[decay
/// - 1].
double motor_on_s(const CommandState& commands, std::size_t motor, std::uint8_t decay_index) {
  if (decay_index > 0) return commands.discounted_s(decay_index - 1u, motor);
  return motor < 2 ? commands.motor_s[motor] : commands.driven_s;
}

/// Whether the covariate needs the list of neighbours, since no precomputed sum covers it.
bool is_listed(const Axis& axis) { return axis.focus > 0 || axis.within_mm > 0 || is_of_some(axis); }

bool counts(const Axis& axis, const OtherRobot& other) {
  if (axis.others != Others::kAny && (other.driven == 1) != (axis.others == Others::kDriven)) return false;
  return axis.only_robot == 0 || other.robot + 1U == axis.only_robot;
}

/// The nearest neighbour that counts; null: none within the radius.
const OtherRobot* nearest(const Axis& axis, const NeighbourView& near) {
  const OtherRobot* best = nullptr;
  const double reach = reach_mm(axis);
  for (std::uint32_t i = 0; i < near.listed; ++i) {
    const OtherRobot& other = (*near.list)[near.first_listed + i];
    if (other.distance_mm <= reach && counts(axis, other) &&
        (best == nullptr || other.distance_mm < best->distance_mm))
      best = &other;
  }
  return best;
}

/// Directional sum over neighbours. Without a list, all neighbours count as if they lay in that direction.
double toward(const Axis& axis, const Situation& s) {
  const NeighbourView& near = s.near;
  const bool count = axis.of == Covariate::kNeighbours;
  if (near.list == nullptr) return count ? near.count[axis.radius] : near.density[axis.radius];
  const double reach = reach_mm(axis);
  if (near.nearest_mm > reach) return 0;
  // Without a focus, the direction would take a third of the time of models of some robots.
  const double ahead = axis.focus > 0 ? s.heading_rad + axis.toward_deg * (M_PI / 180) : 0;
  const double ahead_x = axis.focus > 0 ? std::cos(ahead) : 0, ahead_y = axis.focus > 0 ? std::sin(ahead) : 0;
  double sum = 0;
  for (std::uint32_t i = 0; i < near.listed; ++i) {
    const OtherRobot& other = (*near.list)[near.first_listed + i];
    if (other.distance_mm > reach || !counts(axis, other)) continue;
    const double part = 1 - other.distance_mm * other.distance_mm / (reach * reach);
    double share = count ? 1 : part * part;
    const double once = (1 + other.towards_x * ahead_x + other.towards_y * ahead_y) / 2;
    for (std::uint8_t k = 0; k < axis.focus; ++k) share *= once;
    sum += share;
  }
  return sum;
}

}  // namespace

const char* name_of(Covariate of) {
  switch (of) {
    case Covariate::kNothing: return "nothing";
    case Covariate::kTime: return "time";
    case Covariate::kX: return "x";
    case Covariate::kY: return "y";
    case Covariate::kRadius: return "radius";
    case Covariate::kHeading: return "heading";
    case Covariate::kCommand: return "command";
    case Covariate::kSinceCommand: return "time_since_command";
    case Covariate::kMotorTime: return "motor_time";
    // The left motor drives the right-hand wheel (idl/effects.proto names motors, this model names wheels).
    case Covariate::kLeftMotorTime: return "right_motor_time";
    case Covariate::kRightMotorTime: return "left_motor_time";
    case Covariate::kDrivenTime: return "driven_time";
    case Covariate::kNeighbours: return "neighbours";
    case Covariate::kNearest: return "nearest";
    case Covariate::kDensity: return "density";
    case Covariate::kBearing: return "nearest_bearing";
    case Covariate::kPreviousCommand: return "previous_command";
    case Covariate::kPreviousLasted: return "previous_lasted";
    case Covariate::kLastTurn: return "last_turn";
    case Covariate::kEarlierTurn: return "earlier_turn";
    case Covariate::kCommandCount: return "command_count";
    case Covariate::kSinceRest: return "since_rest";
    case Covariate::kMotorTimeDifference: return "motor_time_difference";
    case Covariate::kMotorTimeSum: return "motor_time_sum";
    case Covariate::kTraffic: return "place";
    case Covariate::kRobot: return "robot";
    case Covariate::kRun: return "run";
    case Covariate::kPointDistance: return "point_distance";
    case Covariate::kAlong: return "along";
  }
  return "";
}

const char* unit_of(Covariate of) {
  switch (of) {
    case Covariate::kTime:
    case Covariate::kSinceCommand:
    case Covariate::kMotorTime:
    case Covariate::kLeftMotorTime:
    case Covariate::kRightMotorTime:
    case Covariate::kDrivenTime:
    case Covariate::kPreviousLasted:
    case Covariate::kSinceRest:
    case Covariate::kMotorTimeDifference:
    case Covariate::kMotorTimeSum:
    case Covariate::kTraffic: return "s";
    case Covariate::kX:
    case Covariate::kY:
    case Covariate::kRadius:
    case Covariate::kNearest:
    case Covariate::kPointDistance:
    case Covariate::kAlong: return "mm";
    case Covariate::kHeading:
    case Covariate::kBearing: return "rad";
    default: return "";
  }
}

double reach_mm(const Axis& axis) { return axis.within_mm > 0 ? axis.within_mm : kNeighbourRadii_mm[axis.radius]; }

double value_of(const Axis& axis, const Situation& s, std::size_t wheel) {
  switch (axis.of) {
    case Covariate::kNothing: return 0;
    case Covariate::kTime: return s.time_s;
    case Covariate::kX: return s.x_mm;
    case Covariate::kY: return s.y_mm;
    case Covariate::kRadius: return std::sqrt(s.x_mm * s.x_mm + s.y_mm * s.y_mm);
    case Covariate::kHeading: return s.heading_rad;
    case Covariate::kCommand: return static_cast<double>(s.commands.command);
    case Covariate::kSinceCommand: return s.commands.since_s;
    case Covariate::kMotorTime: return motor_on_s(s.commands, wheel, axis.decay_index);
    case Covariate::kLeftMotorTime: return motor_on_s(s.commands, 0, axis.decay_index);
    case Covariate::kRightMotorTime: return motor_on_s(s.commands, 1, axis.decay_index);
    case Covariate::kDrivenTime: return motor_on_s(s.commands, 2, axis.decay_index);
    case Covariate::kNeighbours: return is_listed(axis) ? toward(axis, s) : s.near.count[axis.radius];
    case Covariate::kNearest:
      if (is_of_some(axis) && s.near.list != nullptr) {
        const OtherRobot* const other = nearest(axis, s.near);
        return other != nullptr ? other->distance_mm : reach_mm(axis);
      }
      return std::min(s.near.nearest_mm, reach_mm(axis));
    case Covariate::kDensity: return is_listed(axis) ? toward(axis, s) : s.near.density[axis.radius];
    case Covariate::kBearing:
      if (is_of_some(axis) && s.near.list != nullptr) {
        const OtherRobot* const other = nearest(axis, s.near);
        return other != nullptr ? wrapped_angle(std::atan2(other->towards_y, other->towards_x) - s.heading_rad) : 0;
      }
      return s.near.nearest_mm > reach_mm(axis) ? 0 : wrapped_angle(s.near.direction_rad - s.heading_rad);
    case Covariate::kPreviousCommand:
      return s.commands.first ? kNoCommand : static_cast<double>(s.commands.previous);
    case Covariate::kPreviousLasted: return s.commands.previous_lasted_s;
    case Covariate::kSinceRest: return s.commands.since_rest_s;
    case Covariate::kMotorTimeDifference: return s.commands.motor_s[1] - s.commands.motor_s[0];
    case Covariate::kMotorTimeSum: return s.commands.motor_s[0] + s.commands.motor_s[1];
    case Covariate::kLastTurn: return static_cast<double>(s.commands.last_turn);
    case Covariate::kEarlierTurn: return static_cast<double>(s.commands.earlier_turn);
    case Covariate::kCommandCount: return s.commands.count;
    case Covariate::kTraffic: return s.near.traffic[axis.radius];
    case Covariate::kRobot: return s.robot;
    case Covariate::kRun: return s.run;
    case Covariate::kPointDistance:
      return std::hypot(s.x_mm - axis.point.x_mm_at(s.time_s), s.y_mm - axis.point.y_mm_at(s.time_s)) -
             axis.point.growth_mm_s * s.time_s;
    case Covariate::kAlong: return s.x_mm * std::cos(axis.along_rad) + s.y_mm * std::sin(axis.along_rad);
  }
  return 0;
}

}  // namespace kilotwin::identify
