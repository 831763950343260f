#include "clients/identify/predict/run_amplitude.hpp"

#include <algorithm>
#include <cmath>

namespace kilotwin::identify {
namespace {

/// Values that a term has by run, and the runs that it knows. Empty: the term does not concern runs alone, or runs and time.
struct RunValues {
  std::vector<double> runs, values;
};

/// A term with one column per run has one value per run. With curves over time for each run: the values along the curves.
RunValues values_of(const Term& term) {
  constexpr int kAlong = 20;  // values along a curve; more follow sharper changes
  RunValues out;
  if (term.blocks.size() != 1 || is_measured(term.blocks.front().target)) return out;
  const Block& block = term.blocks.front();
  const std::vector<Factor>& factors = block.basis.factors;
  if (factors.empty() || factors.size() > 2) return out;
  const Factor& which = factors.front();
  if (which.axis.of != Covariate::kRun || which.shape != Factor::Shape::kTable) return out;
  const bool over_time = factors.size() == 2;
  if (over_time && (factors[1].axis.of != Covariate::kTime || factors[1].shape != Factor::Shape::kCosines))
    return out;
  std::vector<double> columns(block.basis.size());
  for (const double run : which.points) {
    for (int i = 0; i < (over_time ? kAlong : 1); ++i) {
      Situation s;
      s.run = static_cast<std::uint32_t>(run);
      if (over_time) s.time_s = factors[1].low + (i + 0.5) / kAlong * (factors[1].high - factors[1].low);
      block.basis.evaluate(s, 0, columns.data());
      out.values.push_back(
          term.coefficients.dot(Eigen::Map<const Eigen::VectorXd>(columns.data(), term.coefficients.size())));
    }
  }
  out.runs = which.points;
  return out;
}

}  // namespace

RunAmplitude::RunAmplitude(const MotionModel& model, std::uint32_t run) {
  for (std::size_t t = 0; t < model.terms.size(); ++t) {
    const Term& term = model.terms[t];
    const RunValues known = values_of(term);
    if (known.runs.empty() || std::find(known.runs.begin(), known.runs.end(), run) != known.runs.end()) continue;
    const auto count = static_cast<double>(known.runs.size()), all = static_cast<double>(known.values.size());
    const Eigen::Map<const Eigen::ArrayXd> values(known.values.data(),
                                                  static_cast<Eigen::Index>(known.values.size()));
    const double mean = values.mean();
    // Few runs: a Student distribution with their mean and spread.
    const double degrees = std::max(count - 1, 1.0);
    const double square = (values - mean).square().sum() / degrees * count / all;
    const double sd = std::sqrt(square * (1 + 1 / count));
    if (!(sd > 0)) continue;
    // Amplitudes on each side of the mean; each costs a model that forecasts, fewer make steps coarser.
    constexpr int kSide = 6;
    constexpr double kFarthest = 4;  // standard deviations
    for (int i = -kSide; i <= kSide; ++i) {
      const double u = kFarthest * i / kSide;
      log_prior_.push_back(-0.5 * (degrees + 1) * std::log1p(u * u / degrees));
      Term& own = models_.emplace_back(model).terms[t];
      Basis& basis = own.blocks.front().basis;
      basis.chosen.clear();
      basis.factors.resize(1);
      basis.factors.front().points = {static_cast<double>(run)};
      own.coefficients = Eigen::VectorXd::Constant(1, mean + sd * u);
      own.precision = Eigen::VectorXd::Constant(1, 1 / (sd * sd));
    }
    return;
  }
  models_.push_back(model);
  log_prior_.push_back(0);
}

template <class Take>
void RunAmplitude::for_each_fine(const std::vector<double>& log_likelihood, const Take& take) const {
  std::vector<double> value = log_likelihood;
  for (std::size_t i = 0; i < value.size(); ++i) value[i] += log_prior_[i];
  const auto bend_at = [&](std::size_t i) {
    const std::size_t middle = std::clamp<std::size_t>(i, 1, value.size() - 2);
    return (value[middle - 1] - 2 * value[middle] + value[middle + 1]) / 2;
  };
  // Much data make the posterior narrower than the raster: interpolates the log likelihood quadratically.
  constexpr int kFine = 40;
  for (std::size_t i = 0; i + 1 < value.size(); ++i) {
    const double bend = (bend_at(i) + bend_at(i + 1)) / 2;
    for (int k = 0; k < kFine; ++k) {
      const double u = (k + 0.5) / kFine;
      take(static_cast<double>(i) + u, value[i] + u * (value[i + 1] - value[i]) - bend * u * (1 - u));
    }
  }
}

RunAmplitude::Between RunAmplitude::mean(const std::vector<double>& log_likelihood) const {
  if (models_.size() < 3) return {};
  double best = -std::numeric_limits<double>::infinity(), sum = 0, mean = 0;
  for_each_fine(log_likelihood, [&](double, double value) { best = std::max(best, value); });
  for_each_fine(log_likelihood, [&](double at, double value) {
    const double weight = std::exp(value - best);
    sum += weight;
    mean += weight * at;
  });
  mean /= sum;
  const auto low = std::min(static_cast<std::size_t>(mean), models_.size() - 2);
  return {low, low + 1, mean - static_cast<double>(low)};
}

double RunAmplitude::log_evidence(const std::vector<double>& log_likelihood) const {
  if (models_.size() < 3) return 0;
  double best = -std::numeric_limits<double>::infinity(), sum = 0;
  for_each_fine(log_likelihood, [&](double, double value) { best = std::max(best, value); });
  for_each_fine(log_likelihood, [&](double, double value) { sum += std::exp(value - best); });
  return best + std::log(sum);
}

RunAmplitude::Between DriftingAmplitude::mean(double time_s, const std::vector<double>& log_likelihood) {
  const std::size_t count = log_likelihood.size();
  if (last_.empty()) last_.assign(count, 0);
  std::size_t best = 0;
  for (std::size_t f = 0; f < kFade_s.size(); ++f) {
    std::vector<double>& faded = faded_[f];
    faded.resize(count, 0);
    const double keep = std::exp(-(time_s - last_s_) / kFade_s[f]);
    for (double& value : faded) value *= keep;
    const double before = amplitude_.log_evidence(faded);
    // Without fading: the log likelihood itself, free of rounding.
    for (std::size_t i = 0; i < count; ++i)
      faded[i] = f == 0 ? log_likelihood[i] : faded[i] + log_likelihood[i] - last_[i];
    log_predictive_[f] += amplitude_.log_evidence(faded) - before;
    // A drift must predict better by a Bayes factor of 20, as terms of the search.
    constexpr double kBetter_nat = 3;
    if (log_predictive_[f] > log_predictive_[best] + (best == 0 ? kBetter_nat : 0)) best = f;
  }
  last_ = log_likelihood;
  last_s_ = time_s;
  return amplitude_.mean(faded_[best]);
}

}  // namespace kilotwin::identify
