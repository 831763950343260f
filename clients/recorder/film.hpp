/// Evenly spaced states of a whole run, for an animation.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "clients/recorder/evenly_spaced.hpp"
#include "clients/recorder/paths.hpp"
#include "clients/recorder/reader.hpp"

namespace kilotwin::recorder {

class Film {
 public:
  /// Swarms above this size have no film: browsers draw an element per robot too slowly.
  static constexpr std::size_t kMostRobots = 1000;

  explicit Film(std::size_t robots);
  void add(const proto::StateRecord& state, TickLength length);

  /// The first state and 30 to 240 more, fewer for large swarms. Empty for swarms above kMostRobots.
  [[nodiscard]] const std::vector<Snapshot>& frames() const { return frames_.values(); }

 private:
  bool small_;
  EvenlySpaced<Snapshot> frames_;
};

}  // namespace kilotwin::recorder
