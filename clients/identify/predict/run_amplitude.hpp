/// Amplitudes of runs (fresh batteries, another floor). The amplitude of a run outside the fit is inferred from
/// its own past.
#pragma once

#include <array>
#include <limits>
#include <vector>

#include "clients/identify/model/motion_model.hpp"

namespace kilotwin::identify {

class RunAmplitude {
 public:
  /// By run number. If the model has no run amplitudes, or the fit included the run: its one model.
  RunAmplitude(const MotionModel&, std::uint32_t run);

  /// The model at each amplitude of a raster.
  [[nodiscard]] const std::vector<MotionModel>& models() const { return models_; }

  /// Interpolation between two models of the raster.
  struct Between {
    std::size_t low = 0, high = 0;
    double part = 0;
  };
  /// The posterior mean amplitude, given the log likelihood of the run's past under each model.
  [[nodiscard]] Between mean(const std::vector<double>& log_likelihood) const;
  /// Logarithm of the likelihood integrated over the prior, up to a constant.
  [[nodiscard]] double log_evidence(const std::vector<double>& log_likelihood) const;

 private:
  /// Calls take(position on the raster, log of prior times likelihood) at fine steps along the raster.
  template <class Take> void for_each_fine(const std::vector<double>& log_likelihood, const Take& take) const;

  std::vector<MotionModel> models_;
  std::vector<double> log_prior_;
};

/// Follows the amplitude of a run over time. The amplitude may drift: the log likelihood of the past can fade. The time constant
/// is the one under which the run's own past was predicted best.
class DriftingAmplitude {
 public:
  explicit DriftingAmplitude(const RunAmplitude& amplitude) : amplitude_(amplitude) {}

  /// The mean amplitude at time_s, given the log likelihood of the run up to then under each model. In order of time.
  [[nodiscard]] RunAmplitude::Between mean(double time_s, const std::vector<double>& log_likelihood);

 private:
  /// Time constants, s. A minute holds about ten commands.
  static constexpr std::array kFade_s = {std::numeric_limits<double>::infinity(), 120.0, 40.0};

  const RunAmplitude& amplitude_;
  double last_s_ = 0;
  std::vector<double> last_;                               ///< log likelihood at the previous time
  std::array<std::vector<double>, kFade_s.size()> faded_;  ///< by time constant: of the past, faded
  std::array<double, kFade_s.size()> log_predictive_{};  ///< by time constant: of all increments, given their past
};

}  // namespace kilotwin::identify
