/// Amplitudes of runs (fresh batteries, another floor). The amplitude of a run outside the fit is inferred from
/// its own past.
#pragma once

#include <Eigen/Core>
#include <optional>
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
  /// The model at a place on the raster, from 0 to models().size() - 1; between two of them the amplitude is interpolated.
  [[nodiscard]] MotionModel model_at(double place) const;
  /// Whether the amplitude of each run in the fit has a course over time.
  [[nodiscard]] bool over_time() const { return over_time_; }

  /// The raster has this number of models on each side of the mean; the outermost are so many standard deviations from it.
  static constexpr int kSide = 6;
  static constexpr double kFarthest_sd = 4;

 private:
  /// Calls take(position on the raster, log of prior times likelihood) at fine steps along the raster.
  template <class Take> void for_each_fine(const std::vector<double>& log_likelihood, const Take& take) const;

  std::vector<MotionModel> models_;
  std::vector<double> log_prior_;
  std::size_t term_ = 0;  ///< that has the amplitudes
  bool over_time_ = false;
};

/// Follows the amplitude of a run over time. It is constant, or wanders, or rises and falls with a slope that wanders (a local linear
/// trend, Harvey 1989, section 2.3.2). The one under which the run's own past was predicted best tells the amplitude.
class DriftingAmplitude {
 public:
  explicit DriftingAmplitude(const RunAmplitude& amplitude);

  /// The amplitude at an instant, as far as it is known. Places are those on the raster.
  struct Known {
    RunAmplitude::Between constant;    ///< its mean if it is constant
    double passed = 0;                 ///< its mean between the last instant and this one
    std::optional<double> ahead = {};  ///< if it drifts: its mean over the time ahead
  };
  /// At time_s, given the log likelihood of the run up to then under each model; `ahead_s`: the time ahead. In order of time.
  Known at(double time_s, double ahead_s, const std::vector<double>& log_likelihood);

 private:
  /// Where the data since the last time have their largest likelihood, and its variance; in steps of the raster.
  struct Peak {
    double at, variance;
  };
  /// Nothing if the data tell nothing.
  static std::optional<Peak> peak_of(const std::vector<double>& log_likelihood);
  /// A Kalman filter of level and slope, in steps of the raster and s.
  struct Course {
    double level_per_root_s = 0, slope_per_root_s = 0;  ///< standard deviations of the walks of both over 1 s
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
    double log_predictive = 0;  ///< of all peaks, each given those before

    void advance(double for_s);
    void update(const Peak&);
  };

  const RunAmplitude& amplitude_;
  double last_s_ = 0;
  std::vector<double> last_;     ///< log likelihood at the previous time
  std::vector<Course> courses_;  ///< the first: constant
};

}  // namespace kilotwin::identify
