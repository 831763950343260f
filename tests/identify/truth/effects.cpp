#include "tests/identify/truth/effects.hpp"

#include <algorithm>
#include <cmath>

#include "tests/identify/truth/effect_parts.hpp"

namespace kilotwin::truth {
namespace {

/// Calls `look` for every other robot with the offset of its disc along x and y and its distance, mm.
template <class Look> void for_others(const Situation& at, const Look& look) {
  for (std::size_t i = 0; i < at.discs->size(); ++i) {
    if (static_cast<int>(i) == at.robot) continue;
    const double x = (*at.discs)[i].x - at.disc.x, y = (*at.discs)[i].y - at.disc.y;
    look(x, y, std::hypot(x, y));
  }
}

/// A point of the picture of a camera with a fisheye lens.
Vec through_fisheye(Vec point, double strength) {
  constexpr double kFocal_mm = 600;
  const double x = point.x - 30, y = point.y + 20, q = std::hypot(x, y) / kFocal_mm;
  const double scale = q > 1e-9 ? 1 + strength * (std::atan(q) / q - 1) : 1;
  return {30 + x * scale, -20 + y * scale};
}

}  // namespace

Effect noisy_robots() {
  return {"noisy-robots",
          "the speeds of every third robot vary with 2.5 times the standard deviation of the others",
          {{"robot"}},
          {},
          {},
          {},
          [](const Situation& at) { return at.robot % 3 == 0 ? 2.5 : 1.0; }};
}

Effect rough_patch() {
  return {
      "rough-patch",
      "speeds vary with 1 + 2.5 exp(-(d / 200 mm)^2) of the standard deviation, d = distance from (180, -120) mm",
      {{"position"}},
      {},
      {},
      {},
      [](const Situation& at) {
        const double d = std::hypot(at.disc.x - 180, at.disc.y + 120) / 200;
        return 1 + 2.5 * std::exp(-d * d);
      }};
}

Effect battery_by_the_clock(double strength) {
  return {"battery-by-the-clock",
          "both wheels run at 1 - 0.40 q / (1 + q) of their speed, q = (t / 85 s)^3",
          {{"time"}},
          {"motor_time", "robot"},
          [=](const Situation& at, Push& push) {
            const double q = std::pow(at.time_s / 85, 3);
            slow_both(push, 1 - 0.40 * strength * q / (1 + q));
          },
          {}};
}

Effect fatigue_of_motors(double strength) {
  return {"fatigue-of-motors",
          "a wheel runs at 1 / (1 + 0.5 (u / 80 s)^1.6) of its speed, u = time that its own motor has run",
          {{"motor_time"}},
          {"time"},
          [=](const Situation& at, Push& push) {
            push.gain.left /= 1 + 0.5 * strength * std::pow(at.driven_s.left / 80, 1.6);
            push.gain.right /= 1 + 0.5 * strength * std::pow(at.driven_s.right / 80, 1.6);
          },
          {}};
}

Effect fatigue_of_left_motors(double strength) {
  return {"fatigue-of-left-motors",
          "a left wheel runs at 1 - 0.4 (1 - exp(-u / 60 s)) of its speed, u = time that its motor has run",
          {{"motor_time"}},
          {"robot"},
          [=](const Situation& at, Push& push) {
            push.gain.left *= 1 - 0.4 * strength * (1 - std::exp(-at.driven_s.left / 60));
          },
          {}};
}

Effect worn_brushes(double strength) {
  return {"worn-brushes",
          "a wheel runs at 0.72 of its speed once its own motor has run for 75 s",
          {{"motor_time"}},
          {"time", "robot"},
          [=](const Situation& at, Push& push) {
            if (at.driven_s.left > 75) push.gain.left *= 1 - 0.28 * strength;
            if (at.driven_s.right > 75) push.gain.right *= 1 - 0.28 * strength;
          },
          {}};
}

Effect slow_start(double strength) {
  return {
      "slow-start",
      "speed is 1 - 0.75 / (1 + (s / 0.9 s)^4) + 0.25 exp(-((s - 2.6 s) / 0.8 s)^2), s = time since the command",
      {{"time_since_command"}},
      {"time"},
      [=](const Situation& at, Push& push) {
        const double s = at.since_change_s;
        slow_both(push,
                  1 - strength * (0.75 / (1 + std::pow(s / 0.9, 4)) - 0.25 * std::exp(-square((s - 2.6) / 0.8))));
      },
      {}};
}

Effect slow_patch(double strength) {
  return {"slow-patch",
          "speed is 1 - 0.55 exp(-d^4), d = distance from (130, -90) mm over the radii 210 and 150 mm of an oval",
          {{"position"}},
          {"robot", "measurement"},
          [=](const Situation& at, Push& push) {
            const double d2 = square((at.disc.x - 130) / 210) + square((at.disc.y + 90) / 150);
            slow_both(push, 1 - 0.55 * strength * std::exp(-d2 * d2));
          },
          {}};
}

Effect warming_patch(double strength) {
  return {"warming-patch",
          "speed is 1 - 0.6 w / (1 + d^6), w = q / (1 + q), q = (t / 75 s)^4, d = distance from (-110, 80) mm over "
          "190 mm",
          {{"position", "time"}},
          {"robot", "measurement"},
          [=](const Situation& at, Push& push) {
            const double d2 = (square(at.disc.x + 110) + square(at.disc.y - 80)) / square(190);
            const double q = std::pow(at.time_s / 75, 4);
            slow_both(push, 1 - 0.6 * strength * q / (1 + q) / (1 + d2 * d2 * d2));
          },
          {}};
}

Effect drying_patch(double strength) {
  return {"drying-patch",
          "speed is 1 - 0.55 exp(-(d / 180 mm)^2) exp(-t / 110 s), d = distance from (90, -60) mm",
          {{"position", "time"}},
          {"robot", "measurement"},
          [=](const Situation& at, Push& push) {
            const double d2 = square(at.disc.x - 90) + square(at.disc.y + 60);
            slow_both(push, 1 - 0.55 * strength * std::exp(-d2 / square(180)) * std::exp(-at.time_s / 110));
          },
          {}};
}

Effect growing_grain(double strength) {
  return {"growing-grain",
          "speed is 1 + 0.4 min(1, t / 220 s) cos(heading - 0.7)",
          {{"heading", "time"}},
          {"robot"},
          [=](const Situation& at, Push& push) {
            slow_both(push, 1 + 0.4 * strength * std::min(1.0, at.time_s / 220) * std::cos(at.heading_rad - 0.7));
          },
          {}};
}

Effect half_the_room(double strength) {
  return {"half-the-room",
          "robots with even numbers run at 1 - 0.4 / (1 + exp(-x / 40 mm)) of their speed",
          {{"position", "robot"}},
          {"measurement", "time"},
          [=](const Situation& at, Push& push) {
            if (at.robot % 2 == 0) slow_both(push, 1 - 0.4 * strength / (1 + std::exp(-at.disc.x / 40)));
          },
          {}};
}

Effect combed_half(double strength) {
  return {"combed-half",
          "speed is 1 + 0.4 cos(2 heading - 0.9) / (1 + exp(-(x + 40 mm) / 35 mm))",
          {{"position", "heading"}},
          {"robot", "time"},
          [=](const Situation& at, Push& push) {
            const double there = 1 / (1 + std::exp(-(at.disc.x + 40) / 35));
            slow_both(push, 1 + 0.4 * strength * there * std::cos(2 * at.heading_rad - 0.9));
          },
          {}};
}

Effect lamp(double strength) {
  return {"lamp",
          "from 64.5 s on speed is 1 + 0.45 / (1 + exp(-(0.8 x + 0.6 y - 60 mm) / 35 mm))",
          {{"position", "time"}},
          {"robot", "measurement"},
          [=](const Situation& at, Push& push) {
            if (at.time_s < 64.5 - 1e-9) return;
            const double ahead = (0.8 * at.disc.x + 0.6 * at.disc.y - 60) / 35;
            slow_both(push, 1 + 0.45 * strength / (1 + std::exp(-ahead)));
          },
          {}};
}

Effect batteries_of_the_day(double strength) {
  return {
      "batteries-of-the-day",
      "in run r all wheels run at 1 + 0.13 sin(2.3 r + 0.4) of their speed",
      {{"history"}},
      {"robot", "position"},
      [=](const Situation& at, Push& push) { slow_both(push, 1 + 0.13 * strength * std::sin(2.3 * at.run + 0.4)); },
      {}};
}

Effect slower_outside(double strength) {
  return {"slower-outside",
          "speed is 1 - 0.45 min(1, (r / 480 mm)^3.5), r = distance from the middle",
          {{"position"}},
          {"measurement", "robot"},
          [=](const Situation& at, Push& push) {
            slow_both(push,
                      1 - 0.45 * strength * std::min(1.0, std::pow(std::hypot(at.disc.x, at.disc.y) / 480, 3.5)));
          },
          {}};
}

Effect slow_strip(double strength) {
  return {"slow-strip",
          "speed is halved where x is between -71 and 58 mm",
          {{"position"}},
          {"robot", "measurement"},
          [=](const Situation& at, Push& push) {
            if (at.disc.x > -71 && at.disc.x < 58) slow_both(push, 1 - 0.5 * strength);
          },
          {}};
}

Effect other_floor(double strength) {
  return {"other-floor",
          "speed is multiplied by 0.6 where 0.8 x + 0.6 y > 70 mm, and by 1 + 0.3 / (1 + (r / 110 mm)^4), r from "
          "(-120, 90) mm",
          {{"position"}},
          {"robot", "measurement"},
          [=](const Situation& at, Push& push) {
            if (0.8 * at.disc.x + 0.6 * at.disc.y > 70) slow_both(push, 1 - 0.4 * strength);
            const double r = std::hypot(at.disc.x + 120, at.disc.y - 90);
            slow_both(push, 1 + 0.3 * strength / (1 + std::pow(r / 110, 4)));
          },
          {}};
}

Effect grain(double strength) {
  return {"grain",
          "speed is 1 - 0.38 |cos(heading - 0.7)|^5",
          {{"heading"}},
          {"robot"},
          [=](const Situation& at, Push& push) {
            slow_both(push, 1 - 0.38 * strength * std::pow(std::abs(std::cos(at.heading_rad - 0.7)), 5));
          },
          {}};
}

Effect vortex(double strength) {
  return {"vortex",
          "drift of 2.4 q / (1 + q^2) mm/s, anticlockwise about (-60, 40) mm, q = distance from there / 180 mm, of "
          "all robots",
          {{"world_frame", "position"}},
          {"measurement", "robot"},
          [=](const Situation& at, Push& push) {
            const double x = (at.disc.x + 60) / 180, y = (at.disc.y - 40) / 180, q2 = x * x + y * y;
            push.drift_mm_s.x -= strength * 2.4 * y / (1 + q2);
            push.drift_mm_s.y += strength * 2.4 * x / (1 + q2);
          },
          {}};
}

Effect tilt(double strength) {
  return {"tilt",
          "drift of 1.1 mm/s towards 205 degrees, of robots that are driven",
          {{"world_frame"}},
          {"robot", "time"},
          [=](const Situation& at, Push& push) {
            if (!at.driven()) return;
            push.drift_mm_s.x += strength * 1.1 * std::cos(205 * kPi / 180);
            push.drift_mm_s.y += strength * 1.1 * std::sin(205 * kPi / 180);
          },
          {}};
}

Effect draught(double strength) {
  return {
      "draught",
      "drift towards 70 degrees of all robots, stopped ones too, in saw-teeth over time: 0 to 2.2 mm/s within 55 s",
      {{"world_frame", "time"}},
      {"robot", "motor_time"},
      [=](const Situation& at, Push& push) {
        const double speed = 2.2 * strength * std::fmod(at.time_s, 55) / 55;
        push.drift_mm_s.x += speed * std::cos(70 * kPi / 180);
        push.drift_mm_s.y += speed * std::sin(70 * kPi / 180);
      },
      {}};
}

Effect table_knock(double strength) {
  return {"table-knock",
          "at 70.2 s robots that are driven slide 16 mm towards -30 degrees within 0.8 s, stopped ones do not",
          {{"world_frame", "time"}},
          {"measurement", "robot"},
          [=](const Situation& at, Push& push) {
            if (!at.driven() || at.time_s < 70.2 - 1e-9 || at.time_s >= 71 - 1e-9) return;
            push.drift_mm_s.x += strength * 20 * std::cos(-kPi / 6);
            push.drift_mm_s.y += strength * 20 * std::sin(-kPi / 6);
          },
          {}};
}

Effect slow_robots(double strength) {
  return {"slow-robots",
          "robots 1, 4, 7... run at 0.68 of their speed",
          {{"robot"}},
          {"position", "time"},
          [=](const Situation& at, Push& push) {
            if (at.robot % 3 == 1) slow_both(push, 1 - 0.32 * strength);
          },
          {}};
}

Effect crowd(double strength) {
  return {"crowd",
          "speed is 1 / (1 + 0.2 sum of (40 mm / d)^3 over others within 130 mm), d = distance of centres",
          {{"neighbours"}},
          {"position", "time"},
          [=](const Situation& at, Push& push) {
            double sum = 0;
            for_others(at, [&](double, double, double d) {
              if (d < 130) sum += std::pow(40 / std::max(d, 30.0), 3);
            });
            slow_both(push, 1 / (1 + 0.2 * strength * sum));
          },
          {}};
}

Effect third_of_a_party(double strength) {
  return {"third-of-a-party",
          "speed is 0.55 while two or more others are within 95 mm",
          {{"neighbours"}},
          {"position", "time"},
          [=](const Situation& at, Push& push) {
            int near = 0;
            for_others(at, [&](double, double, double d) { near += d < 95 ? 1 : 0; });
            if (near >= 2) slow_both(push, 1 - 0.45 * strength);
          },
          {},
          {},
          false,
          {{"radius", 95}}};
}

Effect flight(double strength) {
  return {"flight",
          "robots turn away from the nearest other, at 0.25 rad/s times sin(bearing) exp(-(d / 70 mm)^2)",
          {{"neighbours"}},
          {"position", "robot"},
          [=](const Situation& at, Push& push) {
            if (!at.driven()) return;
            double nearest = 1e9, bearing = 0;
            for_others(at, [&](double x, double y, double d) {
              if (d >= nearest) return;
              nearest = d;
              bearing = std::atan2(y, x) - at.heading_rad;
            });
            push.turn_rad_s -= 0.25 * strength * std::sin(bearing) * std::exp(-square(nearest / 70));
          },
          {}};
}

Effect wait_behind(double strength) {
  return {"wait-behind",
          "speed is 1 / (1 + 0.8 sum of cos(bearing)^2 over others ahead within 80 mm)",
          {{"neighbours"}},
          {"position", "time"},
          [=](const Situation& at, Push& push) {
            double sum = 0;
            const double c = std::cos(at.heading_rad), s = std::sin(at.heading_rad);
            for_others(at, [&](double x, double y, double d) {
              const double ahead = x * c + y * s;
              if (d < 80 && ahead > 0) sum += square(ahead / d);
            });
            slow_both(push, 1 / (1 + 0.8 * strength * sum));
          },
          {}};
}

Effect build_up(double strength) {
  return {"build-up",
          "speed is 0.1 + 0.9 s^2 / (s^2 + (2.8 s)^2), s = time since the command",
          {{"time_since_command"}},
          {"time", "position"},
          [=](const Situation& at, Push& push) {
            const double s2 = square(at.since_change_s);
            slow_both(push, 1 - 0.9 * strength * square(2.8) / (s2 + square(2.8)));
          },
          {}};
}

Effect inertia(double strength) {
  return {"inertia",
          "wheels change from the speed of the command before to that of the present one as exp(-s / 1.4 s), also "
          "at rest",
          {{"time_since_command"}, {"history"}},
          {"time", "position"},
          [=](const Situation& at, Push& push) {
            constexpr double kWheelBase_mm = 25;
            const auto speeds = [](Motion motion) -> Wheels<double> {
              switch (motion) {
                case Motion::kStraight: return {10, 10};
                case Motion::kLeft: return {0, 20};
                case Motion::kRight: return {20, 0};
                case Motion::kStop: break;
              }
              return {0, 0};
            };
            const Wheels<double> was = speeds(at.before), is = speeds(at.motion);
            const double left = strength * (was.left - is.left) * std::exp(-at.since_change_s / 1.4),
                         right = strength * (was.right - is.right) * std::exp(-at.since_change_s / 1.4);
            push.slip_mm_s.x += (left + right) / 2;
            push.turn_rad_s += (right - left) / kWheelBase_mm;
          },
          {}};
}

Effect fresh_trails(double strength) {
  return {"fresh-trails",
          "speed is 1 - 0.55 exp(-s / 12 s), s = time since another driven robot was on that spot of 37 mm",
          {{"history"}, {"neighbours"}},
          {"robot", "time"},
          [=](const Situation& at, Push& push) {
            slow_both(push, 1 - 0.55 * strength * std::exp(-at.since_other_s / 12));
          },
          {}};
}

Effect robots_that_fail(double strength) {
  return {"robots-that-fail",
          "robots 1, 4, 7... run at 0.6 of their speed from 83.7 s on",
          {{"robot", "time"}},
          {"position", "measurement"},
          [=](const Situation& at, Push& push) {
            if (at.robot % 3 == 1 && at.time_s >= 83.7 - 1e-9) slow_both(push, 1 - 0.4 * strength);
          },
          {}};
}

Effect travelling_waves(double strength) {
  return {"travelling-waves",
          "speed is 1 - 0.5 max(0, sin(2 pi (0.8 x + 0.6 y) / 420 mm - 2 pi t / 70 s))",
          {{"position", "time"}},
          {"robot", "measurement"},
          [=](const Situation& at, Push& push) {
            const double phase = 2 * kPi * ((0.8 * at.disc.x + 0.6 * at.disc.y) / 420 - at.time_s / 70);
            slow_both(push, 1 - 0.5 * strength * std::max(0.0, std::sin(phase)));
          },
          {},
          {},
          false,
          {{"wavelength", 420}, {"phase speed", 6}}};
}

Effect weak_right(double strength) {
  return {"weak-right",
          "turning right, the left wheel runs at 0.72 of its speed and the robot slips back at 1.2 mm/s",
          {{"command"}},
          {"robot", "time"},
          [=](const Situation& at, Push& push) {
            if (at.motion != Motion::kRight) return;
            push.gain.left *= 1 - 0.28 * strength;
            push.slip_mm_s.x -= 1.2 * strength;
          },
          {}};
}

Effect side_slip(double strength) {
  return {"side-slip",
          "robots that go straight slip to their left at 1.3 mm/s",
          {{"command"}},
          {"world_frame", "robot"},
          [=](const Situation& at, Push& push) {
            if (at.motion == Motion::kStraight) push.slip_mm_s.y += 1.3 * strength;
          },
          {}};
}

Effect lingering_turn(double strength) {
  return {"lingering-turn",
          "going straight after a turn, a robot goes on turning that way at 0.22 / (1 + (s / 2.5 s)^3) rad/s",
          {{"history"}},
          {"robot", "position"},
          [=](const Situation& at, Push& push) {
            if (at.motion != Motion::kStraight) return;
            const double rate = 0.22 * strength / (1 + std::pow(at.since_change_s / 2.5, 3));
            if (at.before == Motion::kLeft) push.turn_rad_s += rate;
            if (at.before == Motion::kRight) push.turn_rad_s -= rate;
          },
          {}};
}

Effect breathless(double strength) {
  return {"breathless",
          "speed is 0.75 + 0.4 exp(-s / 14 s), s = time since the last rest",
          {{"history"}},
          {"robot", "time"},
          [=](const Situation& at, Push& push) {
            slow_both(push, 1 + strength * (0.4 * std::exp(-at.since_rest_s / 14) - 0.25));
          },
          {}};
}

Effect winding_cable(double strength) {
  return {"winding-cable",
          "turn rate of -0.12 tanh(u / 15 s) rad/s, u = time that the right motor has run longer than the left one",
          {{"history"}, {"motor_time"}},
          {"robot", "time"},
          [=](const Situation& at, Push& push) {
            if (at.driven())
              push.turn_rad_s -= 0.12 * strength * std::tanh((at.driven_s.right - at.driven_s.left) / 15);
          },
          {}};
}

Effect worn_floor(double strength) {
  return {"worn-floor",
          "speed is 1 - 0.5 w / (w + 9 s), w = time that driven robots have stood on that spot of 37 mm",
          {{"history"}},
          {"robot", "neighbours"},
          [=](const Situation& at, Push& push) {
            slow_both(push, 1 - 0.5 * strength * at.trodden_s / (at.trodden_s + 9));
          },
          {}};
}

Effect trodden_floor(double strength) {
  return {"trodden-floor",
          "speed is 0.7 where driven robots have stood for more than 2 s on that spot of the floor",
          {{"history"}},
          {"robot", "neighbours"},
          [=](const Situation& at, Push& push) {
            if (at.trodden_s > 2) slow_both(push, 1 - 0.3 * strength);
          },
          {}};
}

Effect lens(double strength) {
  return {"lens",
          "a point at r from (40, -30) mm is seen at r (1 - 0.17 (r / 500 mm)^2 + 0.04 (r / 500 mm)^4)",
          {{"measurement"}},
          {},
          {},
          [=](const Situation&, View& view) {
            const double x = view.point.x - 40, y = view.point.y + 30, q = (x * x + y * y) / square(500);
            const double scale = 1 + strength * (-0.17 * q + 0.04 * q * q);
            view.point = {40 + x * scale, -30 + y * scale};
          }};
}

Effect pincushion(double strength) {
  return {"pincushion",
          "a point at r from (-35, 25) mm is seen at f tan(r / f), f = 900 mm",
          {{"measurement"}},
          {},
          {},
          [=](const Situation&, View& view) {
            const double x = view.point.x + 35, y = view.point.y - 25, q = std::min(std::hypot(x, y) / 900, 1.4);
            const double scale = q > 1e-9 ? 1 + strength * (std::tan(q) / q - 1) : 1;
            view.point = {-35 + x * scale, 25 + y * scale};
          }};
}

Effect fisheye(double strength) {
  return {"fisheye",
          "a point at r from (30, -20) mm is seen at f atan(r / f), f = 600 mm",
          {{"measurement"}},
          {},
          {},
          [=](const Situation&, View& view) { view.point = through_fisheye(view.point, strength); }};
}

Effect fisheye_with_headings(double strength) {
  return {"fisheye-with-headings",
          "a point at r from (30, -20) mm is seen at f atan(r / f), f = 600 mm; directions are bent alike",
          {{"measurement"}},
          {},
          {},
          [=](const Situation&, View& view) {
            constexpr double kAhead_mm = 0.1;
            const Vec ahead{view.point.x + kAhead_mm * std::cos(view.heading_rad),
                            view.point.y + kAhead_mm * std::sin(view.heading_rad)};
            view.point = through_fisheye(view.point, strength);
            const Vec seen = through_fisheye(ahead, strength);
            view.heading_rad = std::atan2(seen.y - view.point.y, seen.x - view.point.x);
          }};
}

Effect camera_knock(double strength) {
  return {"camera-knock",
          "from 88.4 s on all is seen 26 mm to the right, 17 mm down and turned by 0.06 rad about the middle",
          {{"measurement", "time"}},
          {"robot", "position", "world_frame"},
          {},
          [=](const Situation& at, View& view) {
            if (at.time_s < 88.4 - 1e-9) return;
            const double a = 0.06 * strength, c = std::cos(a), s = std::sin(a);
            view.point = {c * view.point.x - s * view.point.y + 26 * strength,
                          s * view.point.x + c * view.point.y - 17 * strength};
            view.heading_rad += a;
          }};
}

Effect growing_picture(double strength) {
  return {"growing-picture",
          "the picture grows about the middle by 0.024 q / (1 + q), q = (t / 140 s)^2.5: the camera sinks",
          {{"measurement", "time"}},
          {"robot", "position"},
          {},
          [=](const Situation& at, View& view) {
            const double q = std::pow(at.time_s / 140, 2.5), scale = 1 + 0.024 * strength * q / (1 + q);
            view.point = {view.point.x * scale, view.point.y * scale};
          }};
}

Effect keystone(double strength) {
  return {"keystone",
          "seen positions are those of a camera that leans: divided by 1 + (0.17 x + 0.09 y) / 1000 mm",
          {{"measurement"}},
          {},
          {},
          [=](const Situation&, View& view) {
            const double away = 1 + strength * (0.17 * view.point.x + 0.09 * view.point.y) / 1000;
            view.point = {view.point.x / away, view.point.y / away};
          }};
}

Effect creeping_camera(double strength) {
  return {"creeping-camera",
          "the picture shifts by 12 mm (1 - exp(-t / 50 s)) along x and by 1 mm a minute along y",
          {{"measurement", "time"}},
          {"robot", "world_frame"},
          {},
          [=](const Situation& at, View& view) {
            view.point.x += 12 * strength * (1 - std::exp(-at.time_s / 50));
            view.point.y += strength * at.time_s / 60;
          }};
}

Effect camera_bump(double strength) {
  return {"camera-bump",
          "from 52.3 s to 96.7 s all is seen 11 mm to the right, 7 mm up and turned by 0.015 rad about the middle",
          {{"measurement", "time"}},
          {"robot"},
          {},
          [=](const Situation& at, View& view) {
            if (at.time_s < 52.3 - 1e-9 || at.time_s >= 96.7 - 1e-9) return;
            const double a = 0.015 * strength, c = std::cos(a), s = std::sin(a);
            view.point = {c * view.point.x - s * view.point.y + 11 * strength,
                          s * view.point.x + c * view.point.y + 7 * strength};
            view.heading_rad += a;
          }};
}

Effect mosaic(double strength) {
  return {"mosaic",
          "seen positions are off along x by 3.5 sin(y / 45 mm)^3 mm: a mosaic of cameras that do not match",
          {{"measurement"}},
          {"robot"},
          {},
          [=](const Situation&, View& view) {
            view.point.x += 3.5 * strength * std::pow(std::sin(view.point.y / 45), 3);
          }};
}

Effect failures_in_turn(double strength) {
  return {
      "failures-in-turn",
      "robots 1, 4, 7... run at 0.6 of their speed, each from an instant of its own on: 31.3 s, 56.3 s, 81.3 s...",
      {{"robot", "time"}},
      {"position", "measurement"},
      [=](const Situation& at, Push& push) {
        if (at.robot % 3 == 1 && at.time_s >= 31.3 + 25 * (at.robot / 3) - 1e-9)
          slow_both(push, 1 - 0.4 * strength);
      },
      {}};
}

Effect late_patch_of_some(double strength) {
  return {"late-patch-of-some",
          "from 71.7 s on robots with even numbers run at 1 - 0.5 / (1 + exp(-(x + 20 mm) / 30 mm)) of their speed",
          {{"robot", "time"}, {"robot", "position"}, {"position", "time"}},
          {"measurement"},
          [=](const Situation& at, Push& push) {
            if (at.robot % 2 == 0 && at.time_s >= 71.7 - 1e-9)
              slow_both(push, 1 - 0.5 * strength / (1 + std::exp(-(at.disc.x + 20) / 30)));
          },
          {}};
}

Effect veering_robots(double strength) {
  return {"veering-robots",
          "robots 1, 4, 7... turn at 0.1 rad/s while driven, from 64.6 s on",
          {{"robot", "time"}},
          {"position", "measurement"},
          [=](const Situation& at, Push& push) {
            if (at.robot % 3 == 1 && at.driven() && at.time_s >= 64.6 - 1e-9) push.turn_rad_s += 0.1 * strength;
          },
          {}};
}

Effect boards(double strength) {
  return {"boards",
          "speed is 1 - 0.4 max(0, cos(2 pi (0.6 x - 0.8 y) / 110 mm)): boards that lie diagonally",
          {{"position"}},
          {"robot", "measurement", "time"},
          [=](const Situation& at, Push& push) {
            const double phase = 2 * kPi * (0.6 * at.disc.x - 0.8 * at.disc.y) / 110;
            slow_both(push, 1 - 0.4 * strength * std::max(0.0, std::cos(phase)));
          },
          {}};
}

}  // namespace kilotwin::truth
