/// Evaluation of models on tracks that took no part in their fit.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "clients/identify/predict/forecast.hpp"
#include "clients/identify/predict/prediction_errors.hpp"

namespace kilotwin::identify {

/// The data that took no part in the fit. kNoTime: there are such data, but none was measured near any predicted time.
enum class HeldOut : std::uint8_t { kTestSet, kRuns, kRobots, kNothing, kNoTime };
/// Whether held-out data give an error.
[[nodiscard]] constexpr bool gives_errors(HeldOut h) { return h != HeldOut::kNothing && h != HeldOut::kNoTime; }
/// "test set", "runs", "robots", "nothing", "no predicted time".
[[nodiscard]] const char* name_of(HeldOut);
/// One or two sentences: what the errors refer to or, if nothing is held out, which further data would give them.
[[nodiscard]] std::string in_words(HeldOut);

/// Holds out about a quarter: the last runs if there are three or more, else some robots, else the last run. One run of
/// up to three robots is fitted whole. Every other held-out robot (or run, or track) chooses among the models of the search,
/// the others give the reported error. A single held-out track does not choose.
void hold_out_part(MeasuredSet&);
/// Beside a test set: holds out one track in five, which chooses. Robots that take part in two runs or more keep tracks in the fit.
/// Less than five tracks are fitted whole.
void hold_out_for_choice(MeasuredSet&);

/// The held-out tracks as one model sees them, and its forecasts of them.
struct Judged {
  PreparedSet tracks;
  std::vector<Forecast> forecasts;  ///< empty if nothing is held out
  PredictionErrors errors;
};

class Evaluation {
 public:
  /// On all tracks of `test` or, without it, on those tracks `of` the training set. Both sets must outlive the evaluation.
  Evaluation(const MeasuredSet& train, const MeasuredSet* test, Tracks of, std::uint32_t threads);

  [[nodiscard]] HeldOut held_out() const { return held_out_; }
  /// The set with the held-out tracks.
  [[nodiscard]] const MeasuredSet& set() const { return test_ != nullptr ? *test_ : train_; }
  /// The tracks of the set that count.
  [[nodiscard]] Tracks of() const { return of_; }
  /// The tracks of the set as this model sees them: disc centres and initial headings are its own.
  [[nodiscard]] PreparedSet tracks_of(const FitState&) const;
  /// Forecasts of the held-out tracks.
  [[nodiscard]] Judged judge(const FitState&, const ForecastTimes&) const;

 private:
  const MeasuredSet& train_;
  const MeasuredSet* test_;
  std::optional<PreparedSet> test_tracks_;  ///< as measured
  Tracks of_;
  std::uint32_t threads_;
  HeldOut held_out_;
};

}  // namespace kilotwin::identify
