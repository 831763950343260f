/// Settings of light, batteries and temperature. Light, Battery and Temperature in idl/experiment.proto give meaning, units and
/// defaults.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace kilotwin {

struct LightCircleSettings {
  double radius_mm = 0, period_s = 0, phase_deg = 0;
  bool clockwise = false;
};

struct LightWaypointSettings {
  double time_s = 0, x_mm = 0, y_mm = 0;
  std::optional<double> height_mm;  ///< absent: the height of the source
};

struct LightSourceSettings {
  double x_mm = 0, y_mm = 0, height_mm = 0;
  double intensity = 0;
  std::optional<LightCircleSettings> circle;
  std::vector<LightWaypointSettings> waypoints;  ///< ascending times
  bool loop = false;
  bool on = false;
  std::vector<double> switch_s;  ///< ascending
  double switch_period_s = 0;
};

/// The brightness of a picture, 0..255, row by row from the top.
struct LightRaster {
  std::uint32_t columns = 0, rows = 0;
  std::string brightness;
};

struct LightImageSettings {
  std::vector<LightRaster> pictures;
  double x_mm = 0, y_mm = 0;
  double width_mm = 0, height_mm = 0;
  double black = 0, white = 0, gamma = 0;
  double picture_s = 0;
  bool loop = false;
};

struct LightSensorSettings {
  double radius_mm = 0, angle_deg = 0, height_mm = 0, tilt_deg = 0, body_height_mm = 0;
  bool cosine = false;
  double gain_sd = 0, offset_sd = 0;
  double noise_floor = 0, noise_relative = 0;
};

struct LightSettings {
  double ambient = 0;
  std::vector<LightSourceSettings> sources;
  std::vector<LightImageSettings> images;
  bool shadows = false;
  LightSensorSettings sensor;
};

struct ChargerSettings {
  double x_mm = 0, y_mm = 0, radius_mm = 0;
  double current_mA = 0;
};

struct BatterySettings {
  double capacity_mAh = 0;
  double charge = 0, charge_sd = 0;
  double idle_mA = 0, sleep_mA = 0, motor_mA = 0, led_mA = 0, transmission_mA = 0;
  double resistance_ohm = 0;
  double reading_sd = 0;
  std::vector<ChargerSettings> chargers;
};

struct TemperatureSettings {
  double celsius = 0;
  double offset_sd = 0, reading_sd = 0;
};

}  // namespace kilotwin
