/// Position and brightness of a light source as functions of time.
#pragma once

namespace kilotwin {
struct LightSourceSettings;
}

namespace kilotwin::senses {

/// A point source of light. z_mm is the height above the floor.
struct Lamp {
  double x_mm = 0, y_mm = 0, z_mm = 0;
  double intensity = 0;  ///< reading of a nominal sensor at a distance of 1 m, counts; 0: the lamp is off
};

/// The source at `time_s`: its position on its way-points or circle, and whether it is switched on.
[[nodiscard]] Lamp lamp_at(const LightSourceSettings&, double time_s);

/// A unit vector.
struct Direction {
  double x = 0, y = 0, z = 1;
};

/// Reading of a nominal sensor at (x, y, z), counts, not limited to the converter's range. It falls with the square of the
/// distance. With an axis it also falls with the cosine of the angle between axis and lamp, as on a flat sensor (Lambert), and is
/// 0 beyond 90 degrees; null: light counts alike from all sides.
[[nodiscard]] inline double reading_of(const Lamp& lamp, double x_mm, double y_mm, double z_mm,
                                       const Direction* axis) {
  const double dx = lamp.x_mm - x_mm, dy = lamp.y_mm - y_mm, dz = lamp.z_mm - z_mm;
  // Avoids a division by 0. Within 1 mm every lamp saturates the sensor.
  double square = dx * dx + dy * dy + dz * dz;
  if (square < 1) square = 1;
  const double reading = lamp.intensity * 1e6 / square;
  if (axis == nullptr) return reading;
  const double along = dx * axis->x + dy * axis->y + dz * axis->z;
  return along > 0 ? reading * along / __builtin_sqrt(square) : 0;
}

}  // namespace kilotwin::senses
