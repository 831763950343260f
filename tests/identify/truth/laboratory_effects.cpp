#include "tests/identify/truth/laboratory_effects.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "tests/identify/truth/effect_parts.hpp"

namespace kilotwin::truth {
namespace {

bool turns(Motion motion) { return motion == Motion::kLeft || motion == Motion::kRight; }

double distance(Vec a, double x, double y) { return std::hypot(a.x - x, a.y - y); }

/// Uniform in [0, 1), a function of three numbers.
double chance(int run, int robot, int slot) {
  std::uint64_t z =
      std::uint64_t{0x9e3779b97f4a7c15} * static_cast<std::uint64_t>(1 + run * 1000003 + robot * 1009) +
      static_cast<std::uint64_t>(slot) * std::uint64_t{0xbf58476d1ce4e5b9};
  z = (z ^ (z >> 30)) * std::uint64_t{0xbf58476d1ce4e5b9};
  z = (z ^ (z >> 27)) * std::uint64_t{0x94d049bb133111eb};
  return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

}  // namespace

Effect backlash() {
  return {
      "backlash",
      "the first 0.9 s of a turn against the last one have 0.15 of the speed",
      {{"history"}, {"time_since_command"}},
      {"time", "position", "robot"},
      [](const Situation& at, Push& push) {
        if (turns(at.motion) && turns(at.last_turn) && at.last_turn != at.motion && at.since_change_s < 0.9 - 1e-9)
          slow_both(push, 0.15);
      },
      {}};
}

Effect stiction() {
  return {"stiction",
          "after a rest of r, wheels run at 0.1 of their speed for the first 2.5 s (1 - exp(-r / 3 s))",
          {{"history"}, {"time_since_command"}},
          {"time", "position", "robot"},
          [](const Situation& at, Push& push) {
            if (at.before == Motion::kStop && at.since_change_s < 2.5 * (1 - std::exp(-at.before_s / 3)))
              slow_both(push, 0.1);
          },
          {}};
}

Effect warm_turns() {
  return {"warm-turns",
          "turns run at 0.8 + 0.5 tanh(d / 7 s) of their speed, d = duration of the motion before",
          {{"history"}, {"command"}},
          {"time", "position", "robot"},
          [](const Situation& at, Push& push) {
            if (turns(at.motion)) slow_both(push, 0.8 + 0.5 * std::tanh(at.before_s / 7));
          },
          {}};
}

Effect shared_current() {
  return {"shared-current",
          "the left wheel runs at 0.8 of its speed while both motors run",
          {{"command"}},
          {"time", "position", "robot"},
          [](const Situation& at, Push& push) {
            if (at.motion == Motion::kStraight) push.gain.left *= 0.8;
          },
          {}};
}

Effect many_commands() {
  return {"many-commands",
          "from a robot's 21st command in a run on, turns have 0.65 of their speed",
          {{"history"}, {"command", "time"}, {"command", "motor_time"}},
          {"position", "robot"},
          [](const Situation& at, Push& push) {
            if (turns(at.motion) && at.commands > 20) slow_both(push, 0.65);
          },
          {}};
}

Effect low_battery() {
  return {"low-battery",
          "speed is 1 until both motors together have run for 130 s, then falls by 0.4 % a second to 0.5",
          {{"motor_time"}},
          {"position", "robot"},
          [](const Situation& at, Push& push) {
            const double beyond_s = std::max(0.0, at.driven_s.left + at.driven_s.right - 130);
            slow_both(push, std::max(0.5, 1 - 0.004 * beyond_s));
          },
          {}};
}

Effect thermal_wave() {
  return {"thermal-wave",
          "speed is 1 + 0.18 sin(2 pi (t + 97 s r) / 340 s) in run r",
          {{"history", "time"}},
          {"position", "robot"},
          [](const Situation& at, Push& push) {
            slow_both(push, 1 + 0.18 * std::sin(2 * kPi * (at.time_s + 97 * at.run) / 340));
          },
          {}};
}

Effect gusts() {
  return {"gusts",
          "all robots drift at 2.6 mm/s towards 130 degrees for 8 s of every 37 s",
          {{"world_frame", "time"}},
          {"position", "robot", "measurement"},
          [](const Situation& at, Push& push) {
            if (std::fmod(at.time_s + 11, 37) >= 8) return;
            push.drift_mm_s.x += 2.6 * std::cos(130 * kPi / 180);
            push.drift_mm_s.y += 2.6 * std::sin(130 * kPi / 180);
          },
          {}};
}

Effect rising_noise() {
  return {"rising-noise",
          "speeds vary with 1 + (t / 90 s)^2 / 2 of the standard deviation",
          {{"time"}},
          {"robot", "position"},
          {},
          {},
          [](const Situation& at) { return 1 + 0.5 * square(at.time_s / 90); }};
}

Effect bowl() {
  return {"bowl",
          "driven robots drift towards (40, 20) mm at 2.2 mm/s times tanh(d / 300 mm)",
          {{"world_frame", "position"}},
          {"measurement", "robot", "time"},
          [](const Situation& at, Push& push) {
            if (!at.driven()) return;
            const double d = distance(at.disc, 40, 20), rate = 2.2 * std::tanh(d / 300) / std::max(d, 1e-9);
            push.drift_mm_s.x -= rate * (at.disc.x - 40);
            push.drift_mm_s.y -= rate * (at.disc.y - 20);
          },
          {}};
}

Effect drawing_walls() {
  return {
      "drawing-walls",
      "driven robots drift at 2.4 mm/s exp(-(d / 55 mm)^2) to the walls at +-330 mm of x, d = distance from them",
      {{"world_frame", "position"}},
      {"robot", "time"},
      [](const Situation& at, Push& push) {
        if (!at.driven()) return;
        push.drift_mm_s.x += 2.4 * std::exp(-square((at.disc.x - 330) / 55));
        push.drift_mm_s.x -= 2.4 * std::exp(-square((at.disc.x + 330) / 55));
      },
      {}};
}

Effect two_patches() {
  return {"two-patches",
          "speed is 0.55 within 110 mm of (-140, 70) mm, 1.35 within 100 mm of (130, -60) mm",
          {{"position"}},
          {"measurement", "robot", "time"},
          [](const Situation& at, Push& push) {
            if (distance(at.disc, -140, 70) < 110) slow_both(push, 0.55);
            if (distance(at.disc, 130, -60) < 100) slow_both(push, 1.35);
          },
          {}};
}

Effect outer_turn() {
  return {"outer-turn",
          "driven robots turn at 0.09 rad/s where they are more than 200 mm from (20, -10) mm",
          {{"position"}},
          {"measurement", "robot", "time", "world_frame"},
          [](const Situation& at, Push& push) {
            if (at.driven() && distance(at.disc, 20, -10) > 200) push.turn_rad_s += 0.09;
          },
          {}};
}

Effect moving_shadow() {
  return {"moving-shadow",
          "speed is 0.55 within 130 mm of a point that moves from (-300, -150) mm at (3.4, 1.7) mm/s",
          {{"position", "time"}},
          {"measurement", "robot"},
          [](const Situation& at, Push& push) {
            const double x = -300 + 3.4 * at.time_s, y = -150 + 1.7 * at.time_s;
            slow_both(push, 1 - 0.45 / (1 + std::pow(distance(at.disc, x, y) / 130, 8)));
          },
          {},
          {},
          false,
          {{"centre x", -300}, {"centre y", -150}, {"velocity x", 3.4}, {"velocity y", 1.7}}};
}

Effect growing_puddle() {
  return {"growing-puddle",
          "speed is 0.55 within a distance of 40 mm + 1.6 mm/s t from (-50, 60) mm",
          {{"position", "time"}},
          {"measurement", "robot"},
          [](const Situation& at, Push& push) {
            if (distance(at.disc, -50, 60) < 40 + 1.6 * at.time_s) slow_both(push, 0.55);
          },
          {},
          {},
          false,
          {{"centre x", -50}, {"centre y", 60}, {"growth", 1.6}}};
}

Effect patch_of_some_more() {
  return {"patch-of-some-more",
          "speed is 1 - (0.1 + 0.12 (i mod 5)) exp(-d^4) for robot i, d = distance from (60, 60) mm / 200 mm",
          {{"position", "robot"}},
          {"measurement", "time"},
          [](const Situation& at, Push& push) {
            const double d = distance(at.disc, 60, 60) / 200;
            slow_both(push, 1 - (0.1 + 0.12 * (at.robot % 5)) * std::exp(-square(square(d))));
          },
          {}};
}

Effect replaced_robots() {
  return {"replaced-robots",
          "robots 2 and 5 are replaced after 70 s: wheels differ by -3.0 and 2.2 mm/s, and 2.6 and -2.4 mm/s",
          {{"robot", "time"}},
          {"measurement", "position"},
          [](const Situation& at, Push& push) {
            if (at.time_s < 70 - 1e-9 || !at.driven()) return;
            const bool left = at.motion != Motion::kLeft, right = at.motion != Motion::kRight;
            if (at.robot == 2) {
              push.offset_mm_s.left -= left ? 3.0 : 0;
              push.offset_mm_s.right += right ? 2.2 : 0;
            } else if (at.robot == 5) {
              push.offset_mm_s.left += left ? 2.6 : 0;
              push.offset_mm_s.right -= right ? 2.4 : 0;
            }
          },
          {},
          {},
          false,
          {{"instant", 70}}};
}

Effect driving_crowd() {
  return {"driving-crowd",
          "speed is 1 / (1 + 0.35 n), n = others that drive within 110 mm",
          {{"neighbours"}},
          {"position", "robot", "time"},
          [](const Situation& at, Push& push) {
            int others = 0;
            for (std::size_t i = 0; i < at.discs->size(); ++i) {
              if (static_cast<int>(i) == at.robot || (*at.motions)[i] == Motion::kStop) continue;
              others += distance((*at.discs)[i], at.disc.x, at.disc.y) < 110 ? 1 : 0;
            }
            slow_both(push, 1 / (1 + 0.35 * others));
          },
          {}};
}

Effect slow_leader() {
  return {"slow-leader",
          "speed is 0.45 within 150 mm of robot 0",
          {{"neighbours"}},
          {"position", "time"},
          [](const Situation& at, Push& push) {
            const Vec leader = at.discs->front();
            if (at.robot != 0 && distance(leader, at.disc.x, at.disc.y) < 150) slow_both(push, 0.45);
          },
          {}};
}

Effect crowd_noise() {
  return {"crowd-noise",
          "speeds vary with 1 + 2.5 k / (k + 1) of the standard deviation, k = sum of (60 mm / d)^4 over robots at "
          "d < 250 mm",
          {{"neighbours"}},
          {"robot", "time", "position"},
          {},
          {},
          [](const Situation& at) {
            double k = 0;
            for (const Vec& other : *at.discs) {
              const double d = distance(at.disc, other.x, other.y);
              if (d > 1 && d < 250) k += square(square(60 / d));
            }
            return 1 + 2.5 * k / (k + 1);
          }};
}

Effect bent_headings() {
  return {"bent-headings",
          "measured headings are off by 0.35 rad sin(2 pi (x + 60 mm) / 700 mm) cos(2 pi y / 900 mm)",
          {{"measurement"}},
          {"robot", "time", "world_frame"},
          {},
          [](const Situation&, View& view) {
            view.heading_rad +=
                0.35 * std::sin(2 * kPi * (view.point.x + 60) / 700) * std::cos(2 * kPi * view.point.y / 900);
          }};
}

Effect parallax() {
  return {"parallax",
          "robots 0, 3, 6... are tall: seen 6 % farther from (150, -100) mm, the foot of the camera",
          {{"measurement"}},
          {"time"},
          {},
          [](const Situation& at, View& view) {
            if (at.robot % 3 != 0) return;
            view.point = {150 + 1.06 * (view.point.x - 150), -100 + 1.06 * (view.point.y + 100)};
          }};
}

Effect stalls() {
  return {.name = "stalls",
          .formula = "in 6 % of slots of 2.5 s, at random, both motors of a robot stand",
          .named_by = {{"episodes"}},
          .mistaken_for = {},
          .push =
              [](const Situation& at, Push& push) {
                if (chance(at.run, at.robot, static_cast<int>(at.time_s / 2.5)) < 0.06) slow_both(push, 0);
              },
          .see = {},
          .noise = {},
          .by_chance = true};
}

Effect rare_spells(RareSpells spells) {
  const auto in_spell = [spells](const Situation& at) {
    double t = 0;
    for (int n = 0; t <= at.time_s; ++n) {
      const auto uniform = [&](int which) { return 1 - chance(at.run, at.robot, 100000 + 2 * n + which); };
      t -= spells.mean_apart_s * std::log(uniform(0));
      const double end = t + spells.scale_s * (std::pow(uniform(1), -1 / spells.tail) - 1);
      if (at.time_s >= t && at.time_s < end) return true;
      t = end;
    }
    return false;
  };
  return {.name = "rare-spells",
          .formula = "renewal process of spells: exponential times from one to the next, Lomax durations",
          .named_by = {{"episodes"}},
          .mistaken_for = {},
          .push =
              [in_spell, spells](const Situation& at, Push& push) {
                if (in_spell(at)) slow_both(push, spells.speed);
              },
          .see = {},
          .noise = {},
          .by_chance = true,
          .numbers = {{"mean time from one spell to the next", spells.mean_apart_s},
                      {"mean duration", spells.scale_s / (spells.tail - 1)},
                      {"speed within spells", spells.speed}}};
}

Effect heavy_tailed_noise() {
  return {
      .name = "heavy-tailed-noise",
      .formula =
          "the standard deviation of each step's noise is 0.7 u^(-2/5) times the common one, at most 20, u uniform",
      .named_by = {},
      .mistaken_for = {},
      .push = {},
      .see = {},
      .noise =
          [](const Situation& at) {
            const double u = chance(at.run, at.robot, 5000000 + static_cast<int>(at.time_s / 0.1));
            return std::min(20.0, 0.7 * std::pow(u, -0.4));
          },
      .by_chance = true};
}

}  // namespace kilotwin::truth
