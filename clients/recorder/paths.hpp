/// Paths of all robots, in memory that does not grow with the number of states.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "clients/recorder/evenly_spaced.hpp"
#include "clients/recorder/reader.hpp"

namespace kilotwin::recorder {

/// State of all robots at one time.
struct Snapshot {
  double time_s = 0;
  std::vector<double> x_mm, y_mm, heading_rad;
  std::vector<std::uint8_t> led, life_cycle;
  std::vector<double> movable_x_mm, movable_y_mm, movable_heading_rad;
};

/// The state of a record.
void take(Snapshot& snapshot, const proto::StateRecord& state, TickLength length);

struct Point {
  float x_mm, y_mm;
};

/// The first state, the last one, and evenly spaced states in between.
class Paths {
 public:
  /// Keeps about `points` positions at most over all robots, but at least 8 per robot.
  Paths(std::size_t robots, std::size_t points);
  void add(const proto::StateRecord& state, TickLength length);

  [[nodiscard]] bool empty() const { return states_ == 0; }
  [[nodiscard]] std::uint64_t states() const { return states_; }
  [[nodiscard]] std::size_t robots() const { return first_.x_mm.size(); }
  [[nodiscard]] const Snapshot& first() const { return first_; }
  [[nodiscard]] const Snapshot& last() const { return last_; }
  /// A robot's path from its first to its last position.
  [[nodiscard]] std::vector<Point> path(std::size_t robot) const;

 private:
  std::uint64_t states_ = 0;
  Snapshot first_, last_;
  EvenlySpaced<std::vector<Point>> kept_;  // per kept state, all robots
};

/// The path with fewer points; every omitted point lies within `tolerance_mm` of it (Douglas and Peucker 1973).
[[nodiscard]] std::vector<Point> simplified(std::span<const Point> path, double tolerance_mm);

}  // namespace kilotwin::recorder
