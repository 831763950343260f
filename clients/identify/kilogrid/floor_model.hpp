/// Parametric models of motion on the floor: a base model, and one term per possible effect. Terms are written as
/// effect records of the model file, so the engine supports all of them.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "clients/identify/kilogrid/floor_swarm.hpp"
#include "idl/model.pb.h"

namespace kilotwin::kilogrid {

struct FloorParameter {
  std::string name;
  double start;        ///< initial value
  double least, most;  ///< range
  double width;        ///< scale of one step of the fit
};

/// All inputs of a simulated run.
struct FloorSettings {
  proto::Model model;
  WalkTimes times;
  FloorRadio radio;
};

struct FloorTerm {
  std::string name;
  std::vector<std::string> covariates;  ///< names of result.json
  std::string acts_on;                  ///< as in the model file
  std::string about;                    ///< description with fmt placeholders {0} {1} {2} for the parameters
  std::string experiment;               ///< an experiment that separates it from similar effects; empty: none known
  std::vector<FloorParameter> parameters;
  /// The first parameters are amplitudes: at 0 the term has no effect. The others are shape parameters.
  std::size_t switches = 1;
  std::function<void(std::span<const double>, FloorSettings&)> apply;
};

/// The base model of the ARGoS paper and the reception of cells. Always included.
[[nodiscard]] FloorTerm base_term();
/// Candidate effects: one per covariate and shape that these data can resolve.
[[nodiscard]] std::vector<FloorTerm> candidate_terms(const Floor&);

/// The terms in use with their parameter values.
struct FloorModel {
  std::vector<FloorTerm> terms;  ///< the first is the base
  std::vector<double> values;
  /// Speed beside the walls relative to the open floor, per boundary section, within kBeside_mm. Effect "wall",
  /// one record per wall. Fitted by its own procedure, like the polling order of modules.
  static constexpr double kBeside_mm = 50;
  std::optional<std::array<double, kBoundarySections>> wall;
  std::array<double, 4> later = FloorRadio().later;

  void add(const FloorTerm& term);
  /// Index of a term's first parameter.
  [[nodiscard]] std::size_t first_of(std::size_t term) const;
  [[nodiscard]] std::vector<FloorParameter> parameters() const;
  [[nodiscard]] FloorSettings settings() const { return settings(values); }
  [[nodiscard]] FloorSettings settings(std::span<const double> values) const;
  /// The model without one term.
  [[nodiscard]] FloorModel without(std::size_t term) const;
};

}  // namespace kilotwin::kilogrid
