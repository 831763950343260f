#include "clients/identify/predict/run_amplitude.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

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
    term_ = t;
    over_time_ = known.values.size() > known.runs.size();
    // Each amplitude costs a model that forecasts, fewer make steps coarser.
    for (int i = -kSide; i <= kSide; ++i) {
      const double u = kFarthest_sd * i / kSide;
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

MotionModel RunAmplitude::model_at(double place) const {
  const std::size_t low = std::min(static_cast<std::size_t>(place), models_.size() - 2);
  const double part = place - static_cast<double>(low);
  MotionModel out = models_[low];
  out.terms[term_].coefficients +=
      part * (models_[low + 1].terms[term_].coefficients - out.terms[term_].coefficients);
  return out;
}

DriftingAmplitude::DriftingAmplitude(const RunAmplitude& amplitude) : amplitude_(amplitude) {
  // Standard deviations of amplitudes per root of a second; the first is a constant. Walks of the level reach one in 1000 s or 100 s.
  // Walks of the slope turn a rise into a fall in some 200, 100 or 50 s.
  struct Walk {
    double level, slope;
  };
  constexpr std::array<Walk, 6> kWalks = {{{0, 0}, {0.03, 0}, {0.1, 0}, {0, 0.001}, {0, 0.003}, {0, 0.01}}};
  constexpr double kStepsPerSd = RunAmplitude::kSide / RunAmplitude::kFarthest_sd;
  constexpr double kSlopeSince_s = 100;  // a slope at the start has wandered for so long
  for (const Walk& walk : kWalks) {
    Course& course = courses_.emplace_back();
    course.level_per_root_s = kStepsPerSd * walk.level;
    course.slope_per_root_s = kStepsPerSd * walk.slope;
    course.mean[0] = RunAmplitude::kSide;
    course.covariance(0, 0) = kStepsPerSd * kStepsPerSd;
    course.covariance(1, 1) = course.slope_per_root_s * course.slope_per_root_s * kSlopeSince_s;
  }
}

void DriftingAmplitude::Course::advance(double for_s) {
  Eigen::Matrix2d by;
  by << 1, for_s, 0, 1;
  mean = (by * mean).eval();
  covariance = (by * covariance * by.transpose()).eval();
  const double level = level_per_root_s * level_per_root_s * for_s,
               slope = slope_per_root_s * slope_per_root_s * for_s;
  covariance(0, 0) += level + slope * for_s * for_s / 3;
  covariance(0, 1) += slope * for_s / 2;
  covariance(1, 0) += slope * for_s / 2;
  covariance(1, 1) += slope;
}

void DriftingAmplitude::Course::update(const Peak& peak) {
  const double off = peak.at - mean[0], variance = covariance(0, 0) + peak.variance;
  log_predictive -= (off * off / variance + std::log(variance)) / 2;
  const Eigen::Vector2d by_level = covariance.col(0) / variance;
  mean += by_level * off;
  covariance -= by_level * by_level.transpose() * variance;
}

std::optional<DriftingAmplitude::Peak> DriftingAmplitude::peak_of(const std::vector<double>& log_likelihood) {
  const auto best = std::max_element(log_likelihood.begin(), log_likelihood.end()) - log_likelihood.begin();
  const auto middle = static_cast<std::size_t>(
      std::clamp<std::ptrdiff_t>(best, 1, static_cast<std::ptrdiff_t>(log_likelihood.size()) - 2));
  const double low = log_likelihood[middle - 1], high = log_likelihood[middle + 1],
               bend = low - 2 * log_likelihood[middle] + high;
  if (bend >= 0) return std::nullopt;
  // Far from its peak the likelihood of robust noise is steeper than a parabola near it and flatter beyond.
  constexpr double kOfParabola = 0.1;  // its error, in steps of the raster
  return Peak{static_cast<double>(middle) + std::clamp((low - high) / (2 * bend), -1.0, 1.0),
              kOfParabola * kOfParabola - 1 / bend};
}

DriftingAmplitude::Known DriftingAmplitude::at(double time_s, double ahead_s,
                                               const std::vector<double>& log_likelihood) {
  const std::size_t count = log_likelihood.size();
  if (count < 3) return {};
  if (last_.empty()) last_.assign(count, 0);
  for (std::size_t i = 0; i < count; ++i) last_[i] = log_likelihood[i] - last_[i];
  const std::optional<Peak> since = peak_of(last_);
  last_ = log_likelihood;
  const double since_s = time_s - last_s_;
  last_s_ = time_s;
  for (Course& course : courses_) {
    course.advance(since_s);
    if (since) course.update(*since);
  }
  Known out{amplitude_.mean(log_likelihood)};
  out.passed = static_cast<double>(out.constant.low) + out.constant.part;
  const auto drift = std::max_element(courses_.begin() + 1, courses_.end(), [](const Course& a, const Course& b) {
    return a.log_predictive < b.log_predictive;
  });
  // A drift that no run in the fit has must predict better by a Bayes factor of 20, as terms of the search.
  constexpr double kBetter_nat = 3;
  if (drift->log_predictive <= courses_.front().log_predictive + (amplitude_.over_time() ? 0 : kBetter_nat))
    return out;
  const auto place = [&](double in_s) {
    return std::clamp(drift->mean[0] + in_s * drift->mean[1], 0.0, static_cast<double>(count - 1));
  };
  out.passed = place(-since_s / 2);
  out.ahead = place(ahead_s / 2);
  return out;
}

}  // namespace kilotwin::identify
