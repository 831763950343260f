/// Bootstrap and permutation. The caller brings the random numbers.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

namespace kilotwin::stats {

/// Bootstrap weights: how often each of `count` items occurs in `count` draws with replacement. draw(i): the item of draw i,
/// uniform in 0 .. count - 1.
template <class Draw> [[nodiscard]] std::vector<double> bootstrap_weights(std::size_t count, Draw&& draw) {
  std::vector<double> times(count, 0);
  for (std::size_t i = 0; i < count; ++i) ++times[draw(i)];
  return times;
}

/// Permutes n items by Fisher and Yates. below(n): uniform in 0 .. n - 1. swap(i, j): exchanges two items.
template <class Below, class Swap> void permute(std::size_t n, Below&& below, Swap&& swap) {
  for (; n > 1; --n) swap(n - 1, below(n));
}

/// p value of a permutation test: the share of the permutations at least as extreme as the data, which count as one
/// of them (Phipson and Smyth 2010).
[[nodiscard]] constexpr double permutation_p(std::size_t as_extreme, std::size_t permutations) {
  return (1.0 + static_cast<double>(as_extreme)) / (1.0 + static_cast<double>(permutations));
}

}  // namespace kilotwin::stats
