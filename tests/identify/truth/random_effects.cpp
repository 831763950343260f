#include "tests/identify/truth/random_effects.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <functional>
#include <memory>
#include <utility>

#include "tests/identify/truth/dice.hpp"
#include "tests/identify/truth/effect_parts.hpp"
#include "tests/identify/truth/laboratories.hpp"

namespace kilotwin::truth {
namespace {

/// A function of one covariate, with values from 0 to 1.
struct Profile {
  std::string covariate;  ///< as in result.json
  std::string formula;
  std::function<double(const Situation&)> value;
};

struct Shape {
  std::string formula;  ///< of u, which is 0 to 1 over the range of a covariate
  std::function<double(double)> value;
};

/// A monotonous, stepped, humped or periodic function.
Shape drawn_shape(Dice& dice) {
  const double at = dice.between(0.25, 0.75);
  switch (dice.pick(6)) {
    case 0: return {"u", [](double u) { return std::clamp(u, 0.0, 1.0); }};
    case 1: return {fmt::format("1 where u > {:.2f}", at), [=](double u) { return u > at ? 1.0 : 0.0; }};
    case 2: {
      const double width = dice.between(0.08, 0.25);
      return {fmt::format("exp(-((u - {:.2f}) / {:.2f})^2)", at, width),
              [=](double u) { return std::exp(-square((u - at) / width)); }};
    }
    case 3: {
      const double waves = dice.between(0.8, 3), phase = dice.between(0, 2 * kPi);
      return {fmt::format("(1 + sin({:.2f} u + {:.2f})) / 2", 2 * kPi * waves, phase),
              [=](double u) { return 0.5 + 0.5 * std::sin(2 * kPi * waves * u + phase); }};
    }
    case 4: {
      const double scale = dice.between(0.1, 0.5);
      return {fmt::format("1 - exp(-u / {:.2f})", scale),
              [=](double u) { return 1 - std::exp(-std::max(0.0, u) / scale); }};
    }
    default: {
      const double width = dice.between(0.03, 0.15);
      return {fmt::format("1 / (1 + exp(-(u - {:.2f}) / {:.2f}))", at, width),
              [=](double u) { return 1 / (1 + std::exp(-(u - at) / width)); }};
    }
  }
}

Profile of_number(Dice& dice, const char* covariate, const char* what, double range,
                  double (*number)(const Situation&)) {
  const Shape shape = drawn_shape(dice);
  return {covariate, fmt::format("{}, u = {} / {:.0f}", shape.formula, what, range),
          [=](const Situation& at) { return shape.value(number(at) / range); }};
}

/// A patch, a half of the floor, or stripes.
Profile of_place(Dice& dice, const Scene& scene) {
  const double reach = scene.width_mm > 0 ? scene.width_mm / 2 : 350;
  const double angle = dice.between(0, 2 * kPi), x = dice.between(-0.5, 0.5) * reach,
               y = dice.between(-0.5, 0.5) * (scene.height_mm > 0 ? scene.height_mm / 2 : 350);
  switch (dice.pick(3)) {
    case 0: {
      const double radius = dice.between(0.3, 0.6) * reach;
      const int power = 2 * (1 + dice.pick(3));
      return {"position",
              fmt::format("1 / (1 + (d / {:.0f} mm)^{}), d from ({:.0f}, {:.0f}) mm", radius, power, x, y),
              [=](const Situation& at) {
                return 1 / (1 + std::pow(std::hypot(at.disc.x - x, at.disc.y - y) / radius, power));
              }};
    }
    case 1: {
      const double width = dice.between(0.02, 0.3) * reach;
      return {"position",
              fmt::format("logistic of ({:.2f} (x - {:.0f}) + {:.2f} (y - {:.0f})) / {:.0f} mm", std::cos(angle), x,
                          std::sin(angle), y, width),
              [=](const Situation& at) {
                return 1 / (1 + std::exp(-(std::cos(angle) * (at.disc.x - x) + std::sin(angle) * (at.disc.y - y)) /
                                         width));
              }};
    }
    default: {
      const double wave = dice.between(0.6, 2) * reach;
      return {"position", fmt::format("stripes of {:.0f} mm at {:.2f} rad", wave, angle), [=](const Situation& at) {
                return 0.5 +
                       0.5 * std::sin(2 * kPi / wave * (std::cos(angle) * at.disc.x + std::sin(angle) * at.disc.y));
              }};
    }
  }
}

Profile of_heading(Dice& dice) {
  const double phase = dice.between(0, 2 * kPi);
  const int folds = 1 + dice.pick(2);
  return {"heading", fmt::format("(1 + cos({} heading + {:.2f})) / 2", folds, phase),
          [=](const Situation& at) { return 0.5 + 0.5 * std::cos(folds * at.heading_rad + phase); }};
}

/// Some robots, all alike. The pattern repeats in a scene that was made larger than the laboratory.
Profile of_robots(Dice& dice, const Scene& scene) {
  auto some = std::make_shared<std::vector<double>>();
  std::string which;
  for (int i = 0; i < scene.robots; ++i) {
    some->push_back(dice.uniform() < 0.4 ? 1 : 0);
    if (some->back() > 0) which += fmt::format(" {}", i);
  }
  return {"robot", "1 for robots" + which,
          [=](const Situation& at) { return (*some)[static_cast<std::size_t>(at.robot) % some->size()]; }};
}

Profile of_commands(Dice& dice) {
  const int which = dice.pick(3);
  constexpr std::array kMotions = {Motion::kStraight, Motion::kLeft, Motion::kRight};
  constexpr std::array kNames = {"straight", "left", "right"};
  const auto index = static_cast<std::size_t>(which);
  return {"command", fmt::format("1 under {}", kNames[index]),
          [=](const Situation& at) { return at.motion == kMotions[index] ? 1.0 : 0.0; }};
}

Profile after_command(Dice& dice) {
  const int which = dice.pick(3);
  constexpr std::array kMotions = {Motion::kStop, Motion::kLeft, Motion::kRight};
  constexpr std::array kNames = {"a stop", "left", "right"};
  const auto index = static_cast<std::size_t>(which);
  const double decay_s = dice.between(1, 5);
  return {"history", fmt::format("exp(-s / {:.1f} s), s after {}", decay_s, kNames[index]),
          [=](const Situation& at) {
            return at.before == kMotions[index] ? std::exp(-at.since_change_s / decay_s) : 0.0;
          }};
}

Profile of_neighbours(Dice& dice) {
  const double reach = dice.between(45, 100);
  const bool count = dice.uniform() < 0.5;
  return {"neighbours",
          count ? fmt::format("share of 3 robots within {:.0f} mm", reach)
                : fmt::format("exp(-(d / {:.0f} mm)^2), d of the nearest robot", reach),
          [=](const Situation& at) {
            double nearest = 1e9;
            int within = 0;
            for (std::size_t j = 0; j < at.discs->size(); ++j) {
              if (static_cast<int>(j) == at.robot) continue;
              const double d = std::hypot((*at.discs)[j].x - at.disc.x, (*at.discs)[j].y - at.disc.y);
              nearest = std::min(nearest, d);
              within += d < reach ? 1 : 0;
            }
            return count ? std::min(within, 3) / 3.0 : std::exp(-square(nearest / reach));
          }};
}

/// `of_sight`: for what the camera shows, which depends neither on commands nor on motors.
Profile drawn_profile(Dice& dice, const Scene& scene, bool of_sight) {
  switch (dice.pick(of_sight ? 5 : 10)) {
    case 0: return of_number(dice, "time", "t", scene.train_s, [](const Situation& at) { return at.time_s; });
    case 1:
    case 2: return of_place(dice, scene);
    case 3: return of_robots(dice, scene);
    case 4: return of_heading(dice);
    case 5:
      return of_number(dice, "motor_time", "motor-on time of both wheels", scene.train_s,
                       [](const Situation& at) { return at.driven_s.left + at.driven_s.right; });
    case 6:
      return of_number(dice, "time_since_command", "time since the command", 10,
                       [](const Situation& at) { return at.since_change_s; });
    case 7: return of_commands(dice);
    case 8: return after_command(dice);
    default: return of_neighbours(dice);
  }
}

/// The action of an effect, times its value f.
struct Action {
  std::string words;
  std::string covariate;  ///< the one that names what it acts on; may be empty
  bool of_sight;
  std::function<void(const Situation&, double, Push&)> push;
  std::function<void(double, View&)> see;
};

Action drawn_action(Dice& dice, const Scene& scene) {
  const double sign = dice.uniform() < 0.5 ? -1 : 1, angle = dice.between(0, 2 * kPi);
  const double share = dice.uniform();
  if (share < 0.45) {
    const double by = sign < 0 ? dice.between(0.3, 0.7) : dice.between(0.3, 0.6);
    return {fmt::format("speed x (1 {} {:.2f} f)", sign < 0 ? '-' : '+', by),
            "",
            false,
            [=](const Situation&, double f, Push& push) { slow_both(push, 1 + sign * by * f); },
            {}};
  }
  if (share < 0.55) {
    const double by = dice.between(0.15, 0.4);
    return {fmt::format("speed of the left wheel x (1 {} {:.2f} f)", sign < 0 ? '-' : '+', by),
            "",
            false,
            [=](const Situation&, double f, Push& push) { push.gain.left *= 1 + sign * by * f; },
            {}};
  }
  if (share < 0.7) {
    const double by = sign * dice.between(0.08, 0.25);
    return {fmt::format("turns by {:.2f} f rad/s where a motor is on", by),
            "",
            false,
            [=](const Situation& at, double f, Push& push) {
              if (at.driven()) push.turn_rad_s += by * f;
            },
            {}};
  }
  if (share < 0.8) {
    const double by = dice.between(1.5, 4);
    return {fmt::format("drifts by {:.1f} f mm/s towards {:.2f} rad, where a motor is on", by, angle),
            "world_frame",
            false,
            [=](const Situation& at, double f, Push& push) {
              if (!at.driven()) return;
              push.drift_mm_s.x += by * f * std::cos(angle);
              push.drift_mm_s.y += by * f * std::sin(angle);
            },
            {}};
  }
  if (share < 0.87) {
    const double by = sign * dice.between(1.5, 4);
    return {fmt::format("slips by {:.1f} f mm/s to the left, where a motor is on", by),
            "",
            false,
            [=](const Situation& at, double f, Push& push) {
              if (at.driven()) push.slip_mm_s.y += by * f;
            },
            {}};
  }
  if (share < 0.95 || !scene.heading) {
    const double by = dice.between(8, 20);
    return {fmt::format("seen {:.0f} f mm towards {:.2f} rad", by, angle),
            "measurement",
            true,
            {},
            [=](double f, View& view) {
              view.point.x += by * f * std::cos(angle);
              view.point.y += by * f * std::sin(angle);
            }};
  }
  const double by = sign * dice.between(0.15, 0.35);
  return {fmt::format("seen turned by {:.2f} f rad", by), "measurement", true, {}, [=](double f, View& view) {
            view.heading_rad += by * f;
          }};
}

Effect drawn_effect(Dice& dice, const Scene& scene, const std::string& name) {
  const Action action = drawn_action(dice, scene);
  std::vector<Profile> profiles{drawn_profile(dice, scene, action.of_sight)};
  // A product of two.
  if (dice.uniform() < 0.35) {
    Profile other = drawn_profile(dice, scene, action.of_sight);
    if (other.covariate != profiles.front().covariate) profiles.push_back(std::move(other));
  }
  // A displacement that is constant for a robot, or for good, cannot be seen.
  if (action.of_sight && profiles.size() == 1 && profiles.front().covariate == "robot")
    profiles.front() = of_place(dice, scene);
  Effect effect;
  effect.name = name;
  Covariates all;
  if (action.covariate == "measurement") all.emplace_back(action.covariate);
  std::string formula = action.words + ", f = ";
  for (const Profile& profile : profiles) {
    all.push_back(profile.covariate);
    if (&profile != &profiles.front()) formula += "; times ";
    formula += profile.formula;
  }
  effect.formula = formula;
  effect.named_by = {all};
  const auto value = [profiles](const Situation& at) {
    double f = 1;
    for (const Profile& profile : profiles) f *= profile.value(at);
    return f;
  };
  if (action.push)
    effect.push = [=](const Situation& at, Push& push) { action.push(at, value(at), push); };
  else
    effect.see = [=](const Situation& at, View& view) { action.see(value(at), view); };
  return effect;
}

Scene drawn_laboratory(Dice& dice) {
  constexpr std::array kLaboratories = {tidy_lab, tidy_lab, blind_lab, brisk_lab, crowded_lab, plain_lab, poor_lab};
  return kLaboratories[static_cast<std::size_t>(dice.pick(static_cast<int>(kLaboratories.size())))]();
}

}  // namespace

Scene random_effects(std::uint64_t seed) {
  Dice dice(seed ^ 0x72616e646f6d);
  Scene scene = drawn_laboratory(dice);
  scene.name = fmt::format("random-{}", seed);
  const int effects = dice.uniform() < 1.0 / 3 ? 2 : 1;
  for (int i = 0; i < effects; ++i) {
    scene.effects.push_back(drawn_effect(dice, scene, fmt::format("effect {}", i + 1)));
    scene.about += (i > 0 ? " | " : "") + scene.effects.back().formula;
  }
  return scene;
}

}  // namespace kilotwin::truth
