/// Models of how robots move on the floor, as numbers that can be fitted: the base model, and one term per effect that may
/// be added to it. What a term says is a record of the model file, so the engine needs to know of none of them.
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
  double start;        ///< where the search begins
  double least, most;  ///< it stays within
  double width;        ///< of one step of the search
};

/// All that a run of the swarm is made from.
struct FloorSettings {
  proto::Model model;
  WalkTimes times;
  FloorRadio radio;
};

struct FloorTerm {
  std::string name;
  std::vector<std::string> covariates;  ///< of the contract
  std::string acts_on;                  ///< as in the model file
  std::string about;                    ///< in words, with places {0} {1} {2} for its parameters, as of fmt
  std::string experiment;               ///< that would tell it from what looks alike; empty: nothing does
  std::vector<FloorParameter> parameters;
  /// The parameters that switch it: at 0 the term does nothing. The others are shapes.
  std::size_t switches = 1;
  std::function<void(std::span<const double>, FloorSettings&)> apply;
};

/// The base model of the seed, and what cells hear: always there.
[[nodiscard]] FloorTerm base_term();
/// Effects that may be added, one per covariate and shape that the floor can tell.
[[nodiscard]] std::vector<FloorTerm> candidate_terms(const Floor&);

/// The terms in use, with a value for every parameter.
struct FloorModel {
  std::vector<FloorTerm> terms;  ///< the first is the base
  std::vector<double> values;
  /// Speed beside the wall, within kBeside_mm of it, times what it is in the open: by part of the rim. Effect "wall", in as
  /// many records as there are walls. Found by a rule of its own, as is the order in which modules listen to their cells.
  static constexpr double kBeside_mm = 50;
  std::optional<std::array<double, kRimParts>> wall;
  std::array<double, 4> later = FloorRadio().later;

  void add(const FloorTerm& term);
  /// Index of the first parameter of a term.
  [[nodiscard]] std::size_t first_of(std::size_t term) const;
  [[nodiscard]] std::vector<FloorParameter> parameters() const;
  [[nodiscard]] FloorSettings settings() const { return settings(values); }
  [[nodiscard]] FloorSettings settings(std::span<const double> values) const;
  /// Without one of its terms.
  [[nodiscard]] FloorModel without(std::size_t term) const;
};

}  // namespace kilotwin::kilogrid
