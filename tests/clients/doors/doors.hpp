/// Doors out of text, for tests.
#pragma once

#include <google/protobuf/text_format.h>

#include <stdexcept>
#include <string>
#include <vector>

#include "clients/doors/door.hpp"

namespace kilotwin::doors::test {

inline proto::Door settings(const std::string& text) {
  proto::Door door;
  if (!google::protobuf::TextFormat::ParseFromString(text, &door)) throw std::runtime_error("no door: " + text);
  return door;
}

/// Robots before `first_tracked` are simulated, the others are tracked.
inline Door door(const std::string& text, std::size_t robots, std::size_t first_tracked = 0) {
  std::vector<bool> tracked(robots, true);
  std::fill_n(tracked.begin(), first_tracked, false);
  const proto::Door parsed = settings(text);
  return {parsed, Placement(parsed), RobotNames(parsed.robots(), std::move(tracked))};
}

}  // namespace kilotwin::doors::test
