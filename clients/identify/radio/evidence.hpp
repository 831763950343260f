/// Residual diagnostics: evidence for the next effect of the radio model.
#pragma once

#include <string>
#include <vector>

#include "clients/identify/radio/link_fit.hpp"

namespace kilotwin::radio_fit {

struct Evidence {
  std::string what;      ///< description
  double explained = 0;  ///< share of the residuals' variance, or a correlation
  double by_chance = 0;  ///< mean of the same for residuals permuted over links or runs
  double by_chance_sd = 0;
};

/// Residuals: measured share of runs in which a link was on, minus the model's expectation; links of 85..200 mm.
[[nodiscard]] Evidence bearing_evidence(const std::vector<GridSet>& sets, const LinkModel&);
[[nodiscard]] Evidence body_evidence(const std::vector<GridSet>& sets, const LinkModel&);
[[nodiscard]] Evidence robot_evidence(const std::vector<GridSet>& sets, const LinkModel&);
[[nodiscard]] Evidence robot_bearing_evidence(const std::vector<GridSet>& sets, const LinkModel&);
[[nodiscard]] Evidence pair_evidence(const std::vector<GridSet>& sets, const LinkModel&);
/// Loss up to 105 mm: dependence of a sender's loss at a receiver on the number of hidden robots, those that the
/// receiver hears and the sender does not.
[[nodiscard]] Evidence hidden_terminal_evidence(const std::vector<GridSet>& sets);
/// Loss up to 105 mm per hidden robot of this run: robots hidden in all runs, minus robots hidden in this run
/// only.
[[nodiscard]] Evidence hidden_sender_evidence(const std::vector<GridSet>& sets);
/// Whether the same robots send less in every set: correlation of their means between two sets or two halves.
[[nodiscard]] Evidence oscillator_evidence(const std::vector<GridSet>& sets);
/// Whether the dependence on the bearing differs between placements.
[[nodiscard]] Evidence placement_evidence(const std::vector<GridSet>& sets, const LinkModel&);
/// Correlation over robots between parameters fitted to two sets.
[[nodiscard]] double same_robots(const LinkModel&, bool senders);

}  // namespace kilotwin::radio_fit
