#include "clients/identify/fit/uncertainty.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "clients/identify/model/camera_scale.hpp"

namespace kilotwin::identify {
namespace {

/// Variance of the scores of clusters over what the information expects; 1 or more. Few clusters do not tell it. `covariance`: of the
/// first columns.
double dispersion_of(const std::vector<Unit>& units, const Eigen::MatrixXd& covariance) {
  constexpr Eigen::Index kFewest = 40;  // clusters; with fewer, the dispersion counts as 1
  Eigen::Index clusters = 0;
  double sum = 0, expected = 0;
  const Eigen::Index n = covariance.rows();
  for (const Unit& unit : units) {
    clusters += unit.cluster_scores.cols();
    for (Eigen::Index k = 0; k < unit.cluster_scores.cols(); ++k) {
      const auto score = unit.cluster_scores.col(k).head(n);
      sum += score.dot(covariance * score);
    }
    expected += covariance.cwiseProduct(unit.information.topLeftCorner(n, n)).sum();
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

/// The standard deviation of biases as the mean of the population has it. That of the model is the most likely one of n biases, those of
/// the prior included, about their own mean. Over its uncertainty, their mean has Student's t distribution of n - 1 degrees of freedom,
/// whose variance is n / (n - 3) times as large.
double bias_sd_for_mean_mm_s(const std::vector<Unit>& units, double most_likely_mm_s) {
  std::set<std::uint32_t> robots;
  for (const Unit& unit : units) robots.insert(unit.robot);
  const double n = Fitter::kPriorBiases + 2 * static_cast<double>(robots.size());
  return most_likely_mm_s * std::sqrt(n / (n - 3));
}

/// The inverse of a positive definite matrix whose rows may have very different units.
Eigen::MatrixXd inverse_of(const Eigen::MatrixXd& information) {
  const Eigen::VectorXd scale = information.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = scale.asDiagonal() * information * scale.asDiagonal();
  return scale.asDiagonal() *
         scaled.ldlt().solve(Eigen::MatrixXd::Identity(information.rows(), information.cols())) *
         scale.asDiagonal();
}

/// Priors of base parameters and coefficients, and what robots that touch tell about the scale of a camera map.
void add_priors(const Fitter& fitter, const FitState& state, Eigen::MatrixXd& information, Eigen::Index n) {
  const MotionModel& model = state.model;
  Eigen::VectorXd unused = Eigen::VectorXd::Zero(information.rows());
  fitter.add_base_prior(model, information, unused);
  Eigen::Index first = kBaseColumns;
  for (const Term& term : model.terms) {
    information.diagonal().segment(first, term.precision.size()) += term.precision;
    first += term.precision.size();
  }
  if (const Eigen::VectorXd by_scale = log_scale_by_coefficients(model); by_scale.size() > 0 && state.scale)
    information.block(n - by_scale.size(), n - by_scale.size(), by_scale.size(), by_scale.size()).noalias() +=
        by_scale * by_scale.transpose() / (state.scale->relative_sd() * state.scale->relative_sd());
}

/// A robot with several units has the precision-weighted mean of their biases.
struct BiasSums {
  Eigen::Matrix2d precision = Eigen::Matrix2d::Zero();
  Eigen::MatrixXd by_column;
  double units = 0;
};
std::map<std::uint32_t, BiasSums> bias_sums_of(const std::vector<Unit>& units) {
  std::map<std::uint32_t, BiasSums> robots;
  for (const Unit& unit : units) {
    BiasSums& sums = robots[unit.robot];
    const Eigen::Matrix2d precision = unit.bias_covariance.inverse();
    if (sums.by_column.size() == 0) sums.by_column = Eigen::MatrixXd::Zero(2, unit.bias_by_column.cols());
    sums.precision += precision;
    sums.by_column += precision * unit.bias_by_column;
    sums.units += 1;
  }
  return robots;
}

/// The standard deviation of the biases' standard deviation s, by its Fisher information. Biases that the data give with the
/// precision D have the marginal covariance V = D^-1 + s^2, of which s has the information 2 s^2 tr V^-2.
double sd_of_bias_sd(const std::map<std::uint32_t, BiasSums>& robots, double sd_mm_s) {
  const double square = sd_mm_s * sd_mm_s;
  // The prior of the fit: as many biases at the ARGoS paper's value.
  double information = 2 * Fitter::kPriorBiases / square;
  for (const auto& [robot, sums] : robots) {
    const Eigen::Matrix2d data = sums.precision - sums.units / square * Eigen::Matrix2d::Identity();
    const Eigen::Matrix2d marginal = data * (Eigen::Matrix2d::Identity() + square * data).inverse();
    information += 2 * square * (marginal * marginal).trace();
  }
  return 1 / std::sqrt(information);
}

DataExtent extent_of(const PreparedSet& tracks) {
  DataExtent out;
  double low = 1e300, high = -1e300;
  for (const TrackView& view : tracks.views()) {
    for (const Sample& s : view.track->samples) {
      low = std::min({low, s.x_mm, s.y_mm});
      high = std::max({high, s.x_mm, s.y_mm});
      out.duration_s = std::max(out.duration_s, s.time_s);
    }
  }
  out.half_side_mm = std::max(1.0, (high - low) / 2);
  return out;
}

}  // namespace

Uncertainty uncertainty_of(const Fitter& fitter, const FitState& state) {
  const MotionModel& model = state.model;
  Uncertainty out;
  out.held = held_numbers_of(model, extent_of(state.tracks));
  std::vector<Block> blocks = blocks_of(model);
  blocks.insert(blocks.end(), out.held.columns.blocks.begin(), out.held.columns.blocks.end());
  LineariseOptions options{100, fitter.threads()};
  options.of_block = &out.held.columns.of_block;
  std::vector<Unit> units = linearise(model, state.tracks.units(), blocks, options);
  const Eigen::Index columns = units.front().information.rows(), n = columns - out.held.columns.weights.rows(),
                     parameters = n + out.held.size();
  Eigen::MatrixXd by_parameter = Eigen::MatrixXd::Zero(columns, parameters);
  by_parameter.topLeftCorner(n, n).setIdentity();
  by_parameter.bottomRightCorner(columns - n, parameters - n) = out.held.columns.weights;
  Eigen::MatrixXd of_columns = Eigen::MatrixXd::Zero(columns, columns);
  for (Unit& unit : units) {
    of_columns += unit.information;
    unit.bias_by_column = (unit.bias_by_column * by_parameter).eval();
  }
  Eigen::MatrixXd information = by_parameter.transpose() * of_columns * by_parameter;
  add_priors(fitter, state, information, n);
  information.bottomRightCorner(parameters - n, parameters - n) += out.held.precision;
  const double bias_sd_mm_s = bias_sd_for_mean_mm_s(units, model.base.bias_sd_mm_s),
               bias_precision = 1 / (bias_sd_mm_s * bias_sd_mm_s);
  const Eigen::MatrixXd with_mean = with_bias_mean(units, information, bias_sd_mm_s);
  std::vector<Eigen::Index> given(static_cast<std::size_t>(n) + 1, parameters);
  for (Eigen::Index i = 0; i < n; ++i) given[static_cast<std::size_t>(i)] = i;
  const Eigen::MatrixXd held = inverse_of(with_mean(given, given)), all = inverse_of(with_mean);
  out.dispersion = dispersion_of(units, held.topLeftCorner(n, n));
  out.covariance = out.dispersion * held.topLeftCorner(n, n);
  out.all = out.dispersion * all.topLeftCorner(parameters, parameters);
  out.bias_mean_sd_mm_s = std::sqrt(out.dispersion * all(parameters, parameters));
  // The mean of the biases where the columns are known: it follows them, and has a variance of its own.
  const Eigen::RowVectorXd mean_by_column =
      -with_mean.row(parameters).head(parameters) / with_mean(parameters, parameters);
  const double mean_variance = 1 / with_mean(parameters, parameters);
  const std::map<std::uint32_t, BiasSums> robots = bias_sums_of(units);
  for (const auto& [robot, sums] : robots) {
    const Eigen::Matrix2d alone = sums.precision.inverse();
    const Eigen::Vector2d by_mean = alone * Eigen::Vector2d::Constant(sums.units * bias_precision);
    const Eigen::Matrix2d own = alone + by_mean * mean_variance * by_mean.transpose();
    const Eigen::MatrixXd by = by_mean * mean_by_column - alone * sums.by_column;
    out.biases[robot] = own + by * out.all * by.transpose();
    out.given[robot] = {own, by.leftCols(n)};
  }
  out.bias_sd_sd_mm_s = sd_of_bias_sd(robots, model.base.bias_sd_mm_s);
  return out;
}

}  // namespace kilotwin::identify
