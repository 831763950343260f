/// The traffic grids that a model uses, updated during a forecast.
#pragma once

#include <vector>

#include "clients/identify/model/motion_model.hpp"
#include "clients/identify/model/traffic_grid.hpp"

namespace kilotwin::identify {

class Floors {
 public:
  explicit Floors(const MotionModel& model) {
    for (std::uint8_t c = 0; c < kFloorCells; ++c)
      if (model.looks_at({Covariate::kTrodden, c})) floors_.push_back({c, FloorMemory(model.cells[c])});
  }
  [[nodiscard]] bool any() const { return !floors_.empty(); }
  /// Adds the time of a driven robot at a place, s.
  void add(double x_mm, double y_mm, double seconds) {
    for (Floor& floor : floors_) floor.memory.add(x_mm, y_mm, seconds);
  }
  /// Sets the driven time of the cells at a place.
  void see(double x_mm, double y_mm, NeighbourView& view) const {
    for (const Floor& floor : floors_) view.trodden_s[floor.cells] = floor.memory.value_s(x_mm, y_mm);
  }

 private:
  struct Floor {
    std::uint8_t cells;
    FloorMemory memory;
  };
  std::vector<Floor> floors_;
};

}  // namespace kilotwin::identify
