#include "clients/identify/bands.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

#include "clients/identify/fit/term_values.hpp"
#include "core/stats/distributions.hpp"

namespace kilotwin::identify {
namespace {

using Shape = Factor::Shape;

/// A value of a term with the ends of its 95 % interval.
struct BandPoint {
  double value, low, high;
};

/// Values of a term, with the uncertainty of where it steps and of where a map has edges.
class TermBand {
 public:
  TermBand(const MotionModel& model, std::size_t term, const Uncertainty& uncertainty,
           const std::vector<StepInterval>& steps)
      : term_(model.terms[term]), values_(model, uncertainty, term) {
    for (const StepInterval& step : steps)
      if (step.term == term && !step.is_radius && step.low && step.high) steps_.push_back(step);
  }

  [[nodiscard]] BandPoint at(const std::vector<BlockPlace>& places) const {
    BandPoint band = interval(places);
    // Within the interval of a step the values before and after it are possible.
    for (const StepInterval& step : steps_) {
      for (const double side : {*step.low, *step.high}) {
        std::vector<BlockPlace> beyond = places;
        const double off = side < step.at ? -kBeyond : kBeyond;
        if (!move_within(beyond, step, side + off)) break;
        widen(band, interval(beyond));
      }
    }
    // The edges of a map are known up to the pitch of its nodes.
    for (std::size_t p = 0; p < places.size(); ++p) {
      const std::vector<Factor>& factors = term_.blocks[places[p].block].basis.factors;
      for (std::size_t f = 0; f < factors.size(); ++f) {
        if (factors[f].shape != Shape::kGrid || places[p].factors[f].left_out) continue;
        for (const auto& [i, j] : std::array<std::pair<int, int>, 4>{{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}}) {
          std::vector<BlockPlace> beside = places;
          beside[p].factors[f].value += i * (factors[f].high - factors[f].low) / (factors[f].count - 1);
          const std::size_t rows = factors[f].points.size() / factors[f].count;
          beside[p].factors[f].and_value +=
              j * (factors[f].and_high - factors[f].and_low) / static_cast<double>(rows - 1);
          widen(band, interval(beside));
        }
      }
    }
    return band;
  }

 private:
  /// Shift to either side of a step, in the unit of its covariate: far below any interval, above rounding.
  static constexpr double kBeyond = 1e-6;

  [[nodiscard]] BandPoint interval(const std::vector<BlockPlace>& places) const {
    const ValueWithSd v = values_.at(places);
    return {v.value, v.value - stats::kNormal95 * v.sd, v.value + stats::kNormal95 * v.sd};
  }
  static void widen(BandPoint& band, const BandPoint& by) {
    band.low = std::min(band.low, by.low);
    band.high = std::max(band.high, by.high);
  }
  /// Moves the places of factors with a step that lie within its interval. Returns whether there are any.
  [[nodiscard]] bool move_within(std::vector<BlockPlace>& places, const StepInterval& step, double to) const {
    bool any = false;
    for (BlockPlace& place : places) {
      const std::vector<Factor>& factors = term_.blocks[place.block].basis.factors;
      for (std::size_t f = 0; f < factors.size(); ++f) {
        double& value = place.factors[f].value;
        const std::vector<double>& steps = factors[f].points;
        if (factors[f].shape != Shape::kAtLeast || !(factors[f].axis == step.axis) ||
            std::find(steps.begin(), steps.end(), step.at) == steps.end() || value < *step.low ||
            value > *step.high)
          continue;
        value = to;
        any = true;
      }
    }
    return any;
  }

  const Term& term_;
  const TermValues values_;
  std::vector<StepInterval> steps_;
};

/// A covariate of a block, and the values at which the block's band is given.
struct BandAxis {
  Axis axis;
  bool is_phase = false;
  std::vector<double> at;
};

/// The range of a curve. Those of exponentials and steps follow from their points.
std::pair<double, double> range_of(const Factor& factor) {
  const auto largest = [&] { return *std::max_element(factor.points.begin(), factor.points.end()); };
  // Ranges relative to the largest point: after three lengths 5 % of an exponential are left, and a quarter more shows what
  // follows the last step.
  constexpr double kDecayed = 3, kBeyond = 1.25;
  switch (factor.shape) {
    case Shape::kHarmonics:
    case Shape::kTravelling: return {-M_PI, M_PI};
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

std::vector<double> evenly(double low, double high, std::size_t count) {
  std::vector<double> at;
  for (std::size_t i = 0; i < count; ++i)
    at.push_back(low + (high - low) * static_cast<double>(i) / static_cast<double>(count - 1));
  return at;
}

/// The covariates of a basis, each once, with `count` values of those that are no keys.
std::vector<BandAxis> axes_of(const Basis& basis, std::size_t count) {
  std::vector<BandAxis> all;
  const auto add = [&](const Axis& axis, bool is_phase, std::vector<double> at) {
    const bool known = std::any_of(
        all.begin(), all.end(), [&](const BandAxis& one) { return one.axis == axis && one.is_phase == is_phase; });
    if (!known) all.push_back({axis, is_phase, std::move(at)});
  };
  for (const Factor& f : basis.factors) {
    const auto [low, high] = range_of(f);
    add(f.axis, f.shape == Shape::kTravelling, f.shape == Shape::kTable ? f.points : evenly(low, high, count));
    if (f.of_two()) add(f.and_axis, false, evenly(f.and_low, f.and_high, count));
  }
  return all;
}

/// The covariates with as many values as the number of covariates allows.
std::vector<BandAxis> axes_of(const Basis& basis) {
  // Values of each covariate: the entry for their number, or a later one that keeps to kMostPlaces.
  constexpr std::array<std::size_t, 5> kCounts = {21, 9, 5, 3, 2};
  constexpr double kMostPlaces = 1200;  // places of a band; more show it finer, and make the result longer
  const std::size_t axes = axes_of(basis, 2).size();
  std::vector<BandAxis> best;
  for (std::size_t c = std::min(axes > 0 ? axes - 1 : 0, kCounts.size() - 1); c < kCounts.size(); ++c) {
    best = axes_of(basis, kCounts[c]);
    const double places = std::accumulate(best.begin(), best.end(), 1.0, [](double product, const BandAxis& axis) {
      return product * static_cast<double>(axis.at.size());
    });
    if (places <= kMostPlaces) break;
  }
  return best;
}

/// The places of a block's factors, given the values of the covariates.
BlockPlace place_of(std::size_t block, const Basis& basis, const std::vector<BandAxis>& axes,
                    const std::vector<double>& values) {
  const auto value_of = [&](const Axis& axis, bool is_phase) {
    for (std::size_t a = 0; a < axes.size(); ++a)
      if (axes[a].axis == axis && axes[a].is_phase == is_phase) return values[a];
    return 0.0;
  };
  BlockPlace place{block, {}};
  for (const Factor& f : basis.factors)
    place.factors.push_back(
        {value_of(f.axis, f.shape == Shape::kTravelling), f.of_two() ? value_of(f.and_axis, false) : 0, false});
  return place;
}

JsonValue entry_of(const BandAxis& axis) {
  JsonValue out;
  auto& fields = *out.mutable_struct_value()->mutable_fields();
  fields["of"] = json_value(std::string(axis.is_phase ? "phase" : name_of(axis.axis.of)));
  if (const std::string unit = axis.is_phase ? "rad" : unit_of(axis.axis.of); !unit.empty())
    fields["unit"] = json_value(unit);
  const bool counts = axis.axis.of == Covariate::kNeighbours || axis.axis.of == Covariate::kDensity ||
                      axis.axis.of == Covariate::kNearest || axis.axis.of == Covariate::kBearing;
  if (counts) fields["radius_mm"] = json_value(reach_mm(axis.axis));
  if (counts && axis.axis.others != Others::kAny)
    fields["others"] = json_value(std::string(axis.axis.others == Others::kDriven ? "driven" : "resting"));
  if (counts && axis.axis.only_robot > 0) fields["other_robot"] = json_value(axis.axis.only_robot - 1);
  const bool times = axis.axis.of >= Covariate::kMotorTime && axis.axis.of <= Covariate::kDrivenTime;
  if (times && axis.axis.decay_index > 0)
    fields["forget_s"] = json_value(kDecayTimes_s[axis.axis.decay_index - 1U]);
  return out;
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

/// Candidates for one drawn curve: the groups, then each of their blocks alone, because a term may have curves over several covariates.
std::vector<Group> drawn_groups_of(const Term& term) {
  std::vector<Group> groups = groups_of(term);
  const std::size_t wholes = groups.size();
  for (std::size_t g = 0; g < wholes; ++g) {
    if (groups[g].size() < 2) continue;
    const Group whole = groups[g];
    for (const std::size_t b : whole) groups.push_back({b});
  }
  return groups;
}

double factor_of(const std::string& unit) { return unit == "%" ? 100 : unit == "degrees" ? 180 / M_PI : 1; }

/// Drawn values, and where the blocks of a group have them.
struct Drawn {
  std::vector<double> value;
  std::vector<std::vector<BlockPlace>> at;
  double factor;
};
/// The band at the drawn values; nothing if these are not those of the group.
std::optional<std::vector<BandPoint>> band_of(const Drawn& drawn, const TermBand& term) {
  constexpr double kAlike = 0.03;  // of the largest value: splines through knots of the basis
  double most = 0, off = 0;
  std::vector<BandPoint> points;
  for (std::size_t i = 0; i < drawn.value.size(); ++i) {
    const BandPoint p = term.at(drawn.at[i]);
    most = std::max(most, std::abs(drawn.value[i]));
    off = std::max(off, std::abs(drawn.factor * p.value - drawn.value[i]));
    points.push_back({drawn.value[i], drawn.value[i] + drawn.factor * (p.low - p.value),
                      drawn.value[i] + drawn.factor * (p.high - p.value)});
  }
  return off <= kAlike * most ? std::optional(points) : std::nullopt;
}

/// The place of a block that is drawn over one covariate at amplitude 1; nothing: it has another covariate.
std::optional<BlockPlace> on_curve(const Term& term, std::size_t block, const Axis& axis, double value) {
  const std::vector<Factor>& factors = term.blocks[block].basis.factors;
  if (factors.empty() || factors.back().of_two() || factors.back().shape == Shape::kTravelling ||
      !(factors.back().axis == axis))
    return std::nullopt;
  BlockPlace place{block, {}};
  for (std::size_t f = 0; f + 1 < factors.size(); ++f) {
    if (factors[f].known.empty()) return std::nullopt;
    place.factors.push_back({0, 0, true});
  }
  place.factors.push_back({value, 0, false});
  return place;
}

/// The place of a block on a map. `amplitudes`: known functions of the place multiply the map, and are not drawn.
std::optional<BlockPlace> on_map(const Term& term, std::size_t block, double x_mm, double y_mm, bool amplitudes) {
  BlockPlace place{block, {}};
  const std::vector<Factor>& factors = term.blocks[block].basis.factors;
  const auto value_of = [&](const Axis& axis) -> std::optional<double> {
    switch (axis.of) {
      case Covariate::kX: return x_mm;
      case Covariate::kY: return y_mm;
      case Covariate::kRadius: return std::hypot(x_mm, y_mm);
      default: return std::nullopt;
    }
  };
  for (std::size_t f = 0; f < factors.size(); ++f) {
    const Factor& factor = factors[f];
    const bool last = f + 1 == factors.size(), known = !factor.known.empty();
    const auto value = factor.shape == Shape::kTravelling ? std::nullopt : value_of(factor.axis);
    const auto and_value = factor.of_two() ? value_of(factor.and_axis) : std::optional(0.0);
    if (!last && known && (amplitudes || !value || !and_value))
      place.factors.push_back({0, 0, true});
    else if (value && and_value)
      place.factors.push_back({*value, *and_value, false});
    else
      return std::nullopt;
  }
  return place;
}

}  // namespace

void set_band(identification::EffectCurve& curve, const MotionModel& model, std::size_t t,
              const Uncertainty& uncertainty, const std::vector<StepInterval>& steps) {
  const Term& term = model.terms[t];
  const TermBand band(model, t, uncertainty, steps);
  for (const Group& group : drawn_groups_of(term)) {
    if (term.blocks[group.front()].basis.factors.empty()) continue;
    const Axis axis = term.blocks[group.front()].basis.factors.back().axis;
    Drawn drawn{{curve.value().begin(), curve.value().end()}, {}, factor_of(curve.acts_on_unit())};
    // The shares of trails are drawn in per cent.
    const double unit = factor_of(curve.unit());
    for (int i = 0; i < curve.at_size(); ++i) {
      // The lower of two values at a step holds before it.
      constexpr double kBefore = 1e-6;
      const double before = i + 1 < curve.at_size() && curve.at(i + 1) == curve.at(i) ? kBefore : 0;
      std::vector<BlockPlace> places;
      for (const std::size_t b : group)
        if (auto place = on_curve(term, b, axis, curve.at(i) / unit - before)) places.push_back(std::move(*place));
      if (places.size() == group.size()) drawn.at.push_back(std::move(places));
    }
    if (drawn.at.size() != drawn.value.size()) continue;
    const auto points = band_of(drawn, band);
    if (!points) continue;
    for (const BandPoint& p : *points) {
      curve.add_low(p.low);
      curve.add_high(p.high);
    }
    return;
  }
}

void set_band(identification::EffectMap& map, const MotionModel& model, std::size_t t,
              const Uncertainty& uncertainty, const std::vector<StepInterval>& steps) {
  const Term& term = model.terms[t];
  const TermBand band(model, t, uncertainty, steps);
  for (const Group& group : groups_of(term)) {
    for (const bool amplitudes : {true, false}) {
      Drawn drawn{{}, {}, factor_of(map.unit())};
      for (int j = 0; j < map.y_mm_size(); ++j) {
        for (int i = 0; i < map.x_mm_size(); ++i) {
          drawn.value.push_back(map.effect(j).values(i).number_value());
          std::vector<BlockPlace> places;
          for (const std::size_t b : group)
            if (auto place = on_map(term, b, map.x_mm(i), map.y_mm(j), amplitudes))
              places.push_back(std::move(*place));
          if (places.size() == group.size()) drawn.at.push_back(std::move(places));
        }
      }
      if (drawn.at.size() != drawn.value.size()) continue;
      const auto points = band_of(drawn, band);
      if (!points) continue;
      for (int j = 0; j < map.y_mm_size(); ++j) {
        JsonList &low = *map.add_low(), &high = *map.add_high();
        for (int i = 0; i < map.x_mm_size(); ++i) {
          const BandPoint& p = (*points)[static_cast<std::size_t>(j) * static_cast<std::size_t>(map.x_mm_size()) +
                                         static_cast<std::size_t>(i)];
          *low.add_values() = json_value(p.low);
          *high.add_values() = json_value(p.high);
        }
      }
      return;
    }
  }
}

JsonList bands_of(const MotionModel& model, std::size_t term, const Uncertainty& uncertainty,
                  const std::vector<StepInterval>& steps) {
  const TermBand band_at(model, term, uncertainty, steps);
  JsonList bands;
  for (std::size_t b = 0; b < model.terms[term].blocks.size(); ++b) {
    const Basis& basis = model.terms[term].blocks[b].basis;
    const std::vector<BandAxis> axes = axes_of(basis);
    JsonList at, value, low, high, of;
    std::size_t places = 1;
    for (const BandAxis& axis : axes) {
      places *= axis.at.size();
      *of.add_values() = entry_of(axis);
    }
    for (std::size_t i = 0; i < places; ++i) {
      // The first covariate runs fastest.
      std::vector<double> values;
      std::size_t rest = i;
      for (const BandAxis& axis : axes) {
        values.push_back(axis.at[rest % axis.at.size()]);
        rest /= axis.at.size();
      }
      const BandPoint p = band_at.at({place_of(b, basis, axes, values)});
      *at.add_values() = axes.empty()       ? json_null()
                         : axes.size() == 1 ? json_value(values[0])
                                            : json_value(json_list(values));
      *value.add_values() = json_value(p.value);
      *low.add_values() = json_value(p.low);
      *high.add_values() = json_value(p.high);
    }
    auto& band = *bands.add_values()->mutable_struct_value()->mutable_fields();
    band["block"] = json_value(b + 1);
    band["axes"] = json_value(std::move(of));
    band["at"] = json_value(std::move(at));
    band["value"] = json_value(std::move(value));
    band["low"] = json_value(std::move(low));
    band["high"] = json_value(std::move(high));
  }
  return bands;
}

}  // namespace kilotwin::identify
