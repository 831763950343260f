/// Data association: assigns measurements to tracks at the least total cost, within gates.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

namespace kilotwin::track {

/// A track and a measurement that may belong together.
struct Pair {
  std::size_t track = 0, measurement = 0;
  double cost = 0;  ///< at most the cost of leaving both alone
};

struct Assignment {
  /// Per track: the measurement.
  std::vector<std::optional<std::size_t>> of_track;
  /// Per track: another assignment of nearly the same cost gives it another measurement.
  std::vector<bool> ambiguous;
};

/// `alone`: the cost of a track without measurement. `margin`: costs that differ by less are nearly the same. Pairs may come in
/// any order; the result does not depend on it. Groups of tracks that share no measurement are solved apart, each by the
/// Hungarian method.
[[nodiscard]] Assignment assign(std::size_t tracks, std::size_t measurements, const std::vector<Pair>& pairs,
                                double alone, double margin);

}  // namespace kilotwin::track
