/// Amplitudes of runs (fresh batteries, another floor). The amplitude of a run outside the fit is inferred from
/// its own past.
#pragma once

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

 private:
  std::vector<MotionModel> models_;
  std::vector<double> log_prior_;
};

}  // namespace kilotwin::identify
