#include "tests/identify/coverage.hpp"

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>

#include "core/stats/distributions.hpp"
#include "core/stats/moments.hpp"
#include "tests/identify/truth/dice.hpp"

namespace kilotwin::truth {
namespace {

using nlohmann::json;

/// A situation of a robot that drives straight ahead, with a value of the covariate of a band.
std::optional<Situation> situation_at(const std::string& covariate, const json& at) {
  Situation s;
  s.motion = Motion::kStraight;
  s.since_change_s = s.since_rest_s = 30;
  if (covariate == "position" && at.is_array() && at.size() == 2) {
    s.disc = {at[0], at[1]};
    return s;
  }
  if (!at.is_number()) return std::nullopt;
  if (covariate == "time")
    s.time_s = at;
  else if (covariate == "heading")
    s.heading_rad = at;
  else if (covariate == "time_since_command")
    s.since_change_s = at;
  else if (covariate == "motor_time")
    s.driven_s = {at, at};
  else
    return std::nullopt;
  return s;
}

/// The relative change of both wheels' speeds. Nothing if the effects act otherwise.
std::optional<double> change_of_speed(const Scene& scene, const Situation& at) {
  Push push;
  for (const Effect& effect : scene.effects)
    if (effect.push) effect.push(at, push);
  const bool alike = push.gain.left == push.gain.right && push.turn_rad_s == 0 && push.slip_mm_s.x == 0 &&
                     push.slip_mm_s.y == 0 && push.drift_mm_s.x == 0 && push.drift_mm_s.y == 0 &&
                     push.offset_mm_s.left == 0 && push.offset_mm_s.right == 0;
  return alike ? std::optional(push.gain.left - 1) : std::nullopt;
}

json result_in(const std::filesystem::path& out) {
  std::ifstream in(out / "result.json");
  return json::parse(in);
}

}  // namespace

Scene with_drawn_parameters(Scene scene, std::uint64_t seed) {
  Dice dice(seed ^ 0x636f766572);
  scene.wheel_base_mm += 2 * dice.normal();
  scene.straight_mm_s += 1 * dice.normal();
  scene.turn_mm_s += 2 * dice.normal();
  scene.bias_mean_mm_s += scene.bias_sd_mm_s / 2 * dice.normal();
  return scene;
}

void Coverage::add_interval(const std::string& set, const std::string& parameter, double truth, double low,
                            double high) {
  Share& share = intervals_[parameter];
  const bool holds = low <= truth && truth <= high;
  if (!holds) fmt::print("{}: {} is {:.6g}, not in {:.6g}..{:.6g}\n", set, parameter, truth, low, high);
  share.held += holds ? 1 : 0;
  ++share.all;
}

void Coverage::add(const std::string& kind, const Scene& scene, const Play& played,
                   const std::filesystem::path& out) {
  const json result = result_in(out);
  const auto with_sd = [&](const char* parameter, double truth, double value, double sd) {
    add_interval(scene.name, parameter, truth, value - stats::kNormal95 * sd, value + stats::kNormal95 * sd);
  };
  const auto base = [&](const char* parameter, double truth) {
    with_sd(parameter, truth, result.at("base").at(parameter), result.at("base_sd").at(parameter));
  };
  base("straight_speed_mm_s", scene.straight_mm_s);
  base("turn_speed_mm_s", scene.turn_mm_s);
  base("wheel_base_mm", scene.wheel_base_mm);
  base("tracked_point_ahead_mm", scene.tracked_ahead_mm);
  base("tracked_point_left_mm", 0);
  const auto noise = [&](const char* parameter, double truth) {
    const json &low = result.at("noise_low").at(parameter), &high = result.at("noise_high").at(parameter);
    // Null: a variance that may be as large as any.
    add_interval(scene.name, parameter, truth, low, high.is_null() ? INFINITY : high.get<double>());
  };
  noise("tracker_position_sd_mm", scene.tracker_sd_mm);
  if (scene.heading) noise("tracker_heading_sd_rad", scene.heading_sd_rad);
  noise("factor_variance_s", scene.factor_sd * scene.factor_sd * scene.step_s);
  for (const json& robot : result.at("robots")) {
    const Wheels<double>& bias = played.individuals.at(robot.at("robot").get<std::size_t>()).bias_mm_s;
    with_sd("bias_left_mm_s", bias.left, robot.at("bias_left_mm_s"), robot.at("sd_left_mm_s"));
    with_sd("bias_right_mm_s", bias.right, robot.at("bias_right_mm_s"), robot.at("sd_right_mm_s"));
  }
  if (!scene.effects.empty()) add_band(kind, scene, out);
}

void Coverage::add_band(const std::string& kind, const Scene& scene, const std::filesystem::path& out) {
  const json effects = result_in(out).at("effects");
  Share points;
  std::string name;
  if (effects.size() == 1 && effects[0].at("covariates").size() == 1) {
    name = effects[0].at("name");
    const std::string covariate = effects[0].at("covariates")[0];
    for (const json& band : effects[0].at("parameters").value("bands_95", json::array())) {
      for (std::size_t i = 0; i < band.at("at").size() && name.starts_with("speed-by-"); ++i) {
        const std::optional<Situation> at = situation_at(covariate, band.at("at")[i]);
        const std::optional<double> truth = at ? change_of_speed(scene, *at) : std::nullopt;
        if (!truth) continue;
        points.held += band.at("low")[i] <= *truth && *truth <= band.at("high")[i] ? 1 : 0;
        ++points.all;
      }
    }
  }
  if (points.all > 0)
    bands_[kind + ", " + name].push_back(points);
  else
    ++without_band_[kind];
}

void Coverage::print() const {
  for (const auto& [parameter, share] : intervals_) {
    const auto [low, high] = stats::wilson_interval(share.held, share.all);
    fmt::print("{:24} {:5} of {:5} intervals hold the truth: {:.1f} %, 95 % interval {:.1f} to {:.1f}\n", parameter,
               share.held, share.all, 100.0 * share.held / share.all, 100 * low, 100 * high);
  }
  for (const auto& [band, sets] : bands_) {
    // The points of one band depend on each other: the sets are the sample.
    stats::Moments shares;
    int points = 0;
    for (const Share& set : sets) {
      shares.add(100.0 * set.held / set.all);
      points += set.all;
    }
    fmt::print("{}: bands of {} sets hold the truth at {:.1f} % of {} points, standard error {:.1f}\n", band,
               sets.size(), shares.mean(), points, shares.standard_error());
  }
  for (const auto& [kind, sets] : without_band_) fmt::print("{}: {} sets without a band to compare\n", kind, sets);
}

}  // namespace kilotwin::truth
