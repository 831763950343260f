/// The traffic grids that a model uses, updated during a forecast.
#pragma once

#include <vector>

#include "clients/identify/model/motion_model.hpp"
#include "clients/identify/model/traffic_grid.hpp"

namespace kilotwin::identify {

class TrafficGrids {
 public:
  explicit TrafficGrids(const MotionModel& model) {
    for (std::uint8_t c = 0; c < kTrafficGrids; ++c)
      if (model.looks_at({Covariate::kTraffic, c})) grids_.push_back({c, TrafficGrid(model.cells[c])});
  }
  [[nodiscard]] bool any() const { return !grids_.empty(); }
  /// Adds the time of a driven robot at a place, s. `robot`: place of its track in the run.
  void add(std::size_t robot, double x_mm, double y_mm, double seconds, double now_s) {
    for (Grid& grid : grids_) grid.traffic.add(robot, x_mm, y_mm, seconds, now_s);
  }
  /// Sets what a robot reads of the cells at a place.
  void see(std::size_t robot, double x_mm, double y_mm, double now_s, NeighbourView& view) const {
    for (const Grid& grid : grids_) view.traffic[grid.cells] = grid.traffic.value(robot, x_mm, y_mm, now_s);
  }

 private:
  struct Grid {
    std::uint8_t cells;
    TrafficGrid traffic;
  };
  std::vector<Grid> grids_;
};

}  // namespace kilotwin::identify
