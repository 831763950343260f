/// What runs have of their own (fresh batteries, another floor): of a run that was not fitted to its own past tells how much of it.
#pragma once

#include <vector>

#include "clients/identify/model/motion_model.hpp"

namespace kilotwin::identify {

class RunAmount {
 public:
  /// Of a run by its number. Where the model has nothing that runs differ in, or the run was fitted to, one model: its own.
  RunAmount(const MotionModel&, std::uint32_t run);

  /// The model with each of a raster of amounts.
  [[nodiscard]] const std::vector<MotionModel>& models() const { return models_; }

  /// Between which two models it lies, and how far from the first to the second.
  struct Between {
    std::size_t low = 0, high = 0;
    double part = 0;
  };
  /// Its mean, by the log likelihood of all that was measured so far under each of the models.
  [[nodiscard]] Between mean(const std::vector<double>& log_likelihood) const;

 private:
  std::vector<MotionModel> models_;
  std::vector<double> log_prior_;
};

}  // namespace kilotwin::identify
