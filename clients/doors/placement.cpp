#include "clients/doors/placement.hpp"

#include <cmath>

#include "core/base/pose.hpp"

namespace kilotwin::doors {
namespace {

constexpr double kRadPerDeg = kPi / 180;
/// A rotation whose quaternion is longer or shorter than 1 by more is no rotation.
constexpr double kNormTolerance = 0.05;
constexpr double kCosineRounding = 1e-12;
/// A body's x axis has no heading where its projection on the floor is shorter.
constexpr double kLeastProjection = 1e-3;
/// Width and height of ARK's picture, 1 px = 1 mm, divided by two.
constexpr double kArkHalf_mm = 1000;

/// A vector of the other system with the third axis turned upwards.
struct Vector {
  double x, y, z;
};

Vector upright(proto::Placement::Up up, double x, double y, double z) {
  switch (up) {
    case proto::Placement::Y_UP: return {x, -z, y};
    case proto::Placement::PICTURE: return {x, -y, -z};
    default: return {x, y, z};
  }
}

Vector from_upright(proto::Placement::Up up, const Vector& v) {
  switch (up) {
    case proto::Placement::Y_UP: return {v.x, v.z, -v.y};
    case proto::Placement::PICTURE: return {v.x, -v.y, -v.z};
    default: return v;
  }
}

proto::Placement::Up up_of(const proto::Door& door) {
  if (door.placement().has_up()) return door.placement().up();
  return door.has_ros2() ? proto::Placement::Z_UP : proto::Placement::PICTURE;
}

double unit_of(const proto::Door& door) {
  if (door.placement().has_unit_mm()) return door.placement().unit_mm();
  return door.has_ros2() ? 1000 : 1;
}

/// Whether the other system's origin is the corner of ARK's picture.
bool is_ark(const proto::Door& door) {
  return door.has_ark() || (door.has_log() && door.log().format() == proto::LogDoor::ARK);
}

}  // namespace

Placement::Placement(const proto::Door& door)
    : up_(up_of(door)),
      x_mm_(door.placement().has_x_mm() ? door.placement().x_mm() : (is_ark(door) ? -kArkHalf_mm : 0)),
      y_mm_(door.placement().has_y_mm() ? door.placement().y_mm() : (is_ark(door) ? kArkHalf_mm : 0)),
      unit_mm_(unit_of(door)),
      turn_rad_(door.placement().turn_deg() * kRadPerDeg),
      cos_turn_(std::cos(turn_rad_)),
      sin_turn_(std::sin(turn_rad_)),
      heading_offset_rad_(door.placement().heading_offset_deg() * kRadPerDeg),
      position_variance_mm2_(door.position_sd_mm() * door.position_sd_mm()),
      heading_variance_rad2_(std::pow(door.heading_sd_deg() * kRadPerDeg, 2)) {}

void Placement::set_position(double floor_x, double floor_y, TrackedRobot& robot) const {
  robot.x_mm = x_mm_ + unit_mm_ * (cos_turn_ * floor_x - sin_turn_ * floor_y);
  robot.y_mm = y_mm_ + unit_mm_ * (sin_turn_ * floor_x + cos_turn_ * floor_y);
  robot.xx_mm2 = robot.yy_mm2 = static_cast<float>(position_variance_mm2_);
  robot.xy_mm2 = 0;
}

Fault Placement::place(const SourcePose& pose, double max_tilt_rad, TrackedRobot& robot) const {
  const double norm2 = pose.qx * pose.qx + pose.qy * pose.qy + pose.qz * pose.qz + pose.qw * pose.qw;
  if (!std::isfinite(pose.x + pose.y + pose.z) || !std::isfinite(norm2)) return Fault::kNotFinite;
  const Vector at = upright(up_, pose.x, pose.y, pose.z);
  set_position(at.x, at.y, robot);
  if (!std::isfinite(robot.x_mm) || !std::isfinite(robot.y_mm)) return Fault::kNotFinite;
  robot.heading_rad = 0;
  robot.heading_variance_rad2 = std::numeric_limits<float>::infinity();
  if (norm2 == 0) return Fault::kNone;
  const double norm = std::sqrt(norm2);
  if (std::abs(norm - 1) > kNormTolerance) return Fault::kQuaternion;
  const Vector axis = upright(up_, pose.qx / norm, pose.qy / norm, pose.qz / norm);
  const double w = pose.qw / norm;
  const double cos_tilt = 1 - 2 * (axis.x * axis.x + axis.y * axis.y);
  if (cos_tilt < std::cos(max_tilt_rad) - kCosineRounding) return Fault::kTilted;
  const double along_x = 1 - 2 * (axis.y * axis.y + axis.z * axis.z);
  const double along_y = 2 * (w * axis.z + axis.x * axis.y);
  if (std::hypot(along_x, along_y) >= kLeastProjection) place_heading(std::atan2(along_y, along_x), robot);
  return Fault::kNone;
}

void Placement::spread(const SourceCovariance& covariance, TrackedRobot& robot) const {
  const double scale = unit_mm_ * unit_mm_;
  const bool y_up = up_ == proto::Placement::Y_UP;
  const double xx = covariance.xx * scale, yy = (y_up ? covariance.zz : covariance.yy) * scale;
  // The floor's second axis is z or y, and points the other way unless z is up.
  const double xy = (y_up                               ? -covariance.xz
                     : up_ == proto::Placement::PICTURE ? -covariance.xy
                                                        : covariance.xy) *
                    scale;
  const double heading = y_up ? covariance.about_y : covariance.about_z;
  const bool positive = xx > 0 && yy > 0 && xx * yy - xy * xy >= 0;
  if (positive && std::isfinite(xx + yy + xy)) {
    const double c = cos_turn_, s = sin_turn_;
    robot.xx_mm2 = static_cast<float>(c * c * xx - 2 * c * s * xy + s * s * yy);
    robot.yy_mm2 = static_cast<float>(s * s * xx + 2 * c * s * xy + c * c * yy);
    robot.xy_mm2 = static_cast<float>(c * s * (xx - yy) + (c * c - s * s) * xy);
  }
  const bool heading_known = std::isfinite(robot.heading_variance_rad2);
  if (heading_known && heading > 0 && std::isfinite(heading))
    robot.heading_variance_rad2 = static_cast<float>(heading);
}

Fault Placement::place_point(double x, double y, TrackedRobot& robot) const {
  const Vector at = upright(up_, x, up_ == proto::Placement::Y_UP ? 0 : y, up_ == proto::Placement::Y_UP ? y : 0);
  set_position(at.x, at.y, robot);
  return std::isfinite(robot.x_mm) && std::isfinite(robot.y_mm) ? Fault::kNone : Fault::kNotFinite;
}

void Placement::place_heading(double heading_rad, TrackedRobot& robot) const {
  robot.heading_rad = wrapped(std::remainder(heading_rad + turn_rad_ + heading_offset_rad_, 2 * kPi));
  robot.heading_variance_rad2 = static_cast<float>(heading_variance_rad2_);
}

double Placement::heading_of(double vx, double vy) const {
  return std::atan2(up_ == proto::Placement::Z_UP ? vy : -vy, vx);
}

void Placement::place_velocity(double vx, double vy, TrackedRobot& robot) const {
  const double floor_vy = up_ == proto::Placement::Z_UP ? vy : -vy;
  robot.vx_mm_s = static_cast<float>(unit_mm_ * (cos_turn_ * vx - sin_turn_ * floor_vy));
  robot.vy_mm_s = static_cast<float>(unit_mm_ * (sin_turn_ * vx + cos_turn_ * floor_vy));
}

SourcePose Placement::from_arena(double x_mm, double y_mm, double heading_rad) const {
  const double dx = (x_mm - x_mm_) / unit_mm_, dy = (y_mm - y_mm_) / unit_mm_;
  const Vector at = from_upright(up_, {cos_turn_ * dx + sin_turn_ * dy, -sin_turn_ * dx + cos_turn_ * dy, 0});
  const double half = (heading_rad - turn_rad_) / 2;
  const Vector axis = from_upright(up_, {0, 0, std::sin(half)});
  return {at.x, at.y, at.z, axis.x, axis.y, axis.z, std::cos(half)};
}

}  // namespace kilotwin::doors
