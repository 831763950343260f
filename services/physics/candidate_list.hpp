/// Who may come near whom: for each body the others within the cutoff and a skin, ascending. A list stays good until a body
/// has moved by half of the skin, so it is rebuilt every ten ticks or so. It holds more than the cutoff asks for; readers
/// look at distances themselves, so that no result depends on when it was built.
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

  /// Makes the list good for these bodies.
  void update(const Bodies&);

  [[nodiscard]] std::span<const std::uint32_t> of(std::uint32_t body) const {
    return {others_.data() + first_[body], others_.data() + first_[body + 1]};
  }

 private:
  [[nodiscard]] bool is_good(const Bodies&) const;

  CellList cells_;
  std::vector<std::uint32_t> robot_;  ///< when it was built
  std::vector<double> x_mm_, y_mm_;   ///< when it was built
  std::vector<std::uint32_t> first_;  ///< per body: where its candidates begin; one more entry at the end
  std::vector<std::uint32_t> others_, found_;
};

}  // namespace kilotwin::physics
