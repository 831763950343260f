/// Identification from trajectories: estimates why robots deviate from the base model, and extends the model by
/// effects. A pure function from measured sets to a model and a result.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "clients/identify/data/measured_set.hpp"
#include "clients/identify/predict/prediction.hpp"
#include "core/stats/time_left.hpp"
#include "idl/identification.pb.h"
#include "idl/model.pb.h"

namespace kilotwin::identify {

struct Options {
  double horizon_s = 10;
  std::uint32_t threads = 2;
  bool find_effects = true;  ///< false: the base model only
  std::uint32_t draws = 0;   ///< models from the posterior; their values may lie outside the ranges of a model file
  /// Where the caller will write the model: for the text of the result.
  std::string model_file = "model.txtpb";
  stats::WorkReport progress;  ///< may be empty
};

struct Identified {
  proto::Model model;  ///< input of `kilotwin run --model`
  identification::Identification found;
  std::vector<Prediction> predictions;
  std::vector<proto::Model> draws;
  /// Models that the data do not tell from `model`, by the name of the effect that differs.
  std::vector<std::pair<std::string, proto::Model>> candidates;
};

/// Fits the tracks of `train` that are not held out. Predicts `test`; null: the held-out tracks of `train`.
[[nodiscard]] Identified identify(const MeasuredSet& train, const MeasuredSet* test, const Options&);

}  // namespace kilotwin::identify
