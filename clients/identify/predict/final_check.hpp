/// The choice among the models of a search, by held-out tracks that took no part in the fit or in the search.
#pragma once

#include <cstddef>
#include <vector>

namespace kilotwin::identify {

/// Relative difference of errors that counts as none.
inline constexpr double kSameError = 1e-3;

/// A model on the path of a search.
struct Candidate {
  std::size_t size;  ///< number of its terms that act on the motion
  double rmse_mm;    ///< on the tracks that choose
};

/// The index of the smallest model whose error is within 0.1 % of the smallest error, of several the last one. Effects of the
/// measurement hardly change predictions, so they do not count as size. An error that is no number is never chosen; without
/// any number it is the first model, the base model.
[[nodiscard]] std::size_t smallest_of_the_best(const std::vector<Candidate>&);

}  // namespace kilotwin::identify
