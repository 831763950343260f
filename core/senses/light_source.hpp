/// Where a light is at an instant, and how bright.
#pragma once

namespace kilotwin {
struct LightSourceSettings;
}

namespace kilotwin::senses {

/// A point of light, mm; z is the height above the floor.
struct Lamp {
  double x_mm = 0, y_mm = 0, z_mm = 0;
  double intensity = 0;  ///< reading of a nominal sensor at a distance of 1 m, counts; 0: off
};

/// A pure function of time: along the way-points or around the circle, switched as the source says.
[[nodiscard]] Lamp lamp_at(const LightSourceSettings&, double time_s);

/// The reading of a nominal sensor at (x, y, z), counts, above or below what the converter can show. It falls with the square of
/// the distance; `cosine`: and with the cosine of the angle from the vertical, as on a flat sensor that looks up.
[[nodiscard]] inline double reading_of(const Lamp& lamp, double x_mm, double y_mm, double z_mm, bool cosine) {
  const double dx = lamp.x_mm - x_mm, dy = lamp.y_mm - y_mm, dz = lamp.z_mm - z_mm;
  // Nearer than 1 mm every lamp saturates the sensor.
  double square = dx * dx + dy * dy + dz * dz;
  if (square < 1) square = 1;
  const double reading = lamp.intensity * 1e6 / square;
  if (!cosine) return reading;
  return dz > 0 ? reading * dz / __builtin_sqrt(square) : 0;
}

}  // namespace kilotwin::senses
