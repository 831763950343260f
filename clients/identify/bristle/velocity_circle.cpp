#include "clients/identify/bristle/velocity_circle.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

#include "core/stats/quantiles.hpp"

namespace kilotwin::bristle {
namespace {}  // namespace

VelocityCircle fit_circle(std::span<const std::complex<double>> velocities, std::complex<double> prior_drift,
                          double instants) {
  VelocityCircle circle;
  if (velocities.empty()) return {prior_drift, 0, 1};
  std::vector<double> sizes, off(velocities.size());
  std::complex<double> directions = 0;
  for (const std::complex<double>& v : velocities) {
    sizes.push_back(std::abs(v));
    if (std::abs(v) > 0) directions += v / std::abs(v);
  }
  circle.prior_share = std::abs(directions) / static_cast<double>(velocities.size());
  double radius = std::max(stats::upper_median(sizes), 1e-9);
  std::complex<double> centre = prior_drift * radius;
  // Gauss-Newton on the distances from the circle, with Huber weights beyond 1.5 standard deviations.
  constexpr int kIterations = 15;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    for (std::size_t i = 0; i < velocities.size(); ++i)
      off[i] = std::abs(std::abs(velocities[i] - centre) - radius);
    const double limit = 1.5 * std::max(1.48 * stats::upper_median(off), 1e-6 * radius);
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
    for (const std::complex<double>& v : velocities) {
      const std::complex<double> from = v - centre;
      const double distance = std::max(std::abs(from), 1e-9), residual = distance - radius;
      const double weight = std::min(1.0, limit / std::max(std::abs(residual), 1e-12));
      const Eigen::Vector3d slope(-from.real() / distance, -from.imag() / distance, -1);
      normal += weight * slope * slope.transpose();
      gradient += weight * residual * slope;
    }
    // On a full circle each velocity contributes half an observation of each centre coordinate.
    const std::complex<double> off_belief = centre - prior_drift * radius;
    normal(0, 0) += instants / 2;
    normal(1, 1) += instants / 2;
    gradient(0) += instants / 2 * off_belief.real();
    gradient(1) += instants / 2 * off_belief.imag();
    normal.diagonal().array() += 1e-9;
    const Eigen::Vector3d step = normal.ldlt().solve(gradient);
    centre -= std::complex<double>(step(0), step(1));
    radius = std::max(radius - step(2), 0.1 * radius);
  }
  circle.drift = centre / radius;
  circle.speed_mm_s = radius;
  return circle;
}

}  // namespace kilotwin::bristle
