/// One identification, stage by stage: the interface of all kinds of measured data. Tracks, Kilogrid runs, bristle plate tracks and
/// radio counts implement it; what reads the data makes the study.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "clients/identify/data/data_faults.hpp"
#include "clients/identify/identify.hpp"

namespace kilotwin::identify {

class Study {
 public:
  virtual ~Study() = default;
  Study() = default;
  Study(const Study&) = delete;
  Study& operator=(const Study&) = delete;

  /// Fits the base model.
  virtual void fit() = 0;
  /// Looks for effects that the base model lacks. Without this stage the base model is the result.
  virtual void search() = 0;
  /// Chooses among the models of the search, and predicts data that took no part.
  virtual void judge() = 0;
  /// The result; the last stage.
  [[nodiscard]] virtual Identified report() = 0;
};

/// All stages in their order. Throws UserError if the data cannot be used.
[[nodiscard]] inline Identified identified_by(Study& study, const Options& options) {
  study.fit();
  if (options.find_effects) study.search();
  study.judge();
  return study.report();
}

/// The study of measured tracks: identify() as stages. `test` empty: the held-out tracks of `train` give the errors. `faults`: found
/// before the fit, for the result. Throws UserError if no track can be fitted.
[[nodiscard]] std::unique_ptr<Study> track_study(MeasuredSet train, std::optional<MeasuredSet> test,
                                                 std::vector<DataFault> faults, const Options&);

}  // namespace kilotwin::identify
