#include "clients/identify/unexplained/prediction_windows.hpp"

#include <algorithm>
#include <cmath>
#include <map>

namespace kilotwin::identify {
namespace {

struct Description {
  const char *name, *unit, *words;
};
constexpr std::array<Description, kFeatures> kDescriptions = {
    {{"time", "s", "time"},
     {"driven_time", "s", "driven time"},
     {"x", "mm", "x"},
     {"y", "mm", "y"},
     {"heading", "rad", "heading"},
     {"command", "", "command"},
     {"straight", "share", "command: share of straight driving"},
     {"turning", "share", "command: share of left minus right turns"},
     {"time_since_command", "s", "time since command"},
     {"nearest", "mm", "distance to the nearest robot"},
     {"bearing", "rad", "direction to the nearest robot"},
     {"robot", "", "robot"}}};

/// Share of a time interval under each command.
std::array<double, 4> shares_of(const CommandClock& clock, double from_s, double to_s) {
  std::array<double, 4> shares{};
  for (double t = from_s; t < to_s;) {
    const double end = std::min(to_s, clock.next_change_s(t));
    shares[static_cast<std::size_t>(clock.at(t).command)] += (end - t) / (to_s - from_s);
    t = end;
  }
  return shares;
}

}  // namespace

const char* name_of(Feature feature) { return kDescriptions[static_cast<std::size_t>(feature)].name; }
const char* unit_of(Feature feature) { return kDescriptions[static_cast<std::size_t>(feature)].unit; }

const char* in_words(Feature feature) { return kDescriptions[static_cast<std::size_t>(feature)].words; }

std::vector<Window> windows_of(const PreparedSet& set, const std::vector<Forecast>& forecasts, double horizon_s) {
  std::map<std::pair<std::uint32_t, std::size_t>, const TrackView*> views;
  for (const TrackView& view : set.views()) views[{view.run, view.place}] = &view;
  std::vector<Window> windows;
  for (const Forecast& f : forecasts) {
    const TrackView& view = *views.at({f.run, f.place});
    const std::optional<Eigen::Vector2d> error_mm = error_of(*view.track, f);
    if (!error_mm) continue;
    const double from_s = f.time_s - horizon_s;
    const CommandState state = view.clock->at(from_s);
    const std::array<double, 4> shares = shares_of(*view.clock, from_s, f.time_s);
    const NeighbourView& near = view.neighbours->view(view.place, from_s);
    Window w;
    w.run = f.run;
    w.place = f.place;
    const auto set_at = [&](Feature feature, double value) { w.at[static_cast<std::size_t>(feature)] = value; };
    set_at(Feature::kTime, from_s);
    set_at(Feature::kDrivenTime, state.driven_s);
    set_at(Feature::kX, f.from_x_mm);
    set_at(Feature::kY, f.from_y_mm);
    set_at(Feature::kHeading, wrapped_angle(f.from_heading_rad));
    set_at(Feature::kCommand, static_cast<double>(std::max_element(shares.begin(), shares.end()) - shares.begin()));
    set_at(Feature::kStraight, shares[static_cast<std::size_t>(Motion::kStraight)]);
    set_at(Feature::kTurning,
           shares[static_cast<std::size_t>(Motion::kLeft)] - shares[static_cast<std::size_t>(Motion::kRight)]);
    set_at(Feature::kSinceCommand, std::min(state.since_s, 60.0));
    set_at(Feature::kNearest, std::min(near.nearest_mm, kFarNeighbour_mm));
    set_at(Feature::kBearing,
           near.nearest_mm < kFarNeighbour_mm ? wrapped_angle(near.direction_rad - f.from_heading_rad) : 0);
    set_at(Feature::kRobot, view.track->robot);
    const double dx = error_mm->x(), dy = error_mm->y(), c = std::cos(f.from_heading_rad),
                 s = std::sin(f.from_heading_rad);
    w.in_world_mm = *error_mm;
    w.in_body_mm = {dx * c + dy * s, dy * c - dx * s};
    windows.push_back(w);
  }
  return windows;
}

}  // namespace kilotwin::identify
