/// Settings of the station and its virtual environments. Station in idl/experiment.proto gives meaning, units and defaults.
#pragma once

#include <cstdint>
#include <variant>
#include <vector>

namespace kilotwin {

struct HubSettings {
  double x_mm = 0, y_mm = 0, radius_mm = 0;
};

struct ForagingSettings {
  double home_x_mm = 0, home_y_mm = 0, home_radius_mm = 0;
  double food_x_mm = 0, food_y_mm = 0, food_radius_mm = 0;
  double scent_radius_mm = 0;
  std::uint32_t loads = 0;
};

/// std::monostate: the experiment names no kind.
using EnvironmentSettings = std::variant<std::monostate, HubSettings, ForagingSettings>;

struct StationSettings {
  double start_broadcast_s = 0;
  double packet_interval_s = 0;
  std::vector<EnvironmentSettings> environments;
};

}  // namespace kilotwin
