/// The result of an identification from trajectories, before it is written.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "clients/identify/fit/geometry_intervals.hpp"
#include "clients/identify/fit/noise_fit.hpp"
#include "clients/identify/fit/noise_samples.hpp"
#include "clients/identify/fit/numbering.hpp"
#include "clients/identify/fit/step_intervals.hpp"
#include "clients/identify/fit/uncertainty.hpp"
#include "clients/identify/noise_effects.hpp"
#include "clients/identify/predict/evaluation.hpp"
#include "clients/identify/predict/held_out_gain.hpp"
#include "clients/identify/search/search.hpp"
#include "clients/identify/stall_effect.hpp"
#include "clients/identify/unexplained/unexplained.hpp"

namespace kilotwin::identify {

/// A model on the path of the search, on held-out data.
struct CheckedModel {
  std::vector<std::string> effects;
  double rmse_mm;
};

/// The last check (last_check.hpp).
struct FinalCheck {
  std::vector<CheckedModel> path;    ///< base model first; empty if nothing is held out
  std::size_t kept = 0;              ///< index of the model from which terms were then taken out
  std::vector<HeldOutGain> gains;    ///< by term of the model that is written, on the tracks that choose
  bool chose_on_reported = false;    ///< no held-out track was left to choose alone
  std::vector<std::string> dropped;  ///< effects of the last model of the path that are not written
};

struct Findings {
  Findings(FitState base_model, Search searched)
      : base(std::move(base_model)), found(std::move(searched)), before{base.tracks, {}, {}}, after(before) {}

  FitState base;
  Search found;  ///< `fit` is the model that is written
  HeldOut held_out = HeldOut::kNothing;
  Judged before, after;               ///< the base model and the written one, on held-out data
  std::optional<ErrorBounds> bounds;  ///< of their errors
  /// The same errors of robots that stayed away from walls and from each other over the horizon.
  PredictionErrors free_before, free_after;
  Noise white;             ///< of the written model, without what persists from sample to sample
  double expected_mm = 0;  ///< error that the written model expects of itself with this noise
  std::optional<Replicates> replicates;
  std::vector<double> rmse_without_mm;  ///< by term, on held-out data; empty if nothing is held out
  FinalCheck check;
  Unexplained unexplained;
  Numbering numbering;              ///< of the robots, by the base model
  Uncertainty uncertainty;          ///< of the written model
  std::vector<StepInterval> steps;  ///< of its effects
  GeometryIntervals geometry;       ///< of its walls and of its disc centre
  NoiseInterval noise;              ///< of its noise
  /// Ends of the 95 % interval of its lag, if it has one.
  std::optional<std::pair<double, double>> command_lag_s;
  std::map<std::uint32_t, NoiseRatio> noise_ratios;  ///< by robot
  std::vector<NoiseEffect> noise_effects;
  std::optional<StallEffect> stalls;
  std::string model_file;  ///< where the model will stand
};

}  // namespace kilotwin::identify
