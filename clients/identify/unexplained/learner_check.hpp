/// The part of a model's errors that a random forest over all covariates predicts.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "clients/identify/predict/prediction_errors.hpp"
#include "clients/identify/unexplained/prediction_windows.hpp"

namespace kilotwin::identify {

/// The learner: trained on windows of the fit, judged on held-out windows. Without those it is cross-validated by track.
struct LearnerCheck {
  double error_mm = 0;        ///< of the model, on the same windows
  double error_left_mm = 0;   ///< after the learner's prediction is subtracted
  Interval less_by_mm{0, 0};  ///< 95 % interval of the difference
  bool cross_validated = false;
  double error_low_mm = 0;  ///< lower end of the 95 % interval of `error_mm`
  /// Root mean square of what the learner predicts; 0 if that is within chance.
  [[nodiscard]] double predicted_mm() const;
};

/// The units that a bootstrap draws for held-out robots that have tracks in the fit, too: stretches of a run, with all robots.
struct Stretches {
  double length_s = 20;     ///< at least twice the horizon, because windows overlap
  bool same_robots = true;  ///< whether a robot number means the same robot in all runs
};

/// The interval of the reduction concerns these robots if each held-out robot has tracks in the fit, too, and there are
/// enough stretches: a bootstrap over stretches. Else it concerns other robots: a bootstrap over robots and runs. Nothing:
/// too few windows.
[[nodiscard]] std::optional<LearnerCheck> learner_check(const MeasuredSet&, const std::vector<Window>& known,
                                                        const std::vector<Window>& held_out, std::uint32_t threads,
                                                        const Stretches& = {});

/// Windows of the tracks with this remainder, or of all others.
[[nodiscard]] std::vector<Window> part_of(const std::vector<Window>& all, std::size_t folds, std::size_t fold,
                                          bool inside);

}  // namespace kilotwin::identify
