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
  if (is_of_some(axis)) return std::nullopt;
  switch (axis.of) {
    case Covariate::kTime: s.time_s = value; return s;
    case Covariate::kX: s.x_mm = value; return s;
    case Covariate::kY: s.y_mm = value; return s;
    case Covariate::kPointDistance:
      // A place as far from the centre at the start, or at the centre when the circle has grown that much.
      if (value >= 0) {
        s.x_mm = axis.point.x_mm + value;
        s.y_mm = axis.point.y_mm;
        return s;
      }
      if (!(axis.point.growth_mm_s > 0)) return std::nullopt;
      s.time_s = -value / axis.point.growth_mm_s;
      s.x_mm = axis.point.x_mm + axis.point.velocity_x_mm_s * s.time_s;
      s.y_mm = axis.point.y_mm + axis.point.velocity_y_mm_s * s.time_s;
      return s;
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
    case Covariate::kMotorTimeSum: s.commands.motor_s = {0, value}; return s;
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
    case Shape::kWave: return {0, kBeyond * largest()};
    case Shape::kAtLeast:
      // Steps over places and distances lie within the range of the curve that they replaced.
      if (factor.low < factor.points.front() && largest() < factor.high) return {factor.low, factor.high};
      return {0, kBeyond * largest()};
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

/// The blocks of a term that act on one target under the same commands: their values add up.
using Group = std::vector<std::size_t>;
std::vector<Group> groups_of(const Term& term) {
  std::vector<Group> groups;
  for (std::size_t b = 0; b < term.blocks.size(); ++b) {
    const Block& block = term.blocks[b];
    const auto with = std::find_if(groups.begin(), groups.end(), [&](const Group& group) {
      const Block& first = term.blocks[group.front()];
      return first.target == block.target && first.during == block.during;
    });
    (with == groups.end() ? groups.emplace_back() : *with).push_back(b);
  }
  return groups;
}

/// Whether a basis is one function of coefficients that were estimated, and depends on what `fits` accepts.
template <class Fits> bool is_open(const Basis& basis, Fits&& fits) {
  if (basis.factors.empty()) return true;
  const Factor& factor = basis.factors.front();
  return basis.factors.size() == 1 && factor.known.empty() && factor.shape != Shape::kTravelling &&
         factor.shape != Shape::kGrid && fits(factor);
}

/// The sum of a group at a situation.
ValueWithSd sum_of(const MotionModel& model, std::size_t t, const Group& group, const Situation& at,
                   const Eigen::MatrixXd& covariance) {
  const Term& term = model.terms[t];
  Eigen::VectorXd columns = Eigen::VectorXd::Zero(term.coefficients.size());
  Eigen::Index first = 0;
  for (std::size_t b = 0; b < term.blocks.size(); ++b) {
    const Basis& basis = term.blocks[b].basis;
    const auto own = static_cast<Eigen::Index>(basis.size());
    if (std::find(group.begin(), group.end(), b) != group.end()) {
      std::array<double, kMostColumns> values;  // evaluate() needs room for products that are not in use, too
      basis.evaluate(at, 0, values.data());
      columns.segment(first, own) = Eigen::Map<const Eigen::VectorXd>(values.data(), own);
    }
    first += own;
  }
  Eigen::Index before = kBaseColumns;
  for (std::size_t k = 0; k < t; ++k) before += model.terms[k].coefficients.size();
  const Eigen::Index n = columns.size();
  const double variance = columns.dot(covariance.block(before, before, n, n) * columns);
  return {columns.dot(term.coefficients), std::sqrt(std::max(0.0, variance))};
}

double factor_of(const std::string& unit) { return unit == "%" ? 100 : unit == "degrees" ? 180 / M_PI : 1; }

/// Values with their standard deviations, if they are the drawn ones.
struct Drawn {
  std::vector<double> value;
  std::vector<Situation> at;
  double factor;
};
std::optional<std::vector<double>> sd_of(const Drawn& drawn, const MotionModel& model, std::size_t term,
                                         const Group& group, const Eigen::MatrixXd& covariance) {
  constexpr double kAlike = 0.03;  // of the largest value: splines through knots of the basis
  double most = 0, off = 0;
  std::vector<double> sd;
  for (std::size_t i = 0; i < drawn.value.size(); ++i) {
    const ValueWithSd v = sum_of(model, term, group, drawn.at[i], covariance);
    most = std::max(most, std::abs(drawn.value[i]));
    off = std::max(off, std::abs(drawn.factor * v.value - drawn.value[i]));
    sd.push_back(drawn.factor * v.sd);
  }
  return off <= kAlike * most ? std::optional(sd) : std::nullopt;
}

}  // namespace

void set_band(identification::EffectCurve& curve, const MotionModel& model, std::size_t term,
              const Uncertainty& uncertainty) {
  for (const Group& group : groups_of(model.terms[term])) {
    const auto& blocks = model.terms[term].blocks;
    if (blocks[group.front()].basis.factors.empty()) continue;
    const Axis axis = blocks[group.front()].basis.factors.front().axis;
    const auto along = [&](const Factor& factor) { return !factor.of_two() && factor.axis == axis; };
    if (!std::all_of(group.begin(), group.end(), [&](std::size_t b) { return is_open(blocks[b].basis, along); }))
      continue;
    Drawn drawn{{curve.value().begin(), curve.value().end()}, {}, factor_of(curve.acts_on_unit())};
    for (int i = 0; i < curve.at_size(); ++i) {
      // The lower of two values at a step holds before it.
      constexpr double kBefore = 1e-6;
      const double before = i + 1 < curve.at_size() && curve.at(i + 1) == curve.at(i) ? kBefore : 0;
      if (const auto s = situation_at(axis, curve.at(i) / factor_of(curve.unit()) - before)) drawn.at.push_back(*s);
    }
    if (drawn.at.size() != drawn.value.size()) continue;
    const auto sd = sd_of(drawn, model, term, group, uncertainty.covariance);
    if (!sd) continue;
    for (int i = 0; i < curve.at_size(); ++i) {
      const double half = stats::kNormal95 * (*sd)[static_cast<std::size_t>(i)];
      curve.add_low(curve.value(i) - half);
      curve.add_high(curve.value(i) + half);
    }
    return;
  }
}

void set_band(identification::EffectMap& map, const MotionModel& model, std::size_t term,
              const Uncertainty& uncertainty) {
  Drawn drawn{{}, {}, factor_of(map.unit())};
  for (int j = 0; j < map.y_mm_size(); ++j) {
    for (int i = 0; i < map.x_mm_size(); ++i) {
      Situation& s = drawn.at.emplace_back();
      s.x_mm = map.x_mm(i);
      s.y_mm = map.y_mm(j);
      drawn.value.push_back(map.effect(j).values(i).number_value());
    }
  }
  const auto of_place = [](const Factor& factor) {
    const auto is = [](const Axis& axis) { return axis.of == Covariate::kX || axis.of == Covariate::kY; };
    return is(factor.axis) && (!factor.of_two() || is(factor.and_axis));
  };
  for (const Group& group : groups_of(model.terms[term])) {
    const auto& blocks = model.terms[term].blocks;
    if (!std::all_of(group.begin(), group.end(), [&](std::size_t b) { return is_open(blocks[b].basis, of_place); }))
      continue;
    const auto sd = sd_of(drawn, model, term, group, uncertainty.covariance);
    if (!sd) continue;
    for (int j = 0; j < map.y_mm_size(); ++j) {
      JsonList &low = *map.add_low(), &high = *map.add_high();
      for (int i = 0; i < map.x_mm_size(); ++i) {
        const auto at = static_cast<std::size_t>(j * map.x_mm_size() + i);
        *low.add_values() = json_value(drawn.value[at] - stats::kNormal95 * (*sd)[at]);
        *high.add_values() = json_value(drawn.value[at] + stats::kNormal95 * (*sd)[at]);
      }
    }
    return;
  }
}

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
