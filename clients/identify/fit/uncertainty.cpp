#include "clients/identify/fit/uncertainty.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

#include "clients/identify/model/camera_scale.hpp"

namespace kilotwin::identify {
namespace {

/// Variance of the scores of clusters over what the information expects; 1 or more. Few clusters do not tell it.
double dispersion_of(const std::vector<Unit>& units, const Eigen::MatrixXd& covariance) {
  constexpr Eigen::Index kFewest = 40;
  Eigen::Index clusters = 0;
  double sum = 0, expected = 0;
  for (const Unit& unit : units) {
    clusters += unit.cluster_scores.cols();
    for (Eigen::Index k = 0; k < unit.cluster_scores.cols(); ++k)
      sum += unit.cluster_scores.col(k).dot(covariance * unit.cluster_scores.col(k));
    expected += (covariance * unit.information).trace();
  }
  return clusters < kFewest || expected <= 0 ? 1 : std::max(1.0, sum / expected);
}

/// Adds the mean of the biases over robots as a last parameter. The biases have it as the mean of their prior, and it has been
/// eliminated from no unit: base speeds and this mean explain the same motion.
Eigen::MatrixXd with_bias_mean(const std::vector<Unit>& units, const Eigen::MatrixXd& information,
                               double bias_sd_mm_s) {
  const Eigen::Index n = information.rows();
  const double precision = 1 / (bias_sd_mm_s * bias_sd_mm_s);
  const Eigen::Vector2d ones = Eigen::Vector2d::Ones();
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(n + 1, n + 1);
  out.topLeftCorner(n, n) = information;
  // Its own prior: as many biases at the ARGoS paper's value as the fit assumes.
  out(n, n) = Fitter::kPriorBiases * precision;
  for (const Unit& unit : units) {
    out.col(n).head(n) += precision * unit.bias_by_column.transpose() * ones;
    out(n, n) += 2 * precision - precision * precision * ones.dot(unit.bias_covariance * ones);
  }
  out.row(n).head(n) = out.col(n).head(n).transpose();
  return out;
}

}  // namespace

Uncertainty uncertainty_of(const Fitter& fitter, const FitState& state) {
  const MotionModel& model = state.model;
  const std::vector<Unit> units = linearise(model, state.tracks.units(), blocks_of(model), {100, fitter.threads()});
  const Eigen::Index n = units.front().information.rows();
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(n, n);
  Eigen::VectorXd unused = Eigen::VectorXd::Zero(n);
  for (const Unit& unit : units) information += unit.information;
  fitter.add_base_prior(model, information, unused);
  Eigen::Index first = kBaseColumns;
  for (const Term& term : model.terms) {
    information.diagonal().segment(first, term.precision.size()) += term.precision;
    first += term.precision.size();
  }
  // Discs that touch tell the common scale of a camera map, the speeds and the wheel base.
  if (const Eigen::VectorXd by_scale = log_scale_by_coefficients(model); by_scale.size() > 0 && state.scale)
    information.bottomRightCorner(by_scale.size(), by_scale.size()).noalias() +=
        by_scale * by_scale.transpose() / (state.scale->relative_sd() * state.scale->relative_sd());
  const double bias_precision = 1 / (model.base.bias_sd_mm_s * model.base.bias_sd_mm_s);
  const Eigen::MatrixXd with_mean = with_bias_mean(units, information, model.base.bias_sd_mm_s);
  Eigen::MatrixXd covariance = with_mean.ldlt().solve(Eigen::MatrixXd::Identity(n + 1, n + 1));
  Uncertainty out;
  covariance *= dispersion_of(units, covariance.topLeftCorner(n, n));
  out.covariance = covariance.topLeftCorner(n, n);
  // The mean of the biases where the columns are known: it follows them, and has a variance of its own.
  const Eigen::RowVectorXd mean_by_column = -with_mean.row(n).head(n) / with_mean(n, n);
  const double mean_variance = 1 / with_mean(n, n);
  // A robot with several units has the precision-weighted mean of their biases.
  struct Sums {
    Eigen::Matrix2d precision = Eigen::Matrix2d::Zero();
    Eigen::MatrixXd by_column;
    double units = 0;
  };
  std::map<std::uint32_t, Sums> robots;
  for (const Unit& unit : units) {
    Sums& sums = robots[unit.robot];
    const Eigen::Matrix2d precision = unit.bias_covariance.inverse();
    if (sums.by_column.size() == 0) sums.by_column = Eigen::MatrixXd::Zero(2, n);
    sums.precision += precision;
    sums.by_column += precision * unit.bias_by_column;
    sums.units += 1;
  }
  for (const auto& [robot, sums] : robots) {
    const Eigen::Matrix2d alone = sums.precision.inverse();
    const Eigen::Vector2d by_mean = alone * Eigen::Vector2d::Constant(sums.units * bias_precision);
    const Eigen::Matrix2d own = alone + by_mean * mean_variance * by_mean.transpose();
    const Eigen::MatrixXd by = by_mean * mean_by_column - alone * sums.by_column;
    out.biases[robot] = own + by * out.covariance * by.transpose();
    out.given[robot] = {own, by};
  }
  return out;
}

ValueWithSd value_of(const MotionModel& model, std::size_t term, std::size_t block, const Situation& at,
                     const Eigen::MatrixXd& covariance) {
  Eigen::Index column = kBaseColumns, own = 0;
  for (std::size_t t = 0; t < term; ++t) column += model.terms[t].coefficients.size();
  for (std::size_t b = 0; b < block; ++b)
    own += static_cast<Eigen::Index>(model.terms[term].blocks[b].basis.size());
  const Basis& basis = model.terms[term].blocks[block].basis;
  std::array<double, kMostColumns> values;
  basis.evaluate(at, 0, values.data());
  const auto n = static_cast<Eigen::Index>(basis.size());
  const Eigen::Map<const Eigen::VectorXd> columns(values.data(), n);
  const double variance = columns.dot(covariance.block(column + own, column + own, n, n) * columns);
  return {columns.dot(model.terms[term].coefficients.segment(own, n)), std::sqrt(std::max(0.0, variance))};
}

}  // namespace kilotwin::identify
