#include "tests/identify/coverage.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>

#include "core/stats/clusters.hpp"
#include "core/stats/distributions.hpp"
#include "core/stats/moments.hpp"
#include "tests/identify/truth/dice.hpp"
#include "tests/identify/truth/world.hpp"
#include "tests/identify/verdict.hpp"

namespace kilotwin::truth {
namespace {

using nlohmann::json;

/// A situation with what it points to.
struct Place {
  Situation at;
  std::vector<Vec> discs;
  std::vector<Motion> motions;
};

/// A robot with others beside it, over a count of neighbours or the distance of the nearest one. All drive.
std::optional<Place> among_others(const json& axis, double value) {
  const double radius_mm = axis.value("radius_mm", 0.0);
  if (axis.contains("other_robot") || axis.value("others", "") == "resting") return std::nullopt;
  int others = 0;
  double distance_mm = 0;
  constexpr double kWhole = 1e-6, kInside = 0.9;
  if (axis.at("of") == "neighbours" && std::abs(value - std::round(value)) < kWhole) {
    others = static_cast<int>(std::round(value));
    distance_mm = kInside * radius_mm;
  } else if (axis.at("of") == "nearest" && value < radius_mm - kWhole) {
    others = 1;
    distance_mm = value;
  } else {
    return std::nullopt;
  }
  Place place;
  place.discs.push_back({0, 0});
  for (int i = 0; i < others; ++i) place.discs.push_back({distance_mm, 0});
  place.motions.assign(place.discs.size(), Motion::kStraight);
  return place;
}

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

std::optional<Place> place_at(const std::string& covariate, const json& axis, const json& at) {
  if (covariate == "neighbours" && axis.contains("of") && at.is_number()) {
    std::optional<Place> place = among_others(axis, at.get<double>());
    if (place) place->at = *situation_at("time", 0);
    return place;
  }
  const std::optional<Situation> situation = situation_at(covariate, at);
  return situation ? std::optional(Place{*situation, {}, {}}) : std::nullopt;
}

/// The relative change of both wheels' speeds. Nothing if the effects act otherwise.
std::optional<double> change_of_speed(const Scene& scene, const Place& place) {
  Situation at = place.at;
  at.discs = &place.discs;
  at.motions = &place.motions;
  Push push;
  for (const Effect& effect : scene.effects)
    if (effect.push) effect.push(at, push);
  const bool alike = push.gain.left == push.gain.right && push.turn_rad_s == 0 && push.slip_mm_s.x == 0 &&
                     push.slip_mm_s.y == 0 && push.drift_mm_s.x == 0 && push.drift_mm_s.y == 0 &&
                     push.offset_mm_s.left == 0 && push.offset_mm_s.right == 0;
  return alike ? std::optional(push.gain.left - 1) : std::nullopt;
}

/// A point of a band of relative changes.
struct BandPoint {
  double truth, value, low, high;
};

/// The band of the effect found, with the true changes. Empty if there is no band, if several effects were found, or if the true
/// effect does not change both wheels alike.
std::vector<BandPoint> band_of(const Scene& scene, const json& result) {
  std::vector<BandPoint> points;
  const json& effects = result.at("effects");
  if (effects.size() != 1 || effects[0].at("covariates").size() != 1) return points;
  if (!effects[0].at("name").get<std::string>().starts_with("speed-by-")) return points;
  const std::string covariate = effects[0].at("covariates")[0];
  // Over another covariate, the truth has no curve to compare.
  const bool named = std::any_of(scene.effects.begin(), scene.effects.end(),
                                 [&](const Effect& effect) { return names(effect, {covariate}); });
  if (!named) return points;
  const json bands = effects[0].at("parameters").value("bands_95", json::array());
  for (const json& band : bands) {
    // Of a sum over several functions of the neighbours no one band has the values.
    if (covariate == "neighbours" && bands.size() > 1) break;
    const json axis = band.value("axes", json::array()).size() == 1 ? band["axes"][0] : json::object();
    if (axis.contains("forget_s")) continue;  // not the time since the start
    for (std::size_t i = 0; i < band.at("at").size(); ++i) {
      const std::optional<Place> at = place_at(covariate, axis, band.at("at")[i]);
      if (const std::optional<double> truth = at ? change_of_speed(scene, *at) : std::nullopt)
        points.push_back({*truth, band.at("value")[i], band.at("low")[i], band.at("high")[i]});
    }
  }
  return points;
}

/// The model's curves are relative to a mean speed of the data, the true ones to that of an undisturbed robot. This factor turns true
/// speeds and biases into those of the model: the mean over the band, weighted by its precision.
double level_of(const std::vector<BandPoint>& band) {
  double sum = 0, weights = 0;
  for (const BandPoint& p : band) {
    const double weight = 1 / ((p.high - p.low) * (p.high - p.low));
    sum += weight * (1 + p.truth) / (1 + p.value);
    weights += weight;
  }
  return band.empty() ? 1 : sum / weights;
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
  Share& share = intervals_[parameter][set];
  const bool holds = low <= truth && truth <= high;
  if (!holds) fmt::print("{}: {} is {:.6g}, not in {:.6g}..{:.6g}\n", set, parameter, truth, low, high);
  share.held += holds ? 1 : 0;
  ++share.all;
}

void Coverage::add_numbers(const Scene& scene, const json& result) {
  for (const Effect& effect : scene.effects) {
    for (const auto& [name, truth] : effect.numbers) {
      // Of several steps, the one nearest to the true one.
      const json* best = nullptr;
      for (const json& found : result.at("effects")) {
        if (!found.contains("numbers")) continue;
        for (const json& number : found["numbers"])
          if (number.at("name") == name &&
              (best == nullptr || std::abs(number.at("value").get<double>() - truth) <
                                      std::abs(best->at("value").get<double>() - truth)))
            best = &number;
      }
      if (best == nullptr) {
        ++without_number_[name];
        continue;
      }
      std::string word = name;
      std::replace(word.begin(), word.end(), ' ', '_');
      add_interval(scene.name, word, truth, best->value("low", -INFINITY), best->value("high", INFINITY));
    }
  }
}

void Coverage::add_walls(const Scene& scene, const json& result) {
  if (!result.contains("walls_low") || !result.contains("walls_high") || scene.width_mm <= 0) return;
  for (const char* side : {"x_low_mm", "x_high_mm", "y_low_mm", "y_high_mm"}) {
    const json &low = result["walls_low"], &high = result["walls_high"];
    if (!low.contains(side) || !high.contains(side) || low[side].is_null() || high[side].is_null()) continue;
    const double half_mm = (side[0] == 'x' ? scene.width_mm : scene.height_mm) / 2 - kDiscRadius_mm;
    add_interval(scene.name, "wall_mm", side[2] == 'l' ? -half_mm : half_mm, low[side], high[side]);
  }
}

void Coverage::add(const std::string& kind, const Scene& scene, const Play& played,
                   const std::filesystem::path& out) {
  std::ifstream in(out / "result.json");
  const json result = json::parse(in);
  const std::vector<BandPoint> band = scene.effects.empty() ? std::vector<BandPoint>{} : band_of(scene, result);
  const double level = level_of(band);
  if (!band.empty()) {
    Share& points =
        bands_[fmt::format("{}, {}", kind, result.at("effects")[0].at("name").get<std::string>())].emplace_back();
    for (const BandPoint& p : band) {
      const double truth = (1 + p.truth) / level - 1;
      points.held += p.low <= truth && truth <= p.high ? 1 : 0;
      ++points.all;
    }
  } else if (!scene.effects.empty()) {
    ++without_band_[kind];
  }
  const auto with_sd = [&](const char* parameter, double truth, double value, double sd) {
    add_interval(scene.name, parameter, truth, value - stats::kNormal95 * sd, value + stats::kNormal95 * sd);
  };
  const auto base = [&](const char* parameter, double truth) {
    with_sd(parameter, truth, result.at("base").at(parameter), result.at("base_sd").at(parameter));
  };
  const auto noise = [&](const char* parameter, double truth) {
    const json &low = result.at("noise_low").at(parameter), &high = result.at("noise_high").at(parameter);
    // Null: a variance that may be as large as any.
    add_interval(scene.name, parameter, truth, low, high.is_null() ? INFINITY : high.get<double>());
  };
  add_numbers(scene, result);
  add_walls(scene, result);
  base("wheel_base_mm", scene.wheel_base_mm);
  base("tracked_point_ahead_mm", scene.tracked_ahead_mm);
  base("tracked_point_left_mm", 0);
  noise("tracker_position_sd_mm", scene.tracker_sd_mm);
  if (scene.heading) noise("tracker_heading_sd_rad", scene.heading_sd_rad);
  noise("factor_variance_s", scene.factor_sd * scene.factor_sd * scene.step_s);
  if (!scene.effects.empty() && band.empty()) return;
  base("straight_speed_mm_s", level * scene.straight_mm_s);
  base("turn_speed_mm_s", level * scene.turn_mm_s);
  base("bias_mean_mm_s", level * scene.bias_mean_mm_s);
  for (const json& robot : result.at("robots")) {
    const Wheels<double>& bias = played.individuals.at(robot.at("robot").get<std::size_t>()).bias_mm_s;
    with_sd("bias_left_mm_s", level * bias.left, robot.at("bias_left_mm_s"), robot.at("sd_left_mm_s"));
    with_sd("bias_right_mm_s", level * bias.right, robot.at("bias_right_mm_s"), robot.at("sd_right_mm_s"));
  }
}

Coverage::Share Coverage::points_of(const std::string& band) const {
  Share sum;
  const auto sets = bands_.find(band);
  if (sets == bands_.end()) return sum;
  for (const Share& set : sets->second) sum = {sum.held + set.held, sum.all + set.all};
  return sum;
}

Coverage::Share Coverage::intervals_of(const std::string& parameter) const {
  Share sum;
  const auto sets = intervals_.find(parameter);
  if (sets == intervals_.end()) return sum;
  for (const auto& [set, share] : sets->second) sum = {sum.held + share.held, sum.all + share.all};
  return sum;
}

void Coverage::print() const {
  for (const auto& [parameter, sets] : intervals_) {
    // The intervals of one set depend on each other.
    std::vector<stats::Cluster> clusters;
    for (const auto& [set, share] : sets)
      clusters.push_back({static_cast<double>(share.held), static_cast<double>(share.all)});
    const auto [low, high] = stats::wilson_interval(clusters);
    const Share all = intervals_of(parameter);
    fmt::print("{:24} {:5} of {:5} intervals hold the truth: {:.1f} %, 95 % interval {:.1f} to {:.1f}\n", parameter,
               all.held, all.all, 100.0 * all.held / all.all, 100 * low, 100 * high);
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
  for (const auto& [number, sets] : without_number_) fmt::print("{}: {} sets without this number\n", number, sets);
  for (const auto& [kind, sets] : without_band_) fmt::print("{}: {} sets without a band to compare\n", kind, sets);
}

}  // namespace kilotwin::truth
