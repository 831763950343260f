#include "clients/cli/recorded_state.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <span>
#include <vector>

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

recorder::StateView RecordedState::of(const SwarmView& swarm) {
  if (measurement_.any()) measurement_.measure(swarm, measured_);
  return {swarm.tick,       swarm.x_mm,           swarm.y_mm,         swarm.heading_rad,         swarm.led,
          swarm.life_cycle, swarm.movable_x_mm,   swarm.movable_y_mm, swarm.movable_heading_rad, measured_.x_mm,
          measured_.y_mm,   measured_.heading_rad};
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
