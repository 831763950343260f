/// Forward selection of effects on the floor with backward elimination: each effect must be significant given the
/// others.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "clients/identify/kilogrid/floor_selection.hpp"
#include "clients/identify/kilogrid/floor_work.hpp"

namespace kilotwin::kilogrid {

inline constexpr const char* kWallEffect = "wall";

/// Misfit reduction of an effect at its last test, and its significance bound.
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
  std::vector<EffectGain> gains;  ///< of the model's terms except the base, then of the walls if present
  std::vector<RejectedEffect> rejected;
};

/// Called after each addition with the term's name and the model.
using FloorNote = std::function<void(const std::string& added, const FloorModel&)>;

/// Starts from a fitted base model.
[[nodiscard]] FloorFound search_effects(const FloorModel& base, const FloorTarget&,
                                        const std::vector<FloorTerm>& candidates, const stats::WorkReport& progress,
                                        const FloorNote& note);

}  // namespace kilotwin::kilogrid
