/// What in the residuals of a model points to the next effect.
#pragma once

#include <string>
#include <vector>

#include "clients/identify/radio/link_fit.hpp"

namespace kilotwin::radio_fit {

struct Evidence {
  std::string what;      ///< in words
  double explained = 0;  ///< share of the residuals' variance, or a correlation
  double by_chance = 0;  ///< the same with the residuals shuffled over the links (or runs), mean
  double by_chance_sd = 0;
};

/// Residuals: measured share of runs in which a link was on, less what the model expects; links of 85..200 mm.
[[nodiscard]] Evidence bearing_evidence(const std::vector<GridSet>& sets, const LinkModel&);
[[nodiscard]] Evidence body_evidence(const std::vector<GridSet>& sets, const LinkModel&);
[[nodiscard]] Evidence robot_evidence(const std::vector<GridSet>& sets, const LinkModel&);
[[nodiscard]] Evidence robot_bearing_evidence(const std::vector<GridSet>& sets, const LinkModel&);
[[nodiscard]] Evidence pair_evidence(const std::vector<GridSet>& sets, const LinkModel&);
/// Of what is lost up to 105 mm: does a sender's loss at a receiver follow the number of robots that the receiver hears and
/// the sender does not?
[[nodiscard]] Evidence hidden_terminal_evidence(const std::vector<GridSet>& sets);
/// Of what is lost up to 105 mm: what a robot costs that the receiver hears and the sender does not, in this run; those that
/// neither hears the other of in any run, less those that do in another one.
[[nodiscard]] Evidence notice_evidence(const std::vector<GridSet>& sets);
/// Do robots that send less than others do so in every set? Correlation of their means, of two sets or of two halves.
[[nodiscard]] Evidence oscillator_evidence(const std::vector<GridSet>& sets);
/// Does each set have its own dependence on the bearing?
[[nodiscard]] Evidence laying_evidence(const std::vector<GridSet>& sets, const LinkModel&);
/// Correlation over the robots of what was fitted to one set with what was fitted to the other.
[[nodiscard]] double same_robots(const LinkModel&, bool senders);

}  // namespace kilotwin::radio_fit
