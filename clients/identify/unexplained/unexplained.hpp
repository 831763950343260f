/// The unexplained part of a model's error: its error on held-out data, compared with
///   - what the model expects of itself (forecast.hpp);
///   - what differs between repetitions of the same commands (prediction_errors.hpp);
///   - what a flexible learner over all covariates together predicts (random_forest.hpp).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "clients/identify/predict/prediction_errors.hpp"
#include "clients/identify/unexplained/error_patterns.hpp"
#include "clients/identify/unexplained/learner_check.hpp"

namespace kilotwin::identify {

/// The errors of held-out forecasts, with what the model expects of them.
struct HeldOutErrors {
  PredictionErrors errors;
  std::optional<ErrorBounds> bounds;  ///< nothing: they are one track
};

struct Unexplained {
  double error_mm = 0;     ///< of the model on held-out data; 0: nothing is held out
  double expected_mm = 0;  ///< by the model itself
  /// The same of the forecasts from known starts, if there are others (forecast.hpp).
  std::optional<double> known_starts_mm, known_starts_expected_mm;
  std::optional<double> repetitions_mm;  ///< differs between repetitions
  std::optional<LearnerCheck> learner;   ///< nothing: too few windows
  /// The largest systematic part by these comparisons, beyond their uncertainty; 0: none.
  double systematic_mm = 0;
  double share = 0;               ///< of the mean square error
  std::vector<Pattern> patterns;  ///< what it looks like; empty unless something large is left, perhaps
  std::string in_words;

  /// Beyond its uncertainty.
  [[nodiscard]] bool large() const { return systematic_mm > 0; }
  /// The error exceeds the model's expectation or the difference of repetitions, but too few data are held out to be sure.
  bool perhaps = false;
};

/// `known` and `held_out`: windows of the fit and of held-out data (may be empty), from known starts; `all` and `known_starts`: errors
/// of the model on held-out data, the latter if some starts are unknown. `set`: that `held_out` refers to, or `known` if nothing is held
/// out.
[[nodiscard]] Unexplained find_unexplained(const MeasuredSet& set, const std::vector<Window>& known,
                                           const std::vector<Window>& held_out, const HeldOutErrors& all,
                                           const std::optional<HeldOutErrors>& known_starts,
                                           const std::optional<Replicates>& replicates, std::uint32_t threads,
                                           const Stretches& = {});

/// Whether a model leaves a systematic error of the data of its own fit: `known` are its windows, `errors` its errors there, and
/// `replicates` of the same forecasts.
[[nodiscard]] bool leaves_systematic_error(const MeasuredSet&, const std::vector<Window>& known,
                                           const PredictionErrors& errors,
                                           const std::optional<Replicates>& replicates, std::uint32_t threads);

}  // namespace kilotwin::identify
