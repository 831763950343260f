/// Neighbour lists (Verlet lists): for each body, the other bodies within the cutoff plus a skin, ascending. A list is valid
/// until a body has moved by half the skin, usually for about ten ticks. It holds more pairs than the cutoff requires.
/// Readers compare distances themselves, so no result depends on when a list was built.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/spatial/cell_list.hpp"
#include "services/physics/bodies.hpp"

namespace kilotwin::physics {

class CandidateList {
 public:
  explicit CandidateList(double cutoff_mm);

  /// Rebuilds the lists unless they are valid for these bodies.
  void update(const Bodies&);

  [[nodiscard]] std::span<const std::uint32_t> of(std::uint32_t body) const {
    return {others_.data() + first_[body], others_.data() + first_[body + 1]};
  }

 private:
  [[nodiscard]] bool is_good(const Bodies&) const;

  CellList cells_;
  std::vector<std::uint32_t> robot_;  ///< at the last rebuild
  std::vector<double> x_mm_, y_mm_;   ///< at the last rebuild
  std::vector<std::uint32_t> first_;  ///< per body: index of its first candidate in others_; then the total
  std::vector<std::uint32_t> others_, found_;
};

}  // namespace kilotwin::physics
