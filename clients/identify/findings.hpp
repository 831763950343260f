/// What an identification from trajectories found, before it is written.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "clients/identify/fit/numbering.hpp"
#include "clients/identify/fit/uncertainty.hpp"
#include "clients/identify/predict/evaluation.hpp"
#include "clients/identify/predict/held_out_gain.hpp"
#include "clients/identify/search/search.hpp"
#include "clients/identify/unexplained/unexplained.hpp"

namespace kilotwin::identify {

/// The model without one term, refitted, on held-out data.
struct TermCheck {
  FitState without;
  double rmse_without_mm;
  HeldOutGain gain;  ///< of the model with the term over the one without
};

/// A model on the path of the search, on held-out data.
struct CheckedModel {
  std::vector<std::string> effects;
  double rmse_mm;
};

/// The last check, on data that took no part in choosing (final_check.hpp).
struct FinalCheck {
  std::vector<CheckedModel> path;    ///< base model first; empty if nothing is held out
  std::size_t kept = 0;              ///< index of the model that is written
  std::vector<std::string> dropped;  ///< effects of the last model of the path that are not written
};

struct Findings {
  FitState base;
  Search found;  ///< `fit` is the model that is written
  HeldOut held_out;
  Judged before, after;               ///< the base model and the written one, on held-out data
  std::optional<ErrorBounds> bounds;  ///< of their errors
  /// The same errors of robots that stayed away from walls and from each other over the horizon.
  PredictionErrors free_before, free_after;
  double expected_mm = 0;  ///< error that the written model expects of itself
  std::optional<Replicates> replicates;
  std::vector<TermCheck> terms;  ///< by term; empty if nothing is held out
  FinalCheck check;
  Unexplained unexplained;
  Numbering numbering;      ///< of the robots, by the base model
  Uncertainty uncertainty;  ///< of the written model
  std::string model_file;   ///< where the model will stand
};

}  // namespace kilotwin::identify
