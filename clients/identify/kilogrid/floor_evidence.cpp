#include "clients/identify/kilogrid/floor_evidence.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/stats/distributions.hpp"

namespace kilotwin::kilogrid {
namespace {

/// Share of each statistic's variance treated as independent: regularises the correlation matrix, so that
/// combinations with small variance do not dominate. Of 0, 0.2, 0.5, 0.8 and 1 (no correlations), 0.5 separated
/// planted effects best from similar ones (tests/clients/identify/kilogrid/floor_alarms.cpp).
constexpr double kOwnShare = 0.5;
/// Robust weights: deviations beyond this many tolerances count less, since no parameter may reach such a
/// statistic.
constexpr double kFar = 6;

/// Each robot's contribution to the deviations of a set's statistics, normalised to sum of squares 1.
Eigen::MatrixXd parts_of(const FloorSet& set) {
  const auto statistics = static_cast<Eigen::Index>(statistic_count());
  std::size_t robots = 0;
  for (const auto& run : set.runs) robots += run.size();
  Eigen::MatrixXd parts(static_cast<Eigen::Index>(robots), statistics);
  for (Eigen::Index s = 0; s < statistics; ++s) {
    const auto q = static_cast<std::size_t>(s);
    const double mean = set.statistics.value[q];
    Eigen::Index row = 0;
    for (const auto& run : set.runs) {
      for (const RobotSums& robot : run) parts(row++, s) = robot.sum[q] - mean * robot.weight[q];
    }
    const double norm = parts.col(s).norm();
    if (norm > 0 && std::isfinite(norm))
      parts.col(s) /= norm;
    else
      parts.col(s).setZero();
  }
  return parts;
}

}  // namespace

Eigen::MatrixXd correlation_of(std::span<const FloorSet> sets) {
  const auto statistics = static_cast<Eigen::Index>(statistic_count());
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(statistics, statistics);
  for (const FloorSet& set : sets) {
    const Eigen::MatrixXd parts = parts_of(set);
    sum.selfadjointView<Eigen::Lower>().rankUpdate(parts.transpose());
  }
  return Eigen::MatrixXd(sum.selfadjointView<Eigen::Lower>()) / static_cast<double>(sets.size());
}

FloorMisfit::FloorMisfit(const FloorSet& measured, const FloorStatistics& simulated, const Eigen::MatrixXd& slopes,
                         const Eigen::MatrixXd& correlation) {
  const auto statistics = static_cast<Eigen::Index>(statistic_count());
  Eigen::MatrixXd covariance = (1 - kOwnShare) * correlation;
  Eigen::VectorXd off = Eigen::VectorXd::Zero(statistics);
  Eigen::MatrixXd scaled = Eigen::MatrixXd::Zero(statistics, slopes.cols());
  Eigen::VectorXd widen = Eigen::VectorXd::Ones(statistics);
  for (Eigen::Index s = 0; s < statistics; ++s) {
    const auto q = static_cast<std::size_t>(s);
    const double difference = simulated.value[q] - measured.statistics.value[q];
    const double variance = measured.tolerance[q] + simulated.variance[q];
    covariance(s, s) = 1;
    if (!(measured.tolerance[q] > 0) || !std::isfinite(difference) || !(variance > 0)) {
      covariance.row(s).setZero();
      covariance.col(s).setZero();
      covariance(s, s) = 1;
      continue;
    }
    ++numbers;
    off(s) = difference / std::sqrt(variance);
    scaled.row(s) = slopes.row(s) / std::sqrt(variance);
    widen(s) = std::sqrt(std::max(1.0, std::abs(off(s)) / kFar));
  }
  covariance = widen.asDiagonal() * covariance * widen.asDiagonal();
  const Eigen::LLT<Eigen::MatrixXd> roots(covariance);
  const Eigen::VectorXd r = roots.matrixL().solve(off);
  const Eigen::MatrixXd a = roots.matrixL().solve(scaled);
  curve = a.transpose() * a;
  gradient = a.transpose() * r;
  misfit = r.squaredNorm();
}

Eigen::VectorXd FloorMisfit::best_steps(const std::vector<bool>& in_use, const FloorBox& box) const {
  // Coordinate descent with box constraints. A small ridge keeps parameters without influence.
  constexpr double kStay = 0.3;
  const Eigen::Index parameters = gradient.size();
  Eigen::VectorXd steps = Eigen::VectorXd::Zero(parameters), slope = gradient;
  for (int sweep = 0; sweep < 300; ++sweep) {
    double farthest = 0;
    for (Eigen::Index p = 0; p < parameters; ++p) {
      const auto q = static_cast<std::size_t>(p);
      if (!in_use[q]) continue;
      const double to =
          std::clamp(steps(p) - (slope(p) + kStay * steps(p)) / (curve(p, p) + kStay), box.least[q], box.most[q]);
      slope += (to - steps(p)) * curve.col(p);
      farthest = std::max(farthest, std::abs(to - steps(p)));
      steps(p) = to;
    }
    if (farthest < 1e-5) break;
  }
  return steps;
}

double FloorMisfit::at(const Eigen::VectorXd& steps) const {
  return misfit + 2 * gradient.dot(steps) + steps.dot(curve * steps);
}

std::vector<double> NullDistribution::scales_of(const std::vector<std::vector<double>>& gains,
                                                std::size_t but) const {
  // Shrinks a candidate's scale towards the mean scale of all candidates, with this many pseudo-observations.
  constexpr double kOthers = 5;
  std::vector<double> sum(switches_.size(), 0), count(switches_.size(), 0);
  for (std::size_t b = 0; b < gains.size(); ++b) {
    for (std::size_t c = 0; c < switches_.size(); ++c) {
      // A parameter at its lower bound has zero gain in half of the sets.
      if (b == but || !(gains[b][c] > 0)) continue;
      sum[c] += gains[b][c] / static_cast<double>(switches_[c]);
      ++count[c];
    }
  }
  const double all = std::accumulate(sum.begin(), sum.end(), 0.0) /
                     std::max(std::accumulate(count.begin(), count.end(), 0.0), 1.0);
  std::vector<double> scales;
  for (std::size_t c = 0; c < sum.size(); ++c)
    scales.push_back(std::max((sum[c] + kOthers * all) / (count[c] + kOthers), 1e-9));
  return scales;
}

NullDistribution::NullDistribution(const std::vector<std::vector<double>>& gains,
                                   const std::vector<std::size_t>& switches)
    : switches_(switches) {
  // The maximum over candidates follows an extreme-value distribution. The spread of log p is shrunk towards the
  // theoretical value, since there are few sets. Each set uses scales estimated from the others, as the measured
  // set does.
  constexpr double kSpread = stats::kGumbelSd, kLikeKnown = 10;
  // The 0.99 quantile, in standard deviations, is stats::gumbel_quantile(0.99, 0, 1) = 3.14. The margin covers the
  // uncertainty of the scales.
  constexpr double kQuantile = 3.5;
  const auto sets = static_cast<double>(gains.size());
  double mean = 0, square = 0;
  for (std::size_t b = 0; b < gains.size(); ++b) {
    scale_ = scales_of(gains, b);
    double largest = 0;
    for (std::size_t c = 0; c < switches_.size(); ++c) largest = std::max(largest, evidence(c, gains[b][c]));
    mean += largest / sets;
    square += largest * largest / sets;
  }
  const double variance = std::max(square - mean * mean, 0.0) * sets;
  const double spread =
      std::max(kSpread, std::sqrt((variance + kLikeKnown * kSpread * kSpread) / (sets - 1 + kLikeKnown)));
  bound_ = mean + kQuantile * spread * std::sqrt(1 + 1 / sets);
  scale_ = scales_of(gains, gains.size());
}

double NullDistribution::evidence(std::size_t candidate, double gain) const {
  if (!(gain > 0)) return 0;
  constexpr double kFarOut = 600;  // there the asymptotic form holds
  const double x = gain / scale_[candidate];
  return x > kFarOut ? x / 2 : -std::log(stats::chi_squared_tail(x, static_cast<double>(switches_[candidate])));
}

double NullDistribution::gain_of(std::size_t candidate, double of) const {
  double low = 0, high = 1e3 * scale_[candidate];
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    (evidence(candidate, middle) < of ? low : high) = middle;
  }
  return high;
}

}  // namespace kilotwin::kilogrid
