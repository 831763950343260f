#include "clients/identify/model/effect_records.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

namespace kilotwin::identify {
namespace {

using Shape = Factor::Shape;
using proto::Effect, proto::Function;

Function::Covariate covariate_of(Covariate c) {
  switch (c) {
    case Covariate::kNothing: return Function::NOTHING;
    case Covariate::kTime: return Function::TIME;
    case Covariate::kX: return Function::X;
    case Covariate::kY: return Function::Y;
    case Covariate::kRadius: return Function::RADIUS;
    case Covariate::kHeading: return Function::HEADING;
    case Covariate::kCommand: return Function::COMMAND;
    case Covariate::kSinceCommand: return Function::TIME_SINCE_COMMAND;
    case Covariate::kMotorTime: return Function::MOTOR_TIME;
    // The left motor drives the right-hand wheel (idl/effects.proto names motors, this model names wheels).
    case Covariate::kLeftMotorTime: return Function::RIGHT_MOTOR_TIME;
    case Covariate::kRightMotorTime: return Function::LEFT_MOTOR_TIME;
    case Covariate::kDrivenTime: return Function::DRIVEN_TIME;
    case Covariate::kNeighbours: return Function::NEIGHBOURS;
    case Covariate::kNearest: return Function::NEAREST;
    case Covariate::kDensity: return Function::DENSITY;
    case Covariate::kBearing: return Function::NEAREST_BEARING;
    case Covariate::kPreviousCommand: return Function::PREVIOUS_COMMAND;
    case Covariate::kPreviousLasted: return Function::PREVIOUS_LASTED;
    case Covariate::kSinceRest: return Function::SINCE_REST;
    case Covariate::kMotorTimeDifference: return Function::MOTOR_TIME_DIFFERENCE;
    case Covariate::kMotorTimeSum: return Function::MOTOR_TIME_SUM;
    case Covariate::kLastTurn: return Function::LAST_TURN;
    case Covariate::kEarlierTurn: return Function::EARLIER_TURN;
    case Covariate::kCommandCount: return Function::COMMAND_COUNT;
    case Covariate::kTraffic: return Function::PLACE;
    case Covariate::kRobot: return Function::ROBOT;
    case Covariate::kRun: return Function::RUN;
    case Covariate::kPointDistance: return Function::POINT_DISTANCE;
    case Covariate::kAlong: return Function::ALONG;
  }
  return Function::NOTHING;
}

bool is_motor_time(Covariate c) { return c >= Covariate::kMotorTime && c <= Covariate::kDrivenTime; }
/// A situation in which one or two covariates have given values. The other values do not matter.
Situation with(const Axis& axis, double value, Situation s = {}) {
  switch (axis.of) {
    case Covariate::kTime: s.time_s = value; break;
    case Covariate::kX: s.x_mm = value; break;
    case Covariate::kY: s.y_mm = value; break;
    case Covariate::kRadius: s.x_mm = value; break;
    case Covariate::kHeading: s.heading_rad = value; break;
    case Covariate::kSinceCommand: s.commands.since_s = value; break;
    case Covariate::kPreviousLasted: s.commands.previous_lasted_s = value; break;
    case Covariate::kSinceRest: s.commands.since_rest_s = value; break;
    case Covariate::kCommandCount: s.commands.count = value; break;
    case Covariate::kMotorTimeDifference:
    case Covariate::kMotorTimeSum: s.commands.motor_s = {0, value}; break;
    case Covariate::kNeighbours: s.near.count[axis.radius] = static_cast<float>(value); break;
    case Covariate::kMotorTime:
    case Covariate::kLeftMotorTime:
    case Covariate::kRightMotorTime:
    case Covariate::kDrivenTime:
      s.commands.motor_s = {value, value};
      s.commands.driven_s = value;
      if (axis.decay_index > 0) s.commands.initial_discounted_s[axis.decay_index - 1u] = {value, value, value};
      break;
    case Covariate::kNearest: s.near.nearest_mm = value; break;
    case Covariate::kDensity: s.near.density[axis.radius] = static_cast<float>(value); break;
    case Covariate::kTraffic: s.near.traffic[axis.radius] = static_cast<float>(value); break;
    case Covariate::kBearing:
      s.near.nearest_mm = 0;
      s.near.direction_rad = value;
      break;
    case Covariate::kPointDistance: {
      // A negative distance occurs after the circle has grown only.
      if (value < 0 && axis.point.growth_mm_s > 0) s.time_s = -value / axis.point.growth_mm_s;
      s.x_mm = axis.point.x_mm_at(s.time_s) + std::max(value, 0.0);
      s.y_mm = axis.point.y_mm_at(s.time_s);
      break;
    }
    case Covariate::kAlong:
      s.x_mm = value * std::cos(axis.along_rad);
      s.y_mm = value * std::sin(axis.along_rad);
      break;
    default: break;
  }
  return s;
}

double sum_at(const Factor& factor, const Eigen::VectorXd& coefficients, const Situation& s) {
  std::vector<double> values(factor.columns());
  factor.evaluate(s, 0, values.data());
  return factor.plus + coefficients.dot(Eigen::Map<const Eigen::VectorXd>(values.data(), coefficients.size()));
}

void set_axis(Function& function, const Factor& factor) {
  function.set_of(covariate_of(factor.axis.of));
  if (is_of_others(factor.axis)) {
    function.set_radius_mm(reach_mm(factor.axis));
    if (factor.axis.others == Others::kDriven) function.set_others(Function::DRIVEN_OTHERS);
    if (factor.axis.others == Others::kResting) function.set_others(Function::RESTING_OTHERS);
    if (factor.axis.only_robot > 0) function.add_other_robot(factor.axis.only_robot - 1);
  }
  if (factor.axis.focus > 0) {
    function.set_focus(factor.axis.focus);
    if (factor.axis.toward_deg != 0) function.set_toward_deg(factor.axis.toward_deg);
  }
  if (factor.axis.of == Covariate::kPointDistance) {
    const MovingPoint& from = factor.axis.point;
    proto::MovingPoint& point = *function.mutable_point();
    point.set_x_mm(rounded(from.x_mm));
    point.set_y_mm(rounded(from.y_mm));
    point.set_velocity_x_mm_s(rounded(from.velocity_x_mm_s));
    point.set_velocity_y_mm_s(rounded(from.velocity_y_mm_s));
    point.set_growth_mm_s(rounded(from.growth_mm_s));
  }
  if (factor.axis.of == Covariate::kAlong)
    function.set_along_deg(rounded(std::remainder(factor.axis.along_rad * (180 / M_PI), 360)));
  if (factor.axis.of == Covariate::kTraffic) function.set_field(field_name(factor.axis.radius));
  if (is_motor_time(factor.axis.of) && factor.axis.decay_index > 0)
    function.set_forget_s(kDecayTimes_s[factor.axis.decay_index - 1u]);
}

/// Natural cubic spline through the curve.
void set_spline(Function& function, const Factor& factor, const Eigen::VectorXd& coefficients, double low,
                double high, double warp, int knots) {
  proto::Spline& spline = *function.mutable_spline();
  for (int i = 0; i < knots; ++i) {
    const double part = static_cast<double>(i) / (knots - 1);
    const double at =
        warp > 0 ? low + warp * std::expm1(part * std::log1p((high - low) / warp)) : low + part * (high - low);
    spline.add_knot(rounded(at));
    spline.add_value(rounded(sum_at(factor, coefficients, with(factor.axis, at))));
  }
}

void set_harmonic(Function& function, double cosine, double sine, double period) {
  proto::Harmonic& harmonic = *function.mutable_harmonic();
  harmonic.set_cosine(rounded(cosine));
  harmonic.set_sine(rounded(sine));
  harmonic.set_period(period);
}

void set_table(Function& function, const Factor& factor, const Eigen::VectorXd& coefficients) {
  proto::Table& table = *function.mutable_table();
  for (std::size_t i = 0; i < factor.points.size(); ++i) {
    if (factor.axis.of == Covariate::kPreviousCommand && factor.points[i] == kNoCommand) continue;
    table.add_key(static_cast<std::uint32_t>(factor.points[i]));
    table.add_value(rounded(factor.plus + coefficients[static_cast<Eigen::Index>(i)]));
  }
  if (factor.plus != 0) table.set_otherwise(rounded(factor.plus));
}

void set_steps(Function& function, const Factor& factor, const Eigen::VectorXd& coefficients) {
  proto::Steps& steps = *function.mutable_steps();
  double value = factor.plus;
  steps.add_value(rounded(value));
  for (std::size_t i = 0; i < factor.points.size(); ++i) {
    if (coefficients[static_cast<Eigen::Index>(i)] == 0) continue;
    value += coefficients[static_cast<Eigen::Index>(i)];
    steps.add_at(rounded(factor.points[i]));
    steps.add_value(rounded(value));
  }
}

/// One curve that decays to 0 or levels off from 0; several as a spline.
void set_exponential(Function& function, const Factor& factor, const Eigen::VectorXd& coefficients) {
  if (factor.points.size() == 1) {
    proto::Exponential& exponential = *function.mutable_exponential();
    if (factor.shape == Shape::kExponential)
      exponential.set_at_zero(rounded(coefficients[0]));
    else
      exponential.set_at_infinity(rounded(coefficients[0]));
    exponential.set_scale(factor.points[0]);
    return;
  }
  const double slowest = *std::max_element(factor.points.begin(), factor.points.end());
  // Of traffic only trails level off, and their freshness ends at 1.
  const bool of_trail = factor.shape == Shape::kLevelling && factor.axis.of == Covariate::kTraffic;
  set_spline(function, factor, coefficients, 0, of_trail ? 1 : 6 * slowest, factor.points.front(), 60);
}

/// A map over two covariates, with columns x rows knots. value(i, j, x, y): at knot i, j.
template <class Value>
void set_map(Function& function, const Factor& factor, std::size_t columns, std::size_t rows, Value&& value) {
  function.set_and_of(covariate_of(factor.and_axis.of));
  proto::Spline2d& grid = *function.mutable_spline_2d();
  const auto at = [](double low, double high, std::size_t i, std::size_t n) {
    return low + (high - low) * static_cast<double>(i) / static_cast<double>(n - 1);
  };
  const auto x = [&](std::size_t i) { return at(factor.low, factor.high, i, columns); };
  const auto y = [&](std::size_t j) { return at(factor.and_low, factor.and_high, j, rows); };
  for (std::size_t i = 0; i < columns; ++i) grid.add_knot(rounded(x(i)));
  for (std::size_t j = 0; j < rows; ++j) grid.add_and_knot(rounded(y(j)));
  for (std::size_t j = 0; j < rows; ++j)
    for (std::size_t i = 0; i < columns; ++i) grid.add_value(rounded(value(i, j, x(i), y(j))));
}

/// The sum of a factor's columns, weighted with the coefficients, as one function.
Function function_of(const Factor& factor, const Eigen::VectorXd& coefficients) {
  if (!factor.known.empty()) {
    Factor open = factor;
    open.known.clear();
    open.plus *= coefficients[0];
    return function_of(
        open, coefficients[0] * Eigen::Map<const Eigen::VectorXd>(factor.known.data(),
                                                                  static_cast<Eigen::Index>(factor.known.size())));
  }
  Function function;
  set_axis(function, factor);
  switch (factor.shape) {
    // A spline through two points: constant beyond them, where there were no data.
    case Shape::kLinear: set_spline(function, factor, coefficients, factor.low, factor.high, 0, 2); break;
    case Shape::kCosines: {
      // Eight knots per half-wave of the highest column in use.
      Eigen::Index last = 0;
      for (Eigen::Index i = 0; i < coefficients.size(); ++i)
        if (coefficients[i] != 0) last = i;
      const int knots = std::min(400, 8 * (static_cast<int>(last) + static_cast<int>(factor.first)) + 9);
      set_spline(function, factor, coefficients, factor.low, factor.high, factor.warp, knots);
      break;
    }
    case Shape::kTaper: set_spline(function, factor, coefficients, 0, factor.high, 0, 25); break;
    case Shape::kHarmonics:
      if (factor.count == 1 && factor.plus == 0)
        set_harmonic(function, coefficients[0], coefficients[1], 2 * M_PI / factor.first);
      else
        set_spline(function, factor, coefficients, -M_PI, M_PI, 0, 16 * static_cast<int>(factor.count) + 1);
      break;
    case Shape::kTable: set_table(function, factor, coefficients); break;
    case Shape::kAtLeast: set_steps(function, factor, coefficients); break;
    case Shape::kExponential:
    case Shape::kLevelling: set_exponential(function, factor, coefficients); break;
    case Shape::kWave: set_harmonic(function, coefficients[0], coefficients[1], factor.points[0]); break;
    case Shape::kTravelling:         // a sum of products
    case Shape::kPointShift: break;  // part of a fit, of no model
    case Shape::kGrid:
      set_map(function, factor, factor.count, factor.points.size() / factor.count,
              [&](std::size_t i, std::size_t j, double, double) {
                return coefficients[0] * factor.points[j * factor.count + i];
              });
      break;
    case Shape::kCosines2:
    case Shape::kPolynomials2: {
      const std::size_t knots = 4 * std::size_t{factor.count} + 5;
      set_map(function, factor, knots, knots, [&](std::size_t, std::size_t, double x, double y) {
        return sum_at(factor, coefficients, with(factor.and_axis, y, with(factor.axis, x)));
      });
      break;
    }
  }
  return function;
}

/// The weighted columns of a travelling wave, as products of harmonics of x, y and t.
std::vector<std::vector<Function>> products_of_wave(const Factor& factor, const Eigen::VectorXd& coefficients) {
  const auto harmonic = [](Function::Covariate of, double number, bool sine) {
    Function f;
    f.set_of(of);
    if (number == 0) {
      f.clear_of();
      f.set_constant(sine ? 0 : 1);
    } else {
      if (sine)
        f.mutable_harmonic()->set_sine(number < 0 ? -1 : 1);
      else
        f.mutable_harmonic()->set_cosine(1);
      f.mutable_harmonic()->set_period(2 * M_PI / std::abs(number));
    }
    return f;
  };
  std::vector<std::vector<Function>> all;
  const auto add = [&](double weight, double k, bool x, bool y, bool t) {
    Function size;
    size.set_constant(rounded(weight));
    const std::vector<Function> product{size, harmonic(Function::X, k * factor.points[0], x),
                                        harmonic(Function::Y, k * factor.points[1], y),
                                        harmonic(Function::TIME, k * factor.points[2], t)};
    const bool none = std::any_of(product.begin(), product.end(),
                                  [](const Function& f) { return f.has_constant() && f.constant() == 0; });
    if (!none) all.push_back(product);
  };
  for (std::uint32_t i = 0; i < factor.count; ++i) {
    const double k = factor.first + i, c = coefficients[2 * i], s = coefficients[2 * i + 1];
    // cos(a + b - t) and sin(a + b - t).
    add(c, k, false, false, false);
    add(-c, k, true, true, false);
    add(c, k, true, false, true);
    add(c, k, false, true, true);
    add(s, k, true, false, false);
    add(s, k, false, true, false);
    add(-s, k, false, false, true);
    add(s, k, true, true, true);
  }
  return all;
}

/// The weighted columns of a factor as a sum of products.
std::vector<std::vector<Function>> products_of_columns(const Factor& factor, const Eigen::VectorXd& coefficients) {
  if (factor.shape != Shape::kTravelling) return {{function_of(factor, coefficients)}};
  if (factor.known.empty()) return products_of_wave(factor, coefficients);
  const Eigen::Map<const Eigen::VectorXd> known(factor.known.data(),
                                                static_cast<Eigen::Index>(factor.known.size()));
  return products_of_wave(factor, coefficients[0] * known);
}

/// Lists of functions. The sum over lists of the product of each list equals the basis' weighted sum of columns.
std::vector<std::vector<Function>> products_of(const std::vector<Factor>& factors, std::size_t from,
                                               const Eigen::VectorXd& coefficients) {
  if (from == factors.size()) {
    Function constant;
    constant.set_constant(rounded(coefficients[0]));
    return {{constant}};
  }
  const Factor& factor = factors[from];
  // Amplitudes of a constant stay a product, like those of the curve beside it.
  const bool of_a_constant = factors.size() == 1 && !factor.known.empty();
  if (from + 1 == factors.size() && !of_a_constant) return products_of_columns(factor, coefficients);
  std::vector<std::vector<Function>> all;
  const auto n = static_cast<Eigen::Index>(factor.size());
  const Eigen::Index rest = coefficients.size() / n;
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::VectorXd part = coefficients.segment(i * rest, rest);
    if (part.isZero(0)) continue;
    for (const std::vector<Function>& own : products_of_columns(factor, Eigen::VectorXd::Unit(n, i))) {
      for (std::vector<Function>& product : products_of(factors, from + 1, part)) {
        product.insert(product.begin(), own.begin(), own.end());
        all.push_back(std::move(product));
      }
    }
  }
  return all;
}

void set_target(Effect& effect, Target target) {
  switch (target) {
    case Target::kGain: effect.set_acts_on(Effect::WHEEL_GAIN); break;
    case Target::kGainLeft:
      effect.set_acts_on(Effect::WHEEL_GAIN);
      effect.set_wheel(Effect::LEFT_WHEEL);
      break;
    case Target::kGainRight:
      effect.set_acts_on(Effect::WHEEL_GAIN);
      effect.set_wheel(Effect::RIGHT_WHEEL);
      break;
    case Target::kOffset: effect.set_acts_on(Effect::WHEEL_OFFSET); break;
    case Target::kOffsetLeft:
      effect.set_acts_on(Effect::WHEEL_OFFSET);
      effect.set_wheel(Effect::LEFT_WHEEL);
      break;
    case Target::kOffsetRight:
      effect.set_acts_on(Effect::WHEEL_OFFSET);
      effect.set_wheel(Effect::RIGHT_WHEEL);
      break;
    case Target::kTurn: effect.set_acts_on(Effect::TURN_RATE); break;
    case Target::kAhead: effect.set_acts_on(Effect::BODY_DRIFT); break;
    case Target::kSideways:
      effect.set_acts_on(Effect::BODY_DRIFT);
      effect.set_direction_deg(90);
      break;
    case Target::kWorldX: effect.set_acts_on(Effect::WORLD_DRIFT); break;
    case Target::kWorldY:
      effect.set_acts_on(Effect::WORLD_DRIFT);
      effect.set_direction_deg(90);
      break;
    case Target::kMeasuredX: effect.set_acts_on(Effect::MEASURED_OFFSET); break;
    case Target::kMeasuredY:
      effect.set_acts_on(Effect::MEASURED_OFFSET);
      effect.set_direction_deg(90);
      break;
    case Target::kMeasuredAhead: effect.set_acts_on(Effect::MEASURED_BODY_OFFSET); break;
    case Target::kMeasuredLeft:
      effect.set_acts_on(Effect::MEASURED_BODY_OFFSET);
      effect.set_direction_deg(90);
      break;
    case Target::kMeasuredScale: effect.set_acts_on(Effect::MEASURED_SCALE); break;
    case Target::kMeasuredTurn:
    case Target::kMeasuredHeading: effect.set_acts_on(Effect::MEASURED_HEADING); break;
  }
}

/// Effect of a small rotation of the image on one axis: x' = x - turn y, y' = y + turn x.
Effect turned_position(const Effect& turn, Target axis) {
  Effect effect = turn;
  set_target(effect, axis);
  Function& other = *effect.add_function();
  other.set_of(axis == Target::kMeasuredX ? Function::Y : Function::X);
  other.mutable_linear()->set_slope(axis == Target::kMeasuredX ? -1 : 1);
  return effect;
}

}  // namespace

proto::Function function_of(const Axis& axis) {
  Factor factor;
  factor.axis = axis;
  Function function;
  set_axis(function, factor);
  return function;
}

std::string field_name(std::uint8_t cells) {
  return fmt::format("{}{}", cells >= kFirstTrailGrid ? kTrailField : "traffic-", cells);
}

double rounded(double value) {
  if (!std::isfinite(value)) return 0;
  const std::string digits = fmt::format("{:.7g}", value);
  double result = 0;
  std::from_chars(digits.data(), digits.data() + digits.size(), result);
  return result;
}

const char* form_of(const Term& term) {
  if (term.general) return "table";
  if (term.blocks.empty() || term.blocks.front().basis.factors.empty()) return "constant";
  if (term.blocks.front().basis.factors.size() > 1) return "product";
  switch (term.blocks.front().basis.factors.front().shape) {
    case Shape::kLinear: return "linear";
    case Shape::kCosines:
    case Shape::kPointShift:
    case Shape::kTaper: return "curve";
    case Shape::kCosines2:
    case Shape::kPolynomials2:
    case Shape::kGrid: return "map";
    case Shape::kHarmonics:
    case Shape::kWave: return "harmonic";
    case Shape::kTravelling: return "wave";
    case Shape::kTable: return "table";
    case Shape::kAtLeast: return "steps";
    case Shape::kExponential:
    case Shape::kLevelling: return "exponential";
  }
  return "curve";
}

std::vector<Effect> effects_of_term(const Term& term) {
  std::vector<Effect> effects;
  Eigen::Index first = 0;
  for (const Block& block : term.blocks) {
    const auto own = static_cast<Eigen::Index>(block.basis.size());
    std::size_t columns = 1;
    for (const Factor& factor : block.basis.factors) columns *= factor.size();
    Eigen::VectorXd coefficients = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(columns));
    for (Eigen::Index i = 0; i < own; ++i) {
      const Eigen::Index at = block.basis.chosen.empty()
                                  ? i
                                  : static_cast<Eigen::Index>(block.basis.chosen[static_cast<std::size_t>(i)]);
      coefficients[at] = term.coefficients[first + i];
    }
    first += own;
    const std::vector<std::vector<Function>> products = products_of(block.basis.factors, 0, coefficients);
    for (const std::vector<Function>& product : products) {
      Effect effect;
      set_target(effect, block.target);
      // The columns of a block add up; gains of different blocks multiply.
      if (products.size() > 1 && effect.acts_on() == Effect::WHEEL_GAIN)
        effect.set_sum(fmt::format("{}-{}", term.name, &block - term.blocks.data() + 1));
      if (!is_measured(block.target) && block.during != kDriven) {
        for (int command = 0; command < 4; ++command)
          if ((block.during >> command & 1) != 0) effect.add_during(static_cast<proto::Command>(command));
      }
      for (const Function& function : product) *effect.add_function() = function;
      if (block.target == Target::kMeasuredTurn) {
        effects.push_back(turned_position(effect, Target::kMeasuredX));
        effects.push_back(turned_position(effect, Target::kMeasuredY));
      }
      effects.push_back(std::move(effect));
    }
  }
  for (std::size_t i = 0; i < effects.size(); ++i)
    effects[i].set_name(effects.size() == 1 ? term.name : fmt::format("{}-{}", term.name, i + 1));
  return effects;
}

}  // namespace kilotwin::identify
