/// Whether robots keep their numbers from run to run.
#pragma once

#include "clients/identify/fit/fitter.hpp"

namespace kilotwin::identify {

struct Numbering {
  /// Spread of the biases of single tracks, as a variance over that of their errors; 0: too few tracks to tell.
  double spread = 0;
  /// p value of a permutation test: under so many random numberings the biases of each number agree at least as well
  /// over the runs. 0: too few tracks to tell.
  double chance = 0;
  /// The robots differ, but numbers tell no more than random ones.
  [[nodiscard]] bool anew() const {
    // Spread from which on robots differ, and p value from which on their numbers tell nothing. Smaller values report new
    // numbers where there are none.
    constexpr double kDiffer = 5, kNoBetter = 0.05;
    return spread > kDiffer && chance > kNoBetter;
  }
};

/// At least five robots in each of two runs, and a fitted base model. Biases are compared less their means of the run.
[[nodiscard]] Numbering numbering_of(const Fitter&, const FitState& base);

}  // namespace kilotwin::identify
