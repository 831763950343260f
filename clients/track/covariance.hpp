/// Covariance of a place.
#pragma once

namespace kilotwin::track {

/// Symmetric 2x2 covariance, mm^2 or px^2.
struct Covariance {
  double xx = 0, xy = 0, yy = 0;

  [[nodiscard]] static Covariance round(double sd) { return {sd * sd, 0, sd * sd}; }
  [[nodiscard]] Covariance plus(const Covariance& other) const {
    return {xx + other.xx, xy + other.xy, yy + other.yy};
  }
  [[nodiscard]] Covariance times(double factor) const { return {factor * xx, factor * xy, factor * yy}; }
  [[nodiscard]] double determinant() const { return xx * yy - xy * xy; }
};

}  // namespace kilotwin::track
