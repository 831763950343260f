/// The search for what a model of the floor lacks: one effect after the other, each beyond chance beside those before it, and
/// each asked once more when the others are there.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "clients/identify/kilogrid/floor_selection.hpp"

namespace kilotwin::kilogrid {

inline constexpr const char* kWallEffect = "wall";

/// What an effect removed of the misfit when it was asked for last, and what would have been beyond chance.
struct EffectGain {
  std::string name;
  double gain = 0, needed = 0;
};

struct RejectedEffect {
  EffectGain gain;
  std::vector<std::string> covariates;
  std::string acts_on, why;
};

struct FloorFound {
  FloorModel model;
  std::vector<EffectGain> gains;  ///< of the model's terms but the base, then of the walls if it has them
  std::vector<RejectedEffect> rejected;
};

/// Called with what was added, and the model with it.
using FloorNote = std::function<void(const std::string& added, const FloorModel&)>;

/// From a base model that is fitted. `progress`: with the part of the search that is done.
[[nodiscard]] FloorFound search_effects(const FloorModel& base, const FloorTarget&,
                                        const std::vector<FloorTerm>& candidates,
                                        const std::function<void(double part, const std::string&)>& progress,
                                        const FloorNote& note);

}  // namespace kilotwin::kilogrid
