/// The validations, one function each: it runs what it needs and adds its rows.
#pragma once

#include "tests/validation/runs.hpp"
#include "tests/validation/verdicts.hpp"

namespace kilotwin::validation {

/// How much is run: `quick` in seconds, for every change; else in a minute or two, with small standard errors.
struct Effort {
  bool quick = false;
  std::filesystem::path plots;  ///< folder for pictures of the figures; empty: none
};

/// The estimator of the ARGoS paper returns the wheel biases that robots were given.
void validate_bias(Runs&, Verdicts&, Effort);
/// The mean square displacement of robots that drive straight on: closed form and ARGoS.
void validate_straight(Runs&, Verdicts&, Effort);
/// The mean square displacement of a dense crowd that walks at random: ARGoS, with and without contact.
void validate_diffusion(Runs&, Verdicts&, Effort);
/// How many robots it takes to push a box.
void validate_box(Runs&, Verdicts&, Effort);
/// How far discs overlap where a packed crowd presses inwards.
void validate_packing(Runs&, Verdicts&, Effort);

}  // namespace kilotwin::validation
