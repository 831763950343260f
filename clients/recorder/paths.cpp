#include "clients/recorder/paths.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace kilotwin::recorder {
namespace {

double distance_from_segment_mm(Point p, Point a, Point b) {
  const double ux = b.x_mm - a.x_mm, uy = b.y_mm - a.y_mm, vx = p.x_mm - a.x_mm, vy = p.y_mm - a.y_mm;
  const double square = ux * ux + uy * uy;
  const double along = square > 0 ? std::clamp((ux * vx + uy * vy) / square, 0.0, 1.0) : 0;
  return std::hypot(vx - along * ux, vy - along * uy);
}

}  // namespace

void take(Snapshot& snapshot, const proto::StateRecord& state, TickLength length) {
  snapshot.time_s = length.seconds_at(Tick{state.tick()});
  snapshot.x_mm.assign(state.x_mm().begin(), state.x_mm().end());
  snapshot.y_mm.assign(state.y_mm().begin(), state.y_mm().end());
  snapshot.heading_rad.assign(state.heading_rad().begin(), state.heading_rad().end());
  snapshot.led.assign(state.led().begin(), state.led().end());
  snapshot.life_cycle.assign(state.life_cycle().begin(), state.life_cycle().end());
  snapshot.movable_x_mm.assign(state.movable_x_mm().begin(), state.movable_x_mm().end());
  snapshot.movable_y_mm.assign(state.movable_y_mm().begin(), state.movable_y_mm().end());
  snapshot.movable_heading_rad.assign(state.movable_heading_rad().begin(), state.movable_heading_rad().end());
}

Paths::Paths(std::size_t robots, std::size_t points) : kept_(std::max<std::size_t>(8, points / robots)) {}

void Paths::add(const proto::StateRecord& state, TickLength length) {
  if (states_++ == 0) take(first_, state, length);
  take(last_, state, length);
  if (!kept_.wants_next()) return;
  std::vector<Point> places;
  places.reserve(static_cast<std::size_t>(state.x_mm_size()));
  for (int i = 0; i < state.x_mm_size(); ++i)
    places.push_back({static_cast<float>(state.x_mm(i)), static_cast<float>(state.y_mm(i))});
  kept_.keep(std::move(places));
}

std::vector<Point> Paths::path(std::size_t robot) const {
  std::vector<Point> path;
  path.reserve(kept_.values().size() + 1);
  for (const std::vector<Point>& places : kept_.values()) path.push_back(places[robot]);
  path.push_back({static_cast<float>(last_.x_mm[robot]), static_cast<float>(last_.y_mm[robot])});
  return path;
}

std::vector<Point> simplified(std::span<const Point> path, double tolerance_mm) {
  if (path.size() < 3) return {path.begin(), path.end()};
  std::vector<bool> needed(path.size(), false);
  needed.front() = needed.back() = true;
  std::vector<std::pair<std::size_t, std::size_t>> open{{0, path.size() - 1}};
  while (!open.empty()) {
    const auto [from, to] = open.back();
    open.pop_back();
    double furthest = tolerance_mm;
    std::size_t at = 0;
    for (std::size_t i = from + 1; i < to; ++i) {
      const double distance = distance_from_segment_mm(path[i], path[from], path[to]);
      if (distance > furthest) {
        furthest = distance;
        at = i;
      }
    }
    if (at == 0) continue;
    needed[at] = true;
    open.emplace_back(from, at);
    open.emplace_back(at, to);
  }
  std::vector<Point> out;
  for (std::size_t i = 0; i < path.size(); ++i) {
    if (needed[i]) out.push_back(path[i]);
  }
  return out;
}

}  // namespace kilotwin::recorder
