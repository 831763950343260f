#include "core/senses/light_source.hpp"

#include "core/base/pose.hpp"
#include "core/math/elementary.h"
#include "core/plan/senses_settings.hpp"

namespace kilotwin::senses {
namespace {

/// Whether the source is on: it starts as `on` and toggles at each time of `switch_s`.
bool is_on(const LightSourceSettings& source, double time_s) {
  bool on = source.on;
  const double within_s = source.switch_period_s > 0 ? kt_fmod(time_s, source.switch_period_s) : time_s;
  for (const double at_s : source.switch_s) {
    if (at_s > within_s) break;
    on = !on;
  }
  return on;
}

void follow_way(const LightSourceSettings& source, double time_s, Lamp& lamp) {
  const std::size_t last = source.waypoints.size() - 1;
  const double whole_s = source.waypoints[last].time_s;
  if (source.loop && whole_s > 0) time_s = kt_fmod(time_s, whole_s);
  std::size_t next = 0;
  while (next < last && source.waypoints[next].time_s <= time_s) ++next;
  const LightWaypointSettings& to = source.waypoints[next];
  const LightWaypointSettings& from = source.waypoints[next > 0 ? next - 1 : 0];
  const double span_s = to.time_s - from.time_s;
  double part = span_s > 0 ? (time_s - from.time_s) / span_s : 1;
  part = part < 0 ? 0 : part > 1 ? 1 : part;
  const auto between = [part](double a, double b) { return a + part * (b - a); };
  lamp.x_mm = between(from.x_mm, to.x_mm);
  lamp.y_mm = between(from.y_mm, to.y_mm);
  if (from.height_mm && to.height_mm) lamp.z_mm = between(*from.height_mm, *to.height_mm);
}

void follow_circle(const LightSourceSettings& source, double time_s, Lamp& lamp) {
  const LightCircleSettings& circle = *source.circle;
  // Reduce to one turn before the multiplication by 2 pi, so that long runs lose no accuracy.
  const double turns = kt_fmod(time_s, circle.period_s) / circle.period_s;
  const double angle_rad = 2 * kPi * (circle.clockwise ? -turns : turns) + circle.phase_deg * (kPi / 180);
  double s = 0, c = 0;
  kt_sincos(angle_rad, &s, &c);
  lamp.x_mm += circle.radius_mm * c;
  lamp.y_mm += circle.radius_mm * s;
}

}  // namespace

Lamp lamp_at(const LightSourceSettings& source, double time_s) {
  Lamp lamp{source.x_mm, source.y_mm, source.height_mm, is_on(source, time_s) ? source.intensity : 0};
  if (!source.waypoints.empty()) follow_way(source, time_s, lamp);
  if (source.circle) follow_circle(source, time_s, lamp);
  return lamp;
}

}  // namespace kilotwin::senses
