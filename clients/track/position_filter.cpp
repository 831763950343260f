#include "clients/track/position_filter.hpp"

namespace kilotwin::track {
namespace {

constexpr double kSpeed_mm_s = 12;
/// Spectral density of the acceleration, mm^2/s^3: a robot that changes between rest and 10 mm/s about once a second.
constexpr double kAcceleration_mm2_s3 = 150;
/// A robot that is not seen may be anywhere it can drive to, but not faster than this.
constexpr double kMostVelocityVariance = 20.0 * 20.0;

}  // namespace

PositionFilter::PositionFilter(double time_s, double x_mm, double y_mm, double sd_mm)
    : time_s_(time_s),
      x_{x_mm, 0, sd_mm * sd_mm, 0, kSpeed_mm_s * kSpeed_mm_s},
      y_{y_mm, 0, sd_mm * sd_mm, 0, kSpeed_mm_s * kSpeed_mm_s} {}

void PositionFilter::Axis::predict(double dt_s) {
  position += velocity * dt_s;
  pp += 2 * dt_s * pv + dt_s * dt_s * vv + kAcceleration_mm2_s3 * dt_s * dt_s * dt_s / 3;
  pv += dt_s * vv + kAcceleration_mm2_s3 * dt_s * dt_s / 2;
  vv += kAcceleration_mm2_s3 * dt_s;
  if (vv > kMostVelocityVariance) {
    // The correlation stays as it is.
    const double share = kMostVelocityVariance / vv;
    pv *= share;
    vv = kMostVelocityVariance;
  }
}

void PositionFilter::Axis::update(double measured, double variance) {
  const double innovation = measured - position, total = pp + variance;
  const double gain_p = pp / total, gain_v = pv / total;
  position += gain_p * innovation;
  velocity += gain_v * innovation;
  vv -= gain_v * pv;
  pv -= gain_p * pv;
  pp -= gain_p * pp;
}

void PositionFilter::predict(double time_s) {
  const double dt_s = time_s - time_s_;
  if (dt_s <= 0) return;
  x_.predict(dt_s);
  y_.predict(dt_s);
  time_s_ = time_s;
}

void PositionFilter::update(double x_mm, double y_mm, double sd_mm) {
  x_.update(x_mm, sd_mm * sd_mm);
  y_.update(y_mm, sd_mm * sd_mm);
}

double PositionFilter::distance2(double x_mm, double y_mm, double sd_mm) const {
  const double dx = x_mm - x_.position, dy = y_mm - y_.position;
  return dx * dx / (x_.pp + sd_mm * sd_mm) + dy * dy / (y_.pp + sd_mm * sd_mm);
}

}  // namespace kilotwin::track
