/// Pairs of effects that much data does not tell apart, and recordings with a planted truth.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "clients/identify/design/design.hpp"

namespace kilotwin::identify::design_scenes {

struct Pair {
  std::string name;
  Term first, other;
};

/// The pairs that are measured.
[[nodiscard]] std::vector<Pair> pairs();

/// Robots with one effect of a pair. Their noise is known, and the distribution of their biases.
struct Scene {
  Pair pair;
  std::vector<proto::Model> truths;  ///< with the first effect, and with the other one
  DesignQuestion question;
  RecordingConditions conditions;
  DesignOptions options;
};
[[nodiscard]] Scene scene_of(const Pair&, std::uint32_t robots, double duration_s);

struct Decision {
  double after_s = 0;  ///< the end of the plan if none was made
  bool made = false, right = false;
};
/// Records a plan under a truth, 0 or 1, and decides as soon as one effect is more likely than the other by 3 nat, a Bayes factor of 20.
/// Both likelihoods are those of `kilotwin identify`: each model is fitted to the tracks so far, which share nothing with the plan's
/// own information. `seed`: of all noise.
[[nodiscard]] Decision decide(const Scene&, const RecordingPlan&, std::size_t truth, std::uint64_t seed);

}  // namespace kilotwin::identify::design_scenes
