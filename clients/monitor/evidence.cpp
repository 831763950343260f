#include "clients/monitor/evidence.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>

#include "core/math/elementary.h"

namespace kilotwin::monitor {
namespace {

using Matrix = Eigen::Matrix3d;
using Vector = Eigen::Vector3d;

/// Posterior precision. Unused dimensions get 1.
Matrix precision(const Sums& sums, const SizePrior& prior, double dispersion) {
  constexpr std::array<std::array<std::size_t, 3>, 3> kIndex{{{0, 1, 2}, {1, 3, 4}, {2, 4, 5}}};
  Matrix result = Matrix::Identity();
  for (std::size_t a = 0; a < sums.dimensions; ++a) {
    for (std::size_t b = 0; b < sums.dimensions; ++b)
      result(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(b)) =
          sums.information[kIndex[a][b]] / dispersion;
    result(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(a)) += 1 / (prior.sd[a] * prior.sd[a]);
  }
  return result;
}

Vector scores(const Sums& sums, double dispersion) {
  Vector result = Vector::Zero();
  for (std::size_t a = 0; a < sums.dimensions; ++a)
    result[static_cast<Eigen::Index>(a)] = sums.score[a] / dispersion;
  return result;
}

}  // namespace

Sums& Sums::operator+=(const Sums& other) {
  for (std::size_t i = 0; i < score.size(); ++i) score[i] += other.score[i];
  for (std::size_t i = 0; i < information.size(); ++i) information[i] += other.information[i];
  return *this;
}

Sums& Sums::operator-=(const Sums& other) {
  for (std::size_t i = 0; i < score.size(); ++i) score[i] -= other.score[i];
  for (std::size_t i = 0; i < information.size(); ++i) information[i] -= other.information[i];
  return *this;
}

double evidence(const Sums& sums, const SizePrior& prior, double dispersion) {
  const double bound = evidence_bound(sums, prior, dispersion);
  if (sums.dimensions == 1) {
    const double variance = prior.sd[0] * prior.sd[0];
    return bound - kt_log(1 + variance * sums.information[0] / dispersion) / 2;
  }
  double determinant = precision(sums, prior, dispersion).determinant();
  for (std::size_t a = 0; a < sums.dimensions; ++a) determinant *= prior.sd[a] * prior.sd[a];
  return bound - kt_log(std::max(determinant, 1.0)) / 2;
}

double evidence_bound(const Sums& sums, const SizePrior& prior, double dispersion) {
  if (sums.dimensions == 1) {
    const double score = sums.score[0] / dispersion;
    return score * score / (sums.information[0] / dispersion + 1 / (prior.sd[0] * prior.sd[0])) / 2;
  }
  const Vector score = scores(sums, dispersion);
  return score.dot(precision(sums, prior, dispersion).ldlt().solve(score)) / 2;
}

std::array<Size, 3> sizes(const Sums& sums, const SizePrior& prior, double dispersion) {
  const Matrix variance = precision(sums, prior, dispersion).inverse();
  const Vector mean = variance * scores(sums, dispersion);
  std::array<Size, 3> result;
  for (std::size_t a = 0; a < 3; ++a) {
    const auto i = static_cast<Eigen::Index>(a);
    result[a] = {mean[i], __builtin_sqrt(std::max(0.0, variance(i, i)))};
  }
  return result;
}

double threshold_nat(double tests, double every_s, double per_hour) {
  return std::max(3.0, kt_log(tests / every_s * 3600 / per_hour));
}

}  // namespace kilotwin::monitor
