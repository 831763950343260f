/// The arena below the robots: walls, obstacles, virtual environments, lamps, movable bodies.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "clients/recorder/overview.hpp"
#include "clients/recorder/view.hpp"
#include "core/plan/world.hpp"

namespace kilotwin::recorder {

/// A circle of a virtual environment: food, home, a hub.
struct VirtualCircle {
  double x_mm, y_mm, radius_mm;
  std::string_view name, fill, stroke;
};

/// The experiment's name, as a title.
[[nodiscard]] std::string title_of(const RunOverview& run);
/// Robots, seed, simulated time and arena in one line.
[[nodiscard]] std::string facts_of(const RunOverview& run, const World& world);

/// Draws a run's arena into views of it. The run must outlive it.
class Ground {
 public:
  explicit Ground(const RunOverview& run);

  [[nodiscard]] const World& world() const { return world_; }
  /// The whole arena with a narrow margin.
  [[nodiscard]] Box arena() const;
  /// All that the run shows: the robots' paths, movable bodies, circles of virtual environments.
  [[nodiscard]] Box content() const;
  /// Walls, circles of virtual environments, and what these have painted.
  [[nodiscard]] std::string draw_floor(const View& view, const Floors& floors) const;
  [[nodiscard]] std::string draw_obstacles(const View& view) const;
  /// A movable body at a place.
  [[nodiscard]] std::string draw_movable(std::size_t body, const View& view, const Place& place) const;
  /// Movable bodies with their poses in this state.
  [[nodiscard]] std::string draw_movables(const View& view, const Snapshot& at) const;
  /// The lamps at a given time as suns; hollow if they are off.
  [[nodiscard]] std::string draw_lamps(const View& view, double time_s) const;

 private:
  const RunOverview& run_;
  World world_;
  std::vector<VirtualCircle> circles_;
};

}  // namespace kilotwin::recorder
