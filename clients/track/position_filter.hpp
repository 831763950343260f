/// Kalman filter of one robot's position and velocity: nearly constant velocity, white acceleration noise.
#pragma once

namespace kilotwin::track {

/// Symmetric 2x2 covariance, mm^2.
struct Covariance {
  double xx = 0, xy = 0, yy = 0;
};

class PositionFilter {
 public:
  /// At rest as far as is known: the velocity's standard deviation is a Kilobot's speed.
  PositionFilter(double time_s, double x_mm, double y_mm, double sd_mm);

  /// Goes on to `time_s`; earlier times change nothing.
  void predict(double time_s);
  /// A measured position with independent errors of `sd_mm` along each axis, at the time of the last prediction.
  void update(double x_mm, double y_mm, double sd_mm);

  [[nodiscard]] double time_s() const { return time_s_; }
  [[nodiscard]] double x_mm() const { return x_.position; }
  [[nodiscard]] double y_mm() const { return y_.position; }
  [[nodiscard]] double vx_mm_s() const { return x_.velocity; }
  [[nodiscard]] double vy_mm_s() const { return y_.velocity; }
  [[nodiscard]] Covariance covariance() const { return {x_.pp, 0, y_.pp}; }
  /// Squared Mahalanobis distance of a measurement from the prediction; two degrees of freedom.
  [[nodiscard]] double distance2(double x_mm, double y_mm, double sd_mm) const;

 private:
  /// The axes do not depend on each other: noise and measurement errors are alike in all directions.
  struct Axis {
    double position = 0, velocity = 0, pp = 0, pv = 0, vv = 0;
    void predict(double dt_s);
    void update(double measured, double variance);
  };
  double time_s_;
  Axis x_, y_;
};

}  // namespace kilotwin::track
