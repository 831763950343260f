/// Settings of the station and its virtual environments. Station in idl/experiment.proto gives meaning, units and defaults.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace kilotwin {

/// Bits of type << 10 | data, from the lowest on.
struct BitFieldSettings {
  std::uint32_t first = 0, count = 14;
};

/// A virtual environment: a plugin and its parameters.
struct EnvironmentSettings {
  std::string name;      ///< for people: that of the built-in plugin, or of its first source
  std::string built_in;  ///< empty: the object below
  std::string sha256;    ///< of plugins/SHA256.so in the run directory
  std::map<std::string, std::string> parameters;
  bool ends_run = false;  ///< by its failure
  std::optional<BitFieldSettings> bits;
};

struct CameraSettings {
  double frame_rate_hz = 0, latency_s = 0;
  double position_noise_mm = 0;
  double led_error = 0, dropped_frames = 0;
  double losses_per_hour = 0, lost_s = 0;
  double swap_distance_mm = 0, swaps_per_hour = 0;
};

struct StationSettings {
  double start_broadcast_s = 0;
  double packet_interval_s = 0;
  std::optional<double> robot_interval_s;
  double log_every_s = 0, floor_every_s = 0;
  std::optional<CameraSettings> camera;
  std::string host_sha256;  ///< of plugins/SHA256, the program that runs plugins with sources
  std::vector<EnvironmentSettings> environments;
};

}  // namespace kilotwin
