#include "clients/cli/recorded_state.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace kilotwin::cli {
namespace {

template <class Recorded, class Value>
std::string difference(std::string_view whose, std::string_view field, std::span<const Value> values,
                       const Recorded& recorded) {
  if (values.size() != static_cast<std::size_t>(recorded.size())) {
    return fmt::format("{} has {} values of {}, recorded were {}", whose, values.size(), field, recorded.size());
  }
  for (std::size_t i = 0; i < values.size(); ++i) {
    const auto was = static_cast<Value>(*(recorded.begin() + static_cast<std::ptrdiff_t>(i)));
    if (values[i] != was) return fmt::format("{} {}: {} is {}, recorded was {}", whose, i, field, values[i], was);
  }
  return {};
}

}  // namespace

RecordedState::RecordedState(const RunPlan& plan)
    : x_mm_(plan.robots()),
      y_mm_(plan.robots()),
      heading_rad_(plan.robots()),
      led_(plan.robots()),
      life_cycle_(plan.robots()),
      movable_x_mm_(plan.movables()),
      movable_y_mm_(plan.movables()),
      movable_heading_rad_(plan.movables()),
      measurement_(plan) {}

void RecordedState::gather(Tick tick, std::span<const BodyFrame* const> bodies,
                           std::span<const ActuationFrame* const> actuation) {
  tick_ = tick;
  for (const BodyFrame* frame : bodies) {
    for (std::size_t i = 0; i < frame->robot.size(); ++i) {
      const std::uint32_t robot = frame->robot[i];
      x_mm_[robot] = frame->x_mm[i];
      y_mm_[robot] = frame->y_mm[i];
      heading_rad_[robot] = frame->heading_rad[i];
    }
    const MovableColumns& movable = frame->movable;
    for (std::size_t i = 0; i < movable.body.size(); ++i) {
      movable_x_mm_[movable.body[i]] = movable.x_mm[i];
      movable_y_mm_[movable.body[i]] = movable.y_mm[i];
      movable_heading_rad_[movable.body[i]] = movable.heading_rad[i];
    }
  }
  for (const ActuationFrame* frame : actuation) {
    std::copy(frame->led.begin(), frame->led.end(), led_.begin() + frame->first_robot);
    std::copy(frame->life_cycle.begin(), frame->life_cycle.end(), life_cycle_.begin() + frame->first_robot);
  }
  if (measurement_.any()) measurement_.measure(tick, bodies, actuation, measured_);
}

recorder::StateView RecordedState::view() const {
  return {tick_,         x_mm_,         y_mm_,          heading_rad_,
          led_,          life_cycle_,   movable_x_mm_,  movable_y_mm_,
          movable_heading_rad_, measured_.x_mm, measured_.y_mm, measured_.heading_rad};
}

std::string first_difference(const recorder::StateView& state, const proto::StateRecord& recorded) {
  std::string found;
  const auto compare = [&](std::string_view whose, std::string_view field, const auto& values, const auto& was) {
    if (found.empty()) found = difference(whose, field, values, was);
  };
  compare("robot", "x_mm", state.x_mm, recorded.x_mm());
  compare("robot", "y_mm", state.y_mm, recorded.y_mm());
  compare("robot", "heading_rad", state.heading_rad, recorded.heading_rad());
  const auto octets = [&](std::string_view field, std::span<const std::uint8_t> values, const std::string& was) {
    const std::span bytes(reinterpret_cast<const std::uint8_t*>(was.data()), was.size());  // NOLINT
    if (!found.empty() || std::equal(values.begin(), values.end(), bytes.begin(), bytes.end())) return;
    found = difference("robot", field, values, std::vector<int>(bytes.begin(), bytes.end()));
  };
  octets("led", state.led, recorded.led());
  octets("life_cycle", state.life_cycle, recorded.life_cycle());
  compare("movable body", "x_mm", state.movable_x_mm, recorded.movable_x_mm());
  compare("movable body", "y_mm", state.movable_y_mm, recorded.movable_y_mm());
  compare("movable body", "heading_rad", state.movable_heading_rad, recorded.movable_heading_rad());
  compare("robot", "measured_x_mm", state.measured_x_mm, recorded.measured_x_mm());
  compare("robot", "measured_y_mm", state.measured_y_mm, recorded.measured_y_mm());
  compare("robot", "measured_heading_rad", state.measured_heading_rad, recorded.measured_heading_rad());
  return found;
}

}  // namespace kilotwin::cli
