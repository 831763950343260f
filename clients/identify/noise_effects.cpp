#include "clients/identify/noise_effects.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <tuple>
#include <utility>

#include "clients/identify/model/effect_records.hpp"
#include "clients/identify/noise_forms.hpp"
#include "clients/identify/result/values.hpp"
#include "core/stats/distributions.hpp"

namespace kilotwin::identify {
namespace {

/// Of a candidate of one form. Four candidates at 0.003 together, and a margin for innovations that are not normal. Candidates of
/// several forms pay for the choice.
constexpr double kThreshold_log10_p = -5;
/// Least cross-validated gain, nat and in standard errors.
constexpr double kLeastGain = 10, kLeastErrors = 3;
/// Least ratio of the largest to the smallest standard deviation.
constexpr double kLeastRatio = 1.3;
/// Prior standard deviation of a coefficient of the log variance.
constexpr double kPrior_sd = 1;
constexpr std::size_t kFewestSamples = 400;

using Samples = std::vector<NoiseSample>;

/// Log variances by the effects accepted so far and by one candidate.
class VarianceFit {
 public:
  /// `given`: log scale of each sample by the accepted effects.
  VarianceFit(const Samples& samples, const Eigen::VectorXd& given) : samples_(samples), given_(given) {
    Eigen::VectorXd slope(given.size());
    information_.resize(given.size());
    for (Eigen::Index i = 0; i < given.size(); ++i) {
      const NoiseSample::Score s = samples_[static_cast<std::size_t>(i)].score(std::exp(given[i]));
      slope[i] = s.slope;
      information_[i] = s.information;
    }
    // The common scale is a nuisance parameter: what the fit of the noise left of it goes.
    level_ = slope.sum() / information_.sum();
    slope_ = slope - level_ * information_;
    overdispersion_ = overdispersion();
  }

  /// log10 of the p value of Rao's score test, with the overdispersion of stretches.
  [[nodiscard]] double log10_p(const Eigen::MatrixXd& columns, std::uint32_t& degrees) const {
    const Eigen::RowVectorXd mean = information_.transpose() * columns / information_.sum();
    const Eigen::MatrixXd centred = columns.rowwise() - mean;
    const Eigen::VectorXd u = centred.transpose() * slope_;
    const Eigen::MatrixXd info = centred.transpose() * information_.asDiagonal() * centred;
    // Each candidate's columns span a constant, which the nuisance parameter has taken.
    Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> solver(info);
    solver.setThreshold(1e-9);
    degrees = static_cast<std::uint32_t>(solver.rank());
    if (degrees == 0) return 0;
    return stats::log10_chi_squared_tail(u.dot(solver.solve(u)) / overdispersion_, degrees);
  }

  /// The posterior mode of the coefficients from the samples that `use` picks.
  template <class Use> [[nodiscard]] Eigen::VectorXd coefficients(const Eigen::MatrixXd& columns, Use&& use) const {
    Eigen::VectorXd beta = Eigen::VectorXd::Zero(columns.cols());
    constexpr int kSteps = 8;  // bound of Newton's method, which ends earlier once its moves are small
    // Largest change of a coefficient of the log variance per step; a larger one may overshoot.
    constexpr double kLongest = 1;
    for (int step = 0; step < kSteps; ++step) {
      Eigen::VectorXd score = -beta / (kPrior_sd * kPrior_sd);
      Eigen::MatrixXd info = Eigen::MatrixXd::Identity(beta.size(), beta.size()) / (kPrior_sd * kPrior_sd);
      for (Eigen::Index i = 0; i < columns.rows(); ++i) {
        if (!use(static_cast<std::size_t>(i))) continue;
        const auto row = columns.row(i);
        const NoiseSample::Score s =
            samples_[static_cast<std::size_t>(i)].score(std::exp(given_[i] + level_ + row.dot(beta)));
        score += s.slope / overdispersion_ * row.transpose();
        info.noalias() += s.information / overdispersion_ * row.transpose() * row;
      }
      Eigen::VectorXd move = info.ldlt().solve(score);
      if (const double longest = move.cwiseAbs().maxCoeff(); longest > kLongest) move *= kLongest / longest;
      beta += move;
      if (move.cwiseAbs().maxCoeff() < 1e-3) break;
    }
    return beta;
  }

  /// The posterior covariance of the coefficients, by the curvature at these.
  [[nodiscard]] Eigen::MatrixXd covariance(const Eigen::MatrixXd& columns, const Eigen::VectorXd& beta) const {
    Eigen::MatrixXd info = Eigen::MatrixXd::Identity(beta.size(), beta.size()) / (kPrior_sd * kPrior_sd);
    for (Eigen::Index i = 0; i < columns.rows(); ++i) {
      const auto row = columns.row(i);
      const double scale = std::exp(given_[i] + level_ + row.dot(beta));
      info.noalias() +=
          samples_[static_cast<std::size_t>(i)].score(scale).information / overdispersion_ * row.transpose() * row;
    }
    return info.ldlt().solve(Eigen::MatrixXd::Identity(beta.size(), beta.size()));
  }

  /// The log scale that the samples share, given the accepted effects.
  [[nodiscard]] double level() const { return level_; }

  /// By which the coefficients raise the log likelihood of one sample, over the overdispersion.
  [[nodiscard]] double gain(const Eigen::MatrixXd& columns, const Eigen::VectorXd& beta, std::size_t sample) const {
    const auto i = static_cast<Eigen::Index>(sample);
    const double before = given_[i] + level_;
    return (samples_[sample].log_likelihood(std::exp(before + columns.row(i).dot(beta))) -
            samples_[sample].log_likelihood(std::exp(before))) /
           overdispersion_;
  }

 private:
  /// Variance of the scores of stretches over what the information expects; 1 or more.
  [[nodiscard]] double overdispersion() const {
    std::map<std::pair<std::size_t, std::size_t>, double> stretches;
    for (std::size_t i = 0; i < samples_.size(); ++i)
      stretches[{samples_[i].track, stretch_of(samples_[i])}] += slope_[static_cast<Eigen::Index>(i)];
    double squares = 0;
    for (const auto& [where, sum] : stretches) squares += sum * sum;
    return std::max(1.0, squares / information_.sum());
  }

  const Samples& samples_;
  const Eigen::VectorXd& given_;
  Eigen::VectorXd slope_, information_;
  double level_ = 0, overdispersion_ = 1;
};

/// The cross-validated gain and its standard error over stretches.
std::pair<double, double> cross_validated(const VarianceFit& fit, const NoiseForm& candidate,
                                          const Samples& samples) {
  std::map<std::pair<std::size_t, std::size_t>, double> stretches;
  double sum = 0;
  for (std::size_t fold = 0; fold < NoiseForm::kFolds; ++fold) {
    const Eigen::VectorXd beta =
        fit.coefficients(candidate.columns, [&](std::size_t i) { return candidate.folds[i] != fold; });
    for (std::size_t i = 0; i < samples.size(); ++i) {
      if (candidate.folds[i] != fold) continue;
      const double gain = fit.gain(candidate.columns, beta, i);
      stretches[{samples[i].track, stretch_of(samples[i])}] += gain;
      sum += gain;
    }
  }
  const auto count = static_cast<double>(stretches.size());
  double squares = 0;
  for (const auto& [where, gain] : stretches) squares += (gain - sum / count) * (gain - sum / count);
  return {sum, std::sqrt(squares * count / std::max(count - 1, 1.0))};
}

/// The candidate as an effect, if it passes.
std::optional<NoiseEffect> accepted(const VarianceFit& fit, const NoiseForm& candidate, double threshold_log10_p,
                                    const Samples& samples, Eigen::VectorXd& log_scale) {
  NoiseEffect out;
  out.name = candidate.name;
  out.covariates = candidate.covariates;
  out.depends_on = candidate.in_words;
  out.threshold_log10_p = threshold_log10_p;
  out.log10_p = fit.log10_p(candidate.columns, out.degrees);
  if (!(out.log10_p < threshold_log10_p)) return std::nullopt;
  std::tie(out.held_out, out.held_out_se) = cross_validated(fit, candidate, samples);
  if (!(out.held_out > kLeastGain && out.held_out > kLeastErrors * out.held_out_se)) return std::nullopt;
  const Eigen::VectorXd beta = fit.coefficients(candidate.columns, [](std::size_t) { return true; });
  log_scale = (candidate.columns * beta).array() + fit.level();
  out.least = std::exp(0.5 * log_scale.minCoeff());
  out.most = std::exp(0.5 * log_scale.maxCoeff());
  if (!(out.most > kLeastRatio * out.least)) return std::nullopt;
  for (std::size_t i = 0; i < samples.size(); ++i) out.gain += fit.gain(candidate.columns, beta, i);
  out.scale = candidate.scale(beta, fit.level());
  out.band = noise_band_of([&](const Eigen::VectorXd& of) { return candidate.scale(of, fit.level()); }, beta,
                           fit.covariance(candidate.columns, beta));
  return out;
}

/// Whether a record is white noise on the motion, not on a measurement.
bool is_process_noise(const proto::Effect& effect) {
  return effect.acts_on() < proto::Effect::MEASURED_OFFSET &&
         std::any_of(effect.function().begin(), effect.function().end(),
                     [](const proto::Function& f) { return f.has_noise(); });
}

/// Appends the scales to the record of a noise.
void scale_record(proto::Effect& effect, const std::vector<NoiseEffect>& effects) {
  for (const NoiseEffect& one : effects) *effect.add_function() = one.scale;
}

}  // namespace

std::vector<NoiseEffect> find_noise_effects(const std::vector<NoiseSample>& all) {
  Samples samples;
  for (const NoiseSample& sample : all)
    if (!sample.held_out && sample.process.trace() > 0) samples.push_back(sample);
  std::vector<NoiseEffect> found;
  if (samples.size() < kFewestSamples) return found;
  std::vector<NoiseForm> candidates = noise_forms(samples);
  std::map<std::string, double> threshold_log10_p;
  for (const NoiseForm& form : candidates) threshold_log10_p[form.name] += 1;
  for (auto& [name, forms] : threshold_log10_p) forms = kThreshold_log10_p - std::log10(forms);
  Eigen::VectorXd given = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(samples.size()));
  while (!candidates.empty()) {
    const VarianceFit fit(samples, given);
    std::optional<NoiseEffect> best;
    Eigen::VectorXd best_scale, scale;
    for (std::size_t c = 0; c < candidates.size(); ++c) {
      std::optional<NoiseEffect> one =
          accepted(fit, candidates[c], threshold_log10_p[candidates[c].name], samples, scale);
      if (!one || (best && one->held_out <= best->held_out)) continue;
      best = std::move(one);
      best_scale = scale;
    }
    if (!best) break;
    given += best_scale;
    std::erase_if(candidates, [&](const NoiseForm& form) { return form.name == best->name; });
    found.push_back(std::move(*best));
  }
  return found;
}

void write_noise_effects(proto::Model& model, const Noise& fitted, const std::vector<NoiseEffect>& effects) {
  if (effects.empty()) return;
  // The factor of a wheel's speed has no covariates of its own. As a gain without correlation it acts in the same way.
  model.mutable_motion()->set_factor_variance_s(0);
  proto::Effect& factor = *model.add_effect();
  factor.set_name("factor-noise");
  factor.set_acts_on(proto::Effect::WHEEL_GAIN);
  factor.add_function()->mutable_noise()->set_sd(rounded(std::sqrt(fitted.factor_s)));
  for (proto::Effect& effect : *model.mutable_effect())
    if (is_process_noise(effect)) scale_record(effect, effects);
}

identification::Effect entry_of(const NoiseEffect& found) {
  identification::Effect out;
  out.set_name(found.name);
  assign(out.mutable_covariates(), found.covariates);
  out.set_acts_on("NOISE");
  identification::Evidence& evidence = *out.mutable_evidence();
  evidence.set_log10_p(found.log10_p);
  evidence.set_threshold_log10_p(found.threshold_log10_p);
  evidence.set_log_likelihood_gain(found.gain);
  *evidence.mutable_held_out_gain() = json_value(found.held_out);
  *evidence.mutable_held_out_gain_se() = json_value(found.held_out_se);
  evidence.set_degrees(found.degrees);
  auto& parameters = *out.mutable_parameters()->mutable_fields();
  parameters["form"] = json_value("scale of the noise");
  *parameters["bands_95"].mutable_list_value()->add_values() = found.band;
  parameters["records"] = json_value(json_list(std::vector{found.scale.ShortDebugString()}));
  *out.mutable_rmse_without_mm() = json_null();
  *out.mutable_share_removed() = json_null();
  out.set_in_words(fmt::format(
      "the size of the motion noise depends on {}: its standard deviation is {:.2f} to {:.2f} times the common one",
      found.depends_on, found.least, found.most));
  return out;
}

}  // namespace kilotwin::identify
