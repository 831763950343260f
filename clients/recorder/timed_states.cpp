#include "clients/recorder/timed_states.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/base/error.hpp"
#include "core/base/pose.hpp"

namespace kilotwin::recorder {
namespace {

double heading_between(double from_rad, double to_rad, double share) {
  return wrapped(from_rad + share * wrapped(to_rad - from_rad));
}

/// `share` 0 is `from`, 1 is `to`.
Snapshot between(const Snapshot& from, const Snapshot& to, double share) {
  Snapshot now = share < 1 ? from : to;
  now.time_s = std::lerp(from.time_s, to.time_s, share);
  for (std::size_t i = 0; i < now.x_mm.size(); ++i) {
    now.x_mm[i] = std::lerp(from.x_mm[i], to.x_mm[i], share);
    now.y_mm[i] = std::lerp(from.y_mm[i], to.y_mm[i], share);
    now.heading_rad[i] = heading_between(from.heading_rad[i], to.heading_rad[i], share);
  }
  for (std::size_t i = 0; i < now.movable_x_mm.size(); ++i) {
    now.movable_x_mm[i] = std::lerp(from.movable_x_mm[i], to.movable_x_mm[i], share);
    now.movable_y_mm[i] = std::lerp(from.movable_y_mm[i], to.movable_y_mm[i], share);
    now.movable_heading_rad[i] = heading_between(from.movable_heading_rad[i], to.movable_heading_rad[i], share);
  }
  return now;
}

}  // namespace

TimedStates::TimedStates(const std::filesystem::path& recording) : reader_(recording) {
  if (!advance()) throw UserError(fmt::format("{}: holds no state; record one first", recording.string()));
  before_ = after_;
  before_tick_ = after_tick_;
  floors_ = floors_after_;
  first_s_ = before_.time_s;
}

bool TimedStates::advance() {
  while (const proto::Record* const record = reader_.next()) {
    if (record->has_floor()) floors_after_[record->floor().environment()] = record->floor();
    if (!record->has_state()) continue;
    take(after_, record->state(), reader_.tick_length());
    after_tick_ = record->state().tick();
    return true;
  }
  return false;
}

std::optional<Snapshot> TimedStates::at(double time_s) {
  // A time that equals a state's, but for rounding, must find that state.
  constexpr double kSlack_s = 1e-9;
  while (after_.time_s + kSlack_s < time_s) {
    before_ = after_;
    before_tick_ = after_tick_;
    floors_ = floors_after_;
    if (!advance()) return std::nullopt;
  }
  const double passed_s = after_.time_s - before_.time_s;
  return between(before_, after_, passed_s > 0 ? std::clamp((time_s - before_.time_s) / passed_s, 0.0, 1.0) : 0.0);
}

}  // namespace kilotwin::recorder
