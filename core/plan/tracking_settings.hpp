/// Trackers and tracked robots, as plain values. Meaning, units and defaults: Tracker, Tracking and Says in
/// idl/experiment.proto.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace kilotwin {

struct TrackerSettings {
  std::string source;
  double x_mm = 0, y_mm = 0, heading_rad = 0;
  double scale = 1;
  bool mirrored = false;
  std::uint32_t first_robot = 0;
  double position_sd_mm = 1, heading_sd_rad = 0.1;
};

/// The message of a tracked robot while the conditions hold.
struct SaysRuleSettings {
  struct Circle {
    double x_mm = 0, y_mm = 0, radius_mm = 0;
  };
  std::vector<std::uint32_t> robots;  ///< ascending; empty: all
  std::optional<Circle> circle;
  std::optional<std::uint8_t> led;         ///< r | g << 2 | b << 4
  std::array<std::uint8_t, 10> message{};  ///< data[9], type
  std::optional<std::uint32_t> id_octet;   ///< of the message: it holds the robot's number modulo 256
  std::uint16_t tx_period = 0;             ///< between two messages, counts of 128 us
};

/// Messages by which the station passes messages of simulated robots to real ones.
struct HearsSettings {
  enum class Data : std::uint8_t { kOctet, kSender, kDistance, kBearing };
  double range_mm = 0;
  std::uint8_t type = 0;  ///< of the ARK message, 0..15
  Data data = Data::kOctet;
  std::uint32_t octet = 0;  ///< with kOctet: of the simulated robot's message, 0..8
};

struct TrackingSettings {
  std::vector<TrackerSettings> trackers;  ///< empty: every source, as if its block held nothing but its name
  double bridge_s = 0.5;
  bool present_at_start = true;
  double speed_change_mm_s = 10, turn_change_rad_s = 0.8;
  std::vector<std::vector<SaysRuleSettings>> rules;  ///< per group of the experiment
  std::vector<std::uint8_t> heard;                   ///< per group, 1: its robots say what listeners heard of them
  std::vector<std::optional<HearsSettings>> hears;   ///< per group: what it hears of simulated robots
  std::vector<std::uint32_t> first_robots;           ///< per group

  /// Of the robot's group; the robot must be one of the experiment.
  [[nodiscard]] const std::vector<SaysRuleSettings>& rules_of(std::uint32_t robot) const {
    return rules[group_of(robot)];
  }
  [[nodiscard]] bool says_heard(std::uint32_t robot) const { return heard[group_of(robot)] != 0; }
  [[nodiscard]] const std::optional<HearsSettings>& hears_of(std::uint32_t robot) const {
    return hears[group_of(robot)];
  }

 private:
  [[nodiscard]] std::size_t group_of(std::uint32_t robot) const {
    const auto group = std::upper_bound(first_robots.begin(), first_robots.end(), robot) - first_robots.begin() - 1;
    return static_cast<std::size_t>(group);
  }
};

}  // namespace kilotwin
