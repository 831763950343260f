#include "clients/identify/model/effect_text.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "clients/identify/model/effect_records.hpp"
#include "clients/identify/result/values.hpp"
#include "core/effects/function.hpp"
#include "core/plan/from_manifest.hpp"
#include "core/stats/quantiles.hpp"

namespace kilotwin::identify {
namespace {

using proto::Effect, proto::Function;

constexpr double kDegrees = 180 / M_PI;

struct Unit {
  const char* name;
  double factor;
};

Unit unit_of(Effect::Target target) {
  switch (target) {
    case Effect::WHEEL_GAIN:
    case Effect::MEASURED_SCALE: return {"%", 100};
    case Effect::WHEEL_OFFSET:
    case Effect::BODY_DRIFT:
    case Effect::WORLD_DRIFT: return {"mm/s", 1};
    case Effect::TURN_RATE: return {"rad/s", 1};
    case Effect::MEASURED_OFFSET:
    case Effect::MEASURED_BODY_OFFSET: return {"mm", 1};
    case Effect::MEASURED_HEADING: return {"degrees", kDegrees};
  }
  return {"", 1};
}

Unit unit_of(Function::Covariate of) {
  switch (of) {
    case Function::TIME:
    case Function::TIME_SINCE_COMMAND:
    case Function::PREVIOUS_LASTED:
    case Function::MOTOR_TIME:
    case Function::LEFT_MOTOR_TIME:
    case Function::RIGHT_MOTOR_TIME:
    case Function::DRIVEN_TIME:
    case Function::SINCE_REST:
    case Function::MOTOR_TIME_DIFFERENCE:
    case Function::MOTOR_TIME_SUM:
    case Function::PLACE: return {"s", 1};
    case Function::X:
    case Function::Y:
    case Function::RADIUS:
    case Function::POINT_DISTANCE:
    case Function::ALONG:
    case Function::NEAREST: return {"mm", 1};
    case Function::HEADING:
    case Function::NEAREST_BEARING: return {"degrees", kDegrees};
    default: return {"", 1};
  }
}

/// Fields of trails have the name of their kind (model_file.cpp).
bool is_trail(const Function& f) { return f.of() == Function::PLACE && f.field().rfind(kTrailField, 0) == 0; }

Unit unit_of(const Function& f) { return is_trail(f) ? Unit{"%", 100} : unit_of(f.of()); }

const char* name_of(Function::Covariate of) {
  switch (of) {
    case Function::TIME: return "time";
    case Function::TIME_SINCE_COMMAND: return "time_since_command";
    case Function::PREVIOUS_LASTED: return "duration of the previous command";
    case Function::COMMAND_COUNT: return "number of commands";
    case Function::MOTOR_TIME: return "motor_time";
    case Function::DRIVEN_TIME: return "driven_time";
    case Function::SINCE_REST: return "time since the last rest";
    case Function::MOTOR_TIME_DIFFERENCE: return "motor-on time, left minus right";
    case Function::MOTOR_TIME_SUM: return "motor-on time of both motors";
    case Function::X: return "x";
    case Function::Y: return "y";
    case Function::RADIUS: return "radius";
    case Function::POINT_DISTANCE: return "distance from the moving centre";
    case Function::ALONG: return "place along a direction";
    case Function::NEAREST: return "nearest";
    case Function::NEAREST_BEARING: return "bearing";
    case Function::HEADING: return "heading";
    case Function::NEIGHBOURS: return "neighbours";
    case Function::DENSITY: return "density";
    case Function::PLACE: return "driven time in the floor cell";
    case Function::ROBOT: return "robot";
    default: return "covariate";
  }
}

const char* name_of(const Function& f) {
  return is_trail(f) ? "freshness of another robot's trail" : name_of(f.of());
}

/// A signed value with three digits.
std::string signed_size(double value, Effect::Target target) {
  const Unit unit = unit_of(target);
  const double v = value * unit.factor, size = std::abs(v);
  const int digits = size > 0 ? std::clamp(1 - static_cast<int>(std::floor(std::log10(size))), 0, 5) : 0;
  return fmt::format("{}{:.{}f} {}", v < 0 ? "−" : "+", size, digits, unit.name);
}

std::string place(double at, Function::Covariate of) {
  const Unit unit = unit_of(of);
  const std::string number = fmt::format("{:.0f}", at * unit.factor);
  if (of == Function::ROBOT) return "robot " + number;
  return *unit.name == 0 ? number : number + " " + unit.name;
}

std::string place(double at, const Function& f) {
  return is_trail(f) ? fmt::format("{:.0f} % freshness", 100 * at) : place(at, f.of());
}

const char* command_name(double key) {
  constexpr const char* kNames[] = {"at rest", "straight", "left", "right"};
  return kNames[static_cast<std::size_t>(std::clamp(key, 0.0, 3.0))];
}

/// The ends of a curve, and extremes between them.
std::string of_curve(const std::vector<double>& at, const std::vector<double>& value, Effect::Target target,
                     const Function& f) {
  const auto [low, high] = std::minmax_element(value.begin(), value.end());
  const double range = *high - *low;
  std::vector<std::size_t> places{0};
  const double ends_low = std::min(value.front(), value.back()), ends_high = std::max(value.front(), value.back());
  if (*low < ends_low - 0.2 * range) places.push_back(static_cast<std::size_t>(low - value.begin()));
  if (*high > ends_high + 0.2 * range) places.push_back(static_cast<std::size_t>(high - value.begin()));
  places.push_back(value.size() - 1);
  std::sort(places.begin(), places.end());
  std::vector<std::string> parts;
  parts.reserve(places.size());
  for (const std::size_t i : places)
    parts.push_back(fmt::format("{} at {}", signed_size(value[i], target), place(at[i], f)));
  return fmt::format("{}", fmt::join(parts, ", "));
}

std::string of_table(const proto::Table& table, Effect::Target target, Function::Covariate of) {
  if (table.value_size() == 0) return "";
  std::vector<std::string> parts;
  if (of != Function::ROBOT && table.value_size() <= 4) {
    for (int i = 0; i < table.value_size(); ++i) {
      const std::string when =
          of == Function::COMMAND            ? command_name(table.key(i))
          : of == Function::PREVIOUS_COMMAND ? fmt::format("after {}", command_name(table.key(i)))
          : of == Function::EARLIER_TURN     ? fmt::format("after an earlier turn {}", command_name(table.key(i)))
          : of == Function::LAST_TURN        ? fmt::format("after a turn {}", command_name(table.key(i)))
                                             : fmt::format("at {}", table.key(i));
      parts.push_back(fmt::format("{} {}", signed_size(table.value(i), target), when));
    }
    return fmt::format("{}", fmt::join(parts, ", "));
  }
  const auto [low, high] = std::minmax_element(table.value().begin(), table.value().end());
  const auto key = [&](auto at) { return table.key(static_cast<int>(at - table.value().begin())); };
  return fmt::format("from {} ({}) to {} ({})", signed_size(*low, target), place(key(low), of),
                     signed_size(*high, target), place(key(high), of));
}

std::string of_function(const Function& f, Effect::Target target) {
  switch (f.shape_case()) {
    case Function::kConstant: return signed_size(f.constant(), target);
    case Function::kSpline:
      return of_curve({f.spline().knot().begin(), f.spline().knot().end()},
                      {f.spline().value().begin(), f.spline().value().end()}, target, f);
    case Function::kSpline2D: {
      const auto [low, high] = std::minmax_element(f.spline_2d().value().begin(), f.spline_2d().value().end());
      return fmt::format("between {} and {} over the arena", signed_size(*low, target), signed_size(*high, target));
    }
    case Function::kExponential:
      return fmt::format("{} initially, decaying within {}", signed_size(f.exponential().at_zero(), target),
                         place(f.exponential().scale(), f));
    case Function::kHarmonic: {
      const double size = std::hypot(f.harmonic().cosine(), f.harmonic().sine());
      const double most =
          std::atan2(f.harmonic().sine(), f.harmonic().cosine()) * f.harmonic().period() / (2 * M_PI);
      const std::string up_to = signed_size(size, target).substr(1);
      if (unit_of(f.of()).factor != 1) return fmt::format("up to {}, maximal at {}", up_to, place(most, f.of()));
      return fmt::format("up to {}, with a period of {}", up_to, place(f.harmonic().period(), f.of()));
    }
    case Function::kSteps: {
      std::vector<std::string> parts;
      if (f.steps().at_size() > 0 && f.steps().value(0) != 0)
        parts.push_back(
            fmt::format("{} up to {}", signed_size(f.steps().value(0), target), place(f.steps().at(0), f)));
      for (int i = 0; i < std::min(f.steps().at_size(), 3); ++i)
        parts.push_back(
            fmt::format("{} from {} on", signed_size(f.steps().value(i + 1), target), place(f.steps().at(i), f)));
      return fmt::format("{}", fmt::join(parts, ", "));
    }
    case Function::kTable: return of_table(f.table(), target, f.of());
    default: return "";
  }
}

/// "times 0.2 (robot 3) to 1.9 (robot 17)".
std::string amplitudes_in_words(const Function& f) {
  if (f.has_table() && f.table().value_size() > 0) {
    const proto::Table& table = f.table();
    if (f.of() == Function::COMMAND) {
      std::vector<std::string> parts;
      parts.reserve(static_cast<std::size_t>(table.value_size()));
      for (int i = 0; i < table.value_size(); ++i)
        parts.push_back(fmt::format("{:.2f} {}", table.value(i), command_name(table.key(i))));
      return fmt::format("times {}", fmt::join(parts, ", "));
    }
    const auto [low, high] = std::minmax_element(table.value().begin(), table.value().end());
    const auto key = [&](auto at) {
      return place(table.key(static_cast<int>(at - table.value().begin())), f.of());
    };
    return fmt::format("times {:.2f} ({}) to {:.2f} ({})", *low, key(low), *high, key(high));
  }
  if (f.has_steps() && f.steps().at_size() > 0) {
    const proto::Steps& steps = f.steps();
    std::string words = fmt::format("times {:.2f} at first", steps.value(0));
    constexpr int kMost = 3;  // steps in words; more make the sentence longer
    for (int i = 0; i < std::min(steps.at_size(), kMost); ++i)
      words += fmt::format(", {:.2f} from {} on", steps.value(i + 1), place(steps.at(i), f));
    return words;
  }
  if (!f.has_spline() || f.spline().knot_size() == 0) return "with varying amplitude";
  const int last = f.spline().knot_size() - 1;
  return fmt::format("times {:.2f} at {} to {:.2f} at {}", f.spline().value(0), place(f.spline().knot(0), f.of()),
                     f.spline().value(last), place(f.spline().knot(last), f.of()));
}

/// A curve times amplitudes, as shown: the curve at amplitude 1. Products of three functions have two amplitudes.
struct Amplitudes {
  std::vector<Effect> curves;
  std::vector<Function> amplitudes;
};
Amplitudes without_amplitudes(const std::vector<Effect>& effects) {
  Amplitudes out{effects, {}};
  if (effects.empty()) return out;
  const auto alike = [&](const Effect& effect) {
    return effect.function_size() > 1 &&
           effect.function(0).SerializeAsString() == out.curves.front().function(0).SerializeAsString();
  };
  while (std::all_of(out.curves.begin(), out.curves.end(), alike)) {
    out.amplitudes.push_back(out.curves.front().function(0));
    for (Effect& effect : out.curves) effect.mutable_function()->DeleteSubrange(0, 1);
  }
  return out;
}

/// "circles about (-50, 60) mm at the start, moving at (1.20, 0.30) mm/s, growing by 1.60 mm/s".
std::string point_in_words(const proto::MovingPoint& p) {
  std::string words = fmt::format("circles about ({:.0f}, {:.0f}) mm", p.x_mm(), p.y_mm());
  if (p.velocity_x_mm_s() != 0 || p.velocity_y_mm_s() != 0)
    words +=
        fmt::format(" at the start, moving at ({:.2f}, {:.2f}) mm/s", p.velocity_x_mm_s(), p.velocity_y_mm_s());
  if (p.growth_mm_s() != 0)
    words += fmt::format(", {} by {:.2f} mm/s", p.growth_mm_s() > 0 ? "growing" : "shrinking",
                         std::abs(p.growth_mm_s()));
  return words;
}

/// The words that distinguish a record from others of its term: "along y, going straight: ".
std::string which_of(const Effect& effect) {
  std::vector<std::string> parts;
  if (effect.wheel() == Effect::LEFT_WHEEL) parts.emplace_back("left wheel");
  if (effect.wheel() == Effect::RIGHT_WHEEL) parts.emplace_back("right wheel");
  if (effect.acts_on() == Effect::WORLD_DRIFT || effect.acts_on() == Effect::MEASURED_OFFSET)
    parts.emplace_back(effect.direction_deg() == 90 ? "along y" : "along x");
  if (effect.acts_on() == Effect::BODY_DRIFT || effect.acts_on() == Effect::MEASURED_BODY_OFFSET)
    parts.emplace_back(effect.direction_deg() == 90 ? "to the left" : "ahead");
  if (effect.during_size() == 1) parts.emplace_back(fmt::format("going {}", command_name(effect.during(0))));
  for (const Function& f : effect.function())
    if (f.has_point())
      parts.push_back(point_in_words(f.point()));
    else if (f.of() == Function::ALONG)
      parts.push_back(fmt::format("along {:.0f} degrees from the x axis", f.along_deg()));
  // With other factors in the product: the value at their full strength.
  for (const Function& f : effect.function()) {
    if (f.focus() > 0)
      parts.emplace_back(fmt::format("others {}", f.toward_deg() == 0               ? "ahead"
                                                  : std::abs(f.toward_deg()) == 180 ? "behind"
                                                  : f.toward_deg() > 0              ? "on the left"
                                                                                    : "on the right"));
    if (f.others() == Function::DRIVEN_OTHERS) parts.emplace_back("others that drive");
    if (f.others() == Function::RESTING_OTHERS) parts.emplace_back("others at rest");
    if (f.other_robot_size() > 0) parts.push_back(fmt::format("near robot {}", fmt::join(f.other_robot(), ", ")));
  }
  // A product of covariates of the same neighbours names them once.
  for (std::size_t i = 1; i < parts.size();)
    if (std::find(parts.begin(), parts.begin() + static_cast<std::ptrdiff_t>(i), parts[i]) !=
        parts.begin() + static_cast<std::ptrdiff_t>(i))
      parts.erase(parts.begin() + static_cast<std::ptrdiff_t>(i));
    else
      ++i;
  return parts.empty() ? "" : fmt::format("{}: ", fmt::join(parts, ", "));
}

bool of_place(Function::Covariate of) { return of == Function::X || of == Function::Y || of == Function::RADIUS; }
/// Whether an effect depends on the position alone.
bool is_of_place(const Effect& effect) {
  return effect.function_size() > 0 &&
         std::all_of(effect.function().begin(), effect.function().end(), [](const Function& f) {
           return f.has_constant() || (of_place(f.of()) && (!f.has_spline_2d() || of_place(f.and_of())));
         });
}
bool is_map(const Effect& effect) {
  return is_of_place(effect) && (effect.function_size() > 1 || effect.function(0).has_spline_2d());
}

/// The sum of all records of one term that act alike, on a raster over the arena.
struct MapSum {
  std::vector<double> x_mm, y_mm;
  std::vector<double> value;  ///< [y][x]

  [[nodiscard]] double quantile(double share) const {
    std::vector<double> values = value;
    return stats::lower_quantile(values, share);
  }
};

/// The sum of these effects over the range of their splines. Empty if none has a spline.
MapSum sum_of(const std::vector<const Effect*>& effects) {
  double low_x = 1e300, high_x = -1e300, low_y = 1e300, high_y = -1e300;
  const auto reach = [&](Function::Covariate of, const auto& knots) {
    if (knots.empty() || of == Function::RADIUS) return;
    double &low = of == Function::X ? low_x : low_y, &high = of == Function::X ? high_x : high_y;
    low = std::min(low, *knots.begin());
    high = std::max(high, *knots.rbegin());
  };
  for (const Effect* effect : effects) {
    for (const Function& f : effect->function()) {
      if (f.has_spline()) reach(f.of(), f.spline().knot());
      if (!f.has_spline_2d()) continue;
      reach(f.of(), f.spline_2d().knot());
      reach(f.and_of(), f.spline_2d().and_knot());
    }
  }
  MapSum sum;
  if (!(low_x < high_x && low_y < high_y)) return sum;
  constexpr int kAcross = 40;  // raster of the map, for its quantiles in words
  for (int i = 0; i < kAcross; ++i) {
    const double part = (i + 0.5) / kAcross;
    sum.x_mm.push_back(low_x + part * (high_x - low_x));
    sum.y_mm.push_back(low_y + part * (high_y - low_y));
  }
  sum.value.assign(sum.x_mm.size() * sum.y_mm.size(), 0);
  for (const Effect* effect : effects) {
    std::vector<EffectFunction> functions;
    for (const Function& f : effect->function()) functions.emplace_back(settings_of(f));
    std::size_t k = 0;
    for (const double y : sum.y_mm) {
      for (const double x : sum.x_mm) {
        const auto value_of = [&](Function::Covariate of) {
          return of == Function::X ? x : of == Function::Y ? y : std::hypot(x, y);
        };
        double product = 1;
        for (std::size_t f = 0; f < functions.size(); ++f) {
          const Function& by = effect->function(static_cast<int>(f));
          product *= functions[f](value_of(by.of()), by.has_spline_2d() ? value_of(by.and_of()) : 0);
        }
        sum.value[k++] += product;
      }
    }
  }
  return sum;
}

/// The records of a term: those that form maps, grouped by target, and all others.
struct Sorted {
  std::vector<std::vector<const Effect*>> maps;
  std::vector<const Effect*> others;
};
Sorted sorted(const std::vector<Effect>& effects) {
  const auto alike = [](const Effect& a, const Effect& b) {
    return a.acts_on() == b.acts_on() && which_of(a) == which_of(b);
  };
  Sorted out;
  for (const Effect& effect : effects) {
    if (!is_map(effect)) continue;
    const auto with =
        std::find_if(out.maps.begin(), out.maps.end(), [&](const auto& m) { return alike(*m.front(), effect); });
    (with == out.maps.end() ? out.maps.emplace_back() : *with).push_back(&effect);
  }
  for (const Effect& effect : effects) {
    if (is_map(effect)) continue;
    const auto with = std::find_if(out.maps.begin(), out.maps.end(),
                                   [&](const auto& m) { return is_of_place(effect) && alike(*m.front(), effect); });
    if (with == out.maps.end()) {
      out.others.push_back(&effect);
    } else {
      with->push_back(&effect);
    }
  }
  return out;
}

}  // namespace

std::string size_in_words(const std::vector<Effect>& effects) {
  constexpr std::size_t kMost = 3;  // parts of the sentence
  std::vector<std::string> parts;
  const Amplitudes shown = without_amplitudes(effects);
  const Sorted all = sorted(shown.curves);
  for (const std::vector<const Effect*>& map : all.maps) {
    const MapSum sum = sum_of(map);
    if (sum.value.empty()) return "";
    // Quantile that is cut off: map corners without data are arbitrary.
    constexpr double kTail = 0.02;
    const Effect::Target target = map.front()->acts_on();
    parts.push_back(fmt::format("{}between {} and {} over the arena", which_of(*map.front()),
                                signed_size(sum.quantile(kTail), target),
                                signed_size(sum.quantile(1 - kTail), target)));
    if (parts.size() == kMost) break;
  }
  for (const Effect* one : all.others) {
    if (parts.size() == kMost) break;
    const Effect& effect = *one;
    if (effect.function_size() != 1) continue;
    const std::string size = of_function(effect.function(0), effect.acts_on());
    if (size.empty()) return "";
    parts.push_back(which_of(effect) + size);
  }
  if (!parts.empty())
    for (const Function& amplitudes : shown.amplitudes) parts.push_back(amplitudes_in_words(amplitudes));
  return fmt::format("{}", fmt::join(parts, "; "));
}

std::vector<identification::EffectCurve> curves_of(const std::string& name, const std::vector<Effect>& effects) {
  std::vector<identification::EffectCurve> all;
  const Amplitudes shown = without_amplitudes(effects);
  for (const Effect* one : sorted(shown.curves).others) {
    const Effect& effect = *one;
    if (effect.function_size() != 1 || !(effect.function(0).has_spline() || effect.function(0).has_steps()))
      continue;
    const Function& f = effect.function(0);
    const Unit unit = unit_of(f), acting = unit_of(effect.acts_on());
    identification::EffectCurve& curve = all.emplace_back();
    curve.set_name(name);
    curve.set_which(which_of(effect));
    curve.set_covariate(name_of(f));
    curve.set_unit(unit.name);
    curve.set_acts_on(Effect::Target_Name(effect.acts_on()));
    curve.set_acts_on_unit(acting.name);
    const auto add = [&](double at, double value) {
      curve.add_at(at * unit.factor);
      curve.add_value(value * acting.factor);
    };
    for (int i = 0; i < f.spline().knot_size(); ++i) add(f.spline().knot(i), f.spline().value(i));
    if (f.has_steps() && f.steps().at_size() > 0) {
      // Steps: a tenth of their range beyond both ends.
      const proto::Steps& steps = f.steps();
      const double first = steps.at(0), last = steps.at(steps.at_size() - 1);
      const double beyond = std::max(0.1 * (last - first), 1.0);
      add(first - beyond, steps.value(0));
      for (int i = 0; i < steps.at_size(); ++i) {
        add(steps.at(i), steps.value(i));
        add(steps.at(i), steps.value(i + 1));
      }
      add(last + beyond, steps.value(steps.at_size()));
    }
  }
  return all;
}

std::vector<identification::EffectMap> maps_of(const std::string& name, const std::vector<Effect>& effects) {
  std::vector<identification::EffectMap> all;
  const Amplitudes shown = without_amplitudes(effects);
  for (const std::vector<const Effect*>& map : sorted(shown.curves).maps) {
    const MapSum sum = sum_of(map);
    if (sum.value.empty()) continue;
    const Effect::Target target = map.front()->acts_on();
    const Unit acting = unit_of(target);
    identification::EffectMap& out = all.emplace_back();
    out.set_name(name);
    out.set_which(which_of(*map.front()));
    out.set_acts_on(Effect::Target_Name(target));
    out.set_unit(acting.name);
    assign(out.mutable_x_mm(), sum.x_mm);
    assign(out.mutable_y_mm(), sum.y_mm);
    for (std::size_t j = 0; j < sum.y_mm.size(); ++j) {
      JsonList& row = *out.add_effect();
      for (std::size_t i = 0; i < sum.x_mm.size(); ++i)
        *row.add_values() = json_value(sum.value[j * sum.x_mm.size() + i] * acting.factor);
    }
  }
  return all;
}

}  // namespace kilotwin::identify
