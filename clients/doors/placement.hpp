/// From the coordinates of another system to those of the arena, and back.
#pragma once

#include "clients/doors/tracked_frame.hpp"
#include "idl/door.pb.h"

namespace kilotwin::doors {

/// A pose in the other system's coordinates and unit.
struct SourcePose {
  double x = 0, y = 0, z = 0;
  double qx = 0, qy = 0, qz = 0, qw = 1;  ///< the body's rotation; all 0: not known
};

/// Covariance of a position, in the square of the other system's unit, and variances of rotations about y and z, rad^2.
struct SourceCovariance {
  double xx = 0, xy = 0, xz = 0, yy = 0, zz = 0;
  double about_y = 0, about_z = 0;
};

/// Why a pose is left out.
enum class Fault { kNone, kNotFinite, kQuaternion, kTilted };

class Placement {
 public:
  /// Of a door that core/experiment has checked.
  explicit Placement(const proto::Door& door);

  /// Sets position and heading, with the door's standard deviations. A pose whose rotation is not known, or whose x axis is
  /// vertical, gets an infinite variance of the heading. `robot` is unspecified where there is a fault.
  [[nodiscard]] Fault place(const SourcePose& pose, double max_tilt_rad, TrackedRobot& robot) const;
  /// Sets the covariance; a part that is not finite, or no covariance, leaves the door's. All 0 means not known in ROS.
  void spread(const SourceCovariance& covariance, TrackedRobot& robot) const;
  /// Sets the position from the two coordinates that lie on the floor.
  [[nodiscard]] Fault place_point(double x, double y, TrackedRobot& robot) const;
  /// Sets the heading, which counts anticlockwise from the other system's x axis as seen from above.
  void place_heading(double heading_rad, TrackedRobot& robot) const;
  /// The heading of a velocity in the other system's floor coordinates.
  [[nodiscard]] double heading_of(double vx, double vy) const;
  /// Sets the velocity, from one in the other system's floor coordinates and unit per s.
  void place_velocity(double vx, double vy, TrackedRobot& robot) const;
  /// A robot of the arena in the other system's coordinates.
  [[nodiscard]] SourcePose from_arena(double x_mm, double y_mm, double heading_rad) const;

 private:
  void set_position(double floor_x, double floor_y, TrackedRobot& robot) const;

  proto::Placement::Up up_;
  double x_mm_, y_mm_, unit_mm_;
  double turn_rad_, cos_turn_, sin_turn_;
  double heading_offset_rad_;
  double position_variance_mm2_, heading_variance_rad2_;
};

}  // namespace kilotwin::doors
