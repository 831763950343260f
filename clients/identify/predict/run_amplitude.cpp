#include "clients/identify/predict/run_amplitude.hpp"

#include <algorithm>
#include <cmath>

namespace kilotwin::identify {
namespace {

/// The table of run amplitudes if the term is one column per run, else null.
const Factor* runs_of(const Term& term) {
  if (term.blocks.size() != 1 || is_measured(term.blocks.front().target)) return nullptr;
  const Basis& basis = term.blocks.front().basis;
  if (basis.factors.size() != 1) return nullptr;
  const Factor& factor = basis.factors.front();
  return factor.axis.of == Covariate::kRun && factor.shape == Factor::Shape::kTable ? &factor : nullptr;
}

}  // namespace

RunAmplitude::RunAmplitude(const MotionModel& model, std::uint32_t run) {
  for (std::size_t t = 0; t < model.terms.size(); ++t) {
    const Term& term = model.terms[t];
    const Factor* const known = runs_of(term);
    if (known == nullptr || std::find(known->points.begin(), known->points.end(), run) != known->points.end())
      continue;
    const auto count = static_cast<double>(term.coefficients.size());
    const double mean = term.coefficients.mean();
    // Few runs: a Student distribution with their mean and spread.
    const double degrees = std::max(count - 1, 1.0);
    const double square = (term.coefficients.array() - mean).square().sum() / degrees;
    const double sd = std::sqrt(square * (1 + 1 / count));
    if (!(sd > 0)) continue;
    constexpr int kSide = 6;
    constexpr double kFarthest = 4;  // standard deviations
    for (int i = -kSide; i <= kSide; ++i) {
      const double u = kFarthest * i / kSide;
      log_prior_.push_back(-0.5 * (degrees + 1) * std::log1p(u * u / degrees));
      Term& own = models_.emplace_back(model).terms[t];
      Basis& basis = own.blocks.front().basis;
      basis.chosen.clear();
      basis.factors.front().points = {static_cast<double>(run)};
      own.coefficients = Eigen::VectorXd::Constant(1, mean + sd * u);
      own.precision = Eigen::VectorXd::Constant(1, 1 / (sd * sd));
    }
    return;
  }
  models_.push_back(model);
  log_prior_.push_back(0);
}

RunAmplitude::Between RunAmplitude::mean(const std::vector<double>& log_likelihood) const {
  if (models_.size() < 3) return {};
  std::vector<double> value = log_likelihood;
  for (std::size_t i = 0; i < value.size(); ++i) value[i] += log_prior_[i];
  const double best = *std::max_element(value.begin(), value.end());
  const auto bend_at = [&](std::size_t i) {
    const std::size_t middle = std::clamp<std::size_t>(i, 1, value.size() - 2);
    return (value[middle - 1] - 2 * value[middle] + value[middle + 1]) / 2;
  };
  // Much data make the posterior narrower than the raster: interpolates the log likelihood quadratically.
  constexpr int kFine = 40;
  double sum = 0, mean = 0;
  for (std::size_t i = 0; i + 1 < value.size(); ++i) {
    const double bend = (bend_at(i) + bend_at(i + 1)) / 2;
    for (int k = 0; k < kFine; ++k) {
      const double u = (k + 0.5) / kFine;
      const double at = value[i] + u * (value[i + 1] - value[i]) - bend * u * (1 - u);
      const double weight = std::exp(std::min(at - best, 300.0));
      sum += weight;
      mean += weight * (static_cast<double>(i) + u);
    }
  }
  mean /= sum;
  const auto low = std::min(static_cast<std::size_t>(mean), value.size() - 2);
  return {low, low + 1, mean - static_cast<double>(low)};
}

}  // namespace kilotwin::identify
