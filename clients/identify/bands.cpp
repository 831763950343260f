#include "clients/identify/bands.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "core/stats/distributions.hpp"

namespace kilotwin::identify {
namespace {

using Shape = Factor::Shape;

/// A value at which a band is given, and a situation with it.
struct Place {
  JsonValue at;
  Situation situation;
};

/// A situation with a value of one covariate; nothing for covariates that depend on the other robots or on decayed time.
std::optional<Situation> situation_at(const Axis& axis, double value) {
  Situation s;
  switch (axis.of) {
    case Covariate::kTime: s.time_s = value; return s;
    case Covariate::kX: s.x_mm = value; return s;
    case Covariate::kY: s.y_mm = value; return s;
    case Covariate::kHeading: s.heading_rad = value; return s;
    case Covariate::kSinceCommand: s.commands.since_s = value; return s;
    case Covariate::kSinceRest: s.commands.since_rest_s = value; return s;
    case Covariate::kRobot: s.robot = static_cast<std::uint32_t>(value); return s;
    case Covariate::kCommand: s.commands.command = static_cast<Motion>(value); return s;
    case Covariate::kNearest: s.near.nearest_mm = value; return s;
    case Covariate::kMotorTime:
    case Covariate::kLeftMotorTime:
    case Covariate::kRightMotorTime:
    case Covariate::kDrivenTime:
      if (axis.decay_index > 0) return std::nullopt;
      s.commands.motor_s = {value, value};
      s.commands.driven_s = value;
      return s;
    default: return std::nullopt;
  }
}

/// The range of a curve. Those of exponentials and steps follow from their points.
std::pair<double, double> range_of(const Factor& factor) {
  const auto largest = [&] { return *std::max_element(factor.points.begin(), factor.points.end()); };
  constexpr double kDecayed = 3, kBeyond = 1.25;
  switch (factor.shape) {
    case Shape::kHarmonics: return {-M_PI, M_PI};
    case Shape::kExponential:
    case Shape::kLevelling: return {0, kDecayed * largest()};
    case Shape::kAtLeast:
    case Shape::kWave: return {0, kBeyond * largest()};
    default: return {factor.low, factor.high};
  }
}

std::vector<Place> places_of_curve(const Factor& factor) {
  constexpr int kPlaces = 21;
  std::vector<double> at;
  if (factor.shape == Shape::kTable) {
    at = factor.points;
  } else {
    const auto [low, high] = range_of(factor);
    for (int i = 0; i < kPlaces; ++i) at.push_back(low + (high - low) * i / (kPlaces - 1));
  }
  std::vector<Place> places;
  for (const double value : at)
    if (const std::optional<Situation> s = situation_at(factor.axis, value))
      places.push_back({json_value(value), *s});
  return places;
}

std::vector<Place> places_of_map(const Factor& factor) {
  constexpr int kAcross = 9;
  std::vector<Place> places;
  for (int j = 0; j < kAcross; ++j) {
    for (int i = 0; i < kAcross; ++i) {
      Situation s;
      s.x_mm = factor.low + (factor.high - factor.low) * i / (kAcross - 1);
      s.y_mm = factor.and_low + (factor.and_high - factor.and_low) * j / (kAcross - 1);
      places.push_back({json_value(json_list(std::array{s.x_mm, s.y_mm})), s});
    }
  }
  return places;
}

std::vector<Place> places_of(const Basis& basis) {
  if (basis.factors.empty()) return {{json_null(), Situation{}}};
  const Factor& factor = basis.factors.front();
  // The one coefficient of a grid scales a map whose values are fixed: its error says nothing about them.
  if (basis.factors.size() > 1 || factor.shape == Shape::kTravelling || factor.shape == Shape::kGrid) return {};
  if (!factor.of_two()) return places_of_curve(factor);
  return factor.axis.of == Covariate::kX && factor.and_axis.of == Covariate::kY ? places_of_map(factor)
                                                                                : std::vector<Place>{};
}

}  // namespace

JsonList bands_of(const MotionModel& model, std::size_t term, const Uncertainty& uncertainty) {
  JsonList bands;
  for (std::size_t b = 0; b < model.terms[term].blocks.size(); ++b) {
    JsonList at, value, low, high;
    for (const Place& place : places_of(model.terms[term].blocks[b].basis)) {
      const ValueWithSd v = value_of(model, term, b, place.situation, uncertainty.covariance);
      *at.add_values() = place.at;
      *value.add_values() = json_value(v.value);
      *low.add_values() = json_value(v.value - stats::kNormal95 * v.sd);
      *high.add_values() = json_value(v.value + stats::kNormal95 * v.sd);
    }
    if (at.values().empty()) continue;
    auto& band = *bands.add_values()->mutable_struct_value()->mutable_fields();
    band["block"] = json_value(b + 1);
    band["at"] = json_value(std::move(at));
    band["value"] = json_value(std::move(value));
    band["low"] = json_value(std::move(low));
    band["high"] = json_value(std::move(high));
  }
  return bands;
}

}  // namespace kilotwin::identify
