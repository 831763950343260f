#include "clients/identify/kilogrid/floor_model.hpp"

#include <algorithm>

namespace kilotwin::kilogrid {
namespace {

using proto::Effect, proto::Function;

constexpr double kForever_s = 1e6;

Effect& add_effect(FloorSettings& settings, const char* name, Effect::Target target) {
  Effect& effect = *settings.model.add_effect();
  effect.set_name(name);
  effect.set_acts_on(target);
  return effect;
}

Function& add_function(Effect& effect, Function::Covariate of) {
  Function& function = *effect.add_function();
  if (of != Function::NOTHING) function.set_of(of);
  return function;
}

void add_noise(FloorSettings& settings, const char* name, Effect::Target target, double sd, double correlation_s) {
  proto::Noise& noise = *add_function(add_effect(settings, name, target), Function::NOTHING).mutable_noise();
  noise.set_sd(sd);
  noise.set_correlation_s(correlation_s);
}

/// Slower by `drag` within `zone_mm` of either end of an axis.
void add_drag(FloorSettings& settings, const char* name, Function::Covariate axis, double half_mm, double drag,
              double zone_mm) {
  proto::Steps& steps = *add_function(add_effect(settings, name, Effect::WHEEL_GAIN), axis).mutable_steps();
  steps.add_at(zone_mm - half_mm);
  steps.add_at(half_mm - zone_mm);
  for (const double value : {-drag, 0.0, -drag}) steps.add_value(value);
}

void add_harmonic(Function& function, double cosine, double sine, double period) {
  function.mutable_harmonic()->set_cosine(cosine);
  function.mutable_harmonic()->set_sine(sine);
  function.mutable_harmonic()->set_period(period);
}

}  // namespace

FloorTerm base_term() {
  FloorTerm term{"base", {}, "", "", {}, 0, {}};
  term.parameters = {{"straight_speed_mm_s", 11, 3, 20, 1},
                     {"turn_speed_mm_s", 24, 5, 40, 3},
                     {"bias_sd_mm_s", 1, 0.05, 4, 0.3},
                     {"factor_variance_s", 0.15, 0, 2, 0.1},
                     {"range_mm", 50, 35, 70, 3},
                     {"heard", 0.7, 0.1, 1, 0.1},
                     {"heard_sd", 0.25, 0, 0.5, 0.06},
                     {"wall_range_mm", 32, 20, 75, 4},
                     {"wall_heard", 0.6, 0.1, 1, 0.15},
                     {"wall_noise", 18, 1, 60, 6},
                     {"while_talking", 0.6, 0.05, 1, 0.15},
                     {"same_cell", 0.15, 0.02, 0.5, 0.05}};
  term.apply = [](std::span<const double> v, FloorSettings& s) {
    proto::Motion& motion = *s.model.mutable_motion();
    motion.set_straight_speed_mm_s(v[0]);
    motion.set_turn_speed_mm_s(v[1]);
    motion.set_bias_mean_mm_s(0);
    motion.set_bias_sd_mm_s(v[2]);
    motion.set_factor_variance_s(v[3]);
    s.radio.range_mm = v[4];
    s.radio.heard = v[5];
    s.radio.heard_sd = v[6];
    s.radio.wall_range_mm = v[7];
    s.radio.wall_heard = v[8];
    s.radio.wall_noise = v[9];
    s.radio.while_talking = v[10];
    for (std::size_t i = 1; i < 4; ++i) s.radio.later[i] *= 4 * (1 - v[11]) / 3;
    s.radio.later[0] = v[11];
  };
  return term;
}

std::vector<FloorTerm> candidate_terms(const Floor& floor) {
  const double half_x_mm = floor.width_mm / 2, half_y_mm = floor.height_mm / 2;
  std::vector<FloorTerm> terms;
  terms.push_back({"speed-of-robots",
                   {"robot"},
                   "BODY_DRIFT",
                   "",
                   {{"sd_mm_s", 0, 0, 5, 0.8}},
                   1,
                   [](std::span<const double> v, FloorSettings& s) {
                     add_noise(s, "speed-of-robots", Effect::BODY_DRIFT, v[0], kForever_s);
                   }});
  terms.push_back({"wandering-turn",
                   {"history"},
                   "TURN_RATE",
                   "",
                   {{"sd_rad_s", 0, 0, 0.4, 0.05}, {"correlation_s", 60, 5, 600, 30}},
                   1,
                   [](std::span<const double> v, FloorSettings& s) {
                     add_noise(s, "wandering-turn", Effect::TURN_RATE, v[0], v[1]);
                   }});
  terms.push_back({"wandering-speed",
                   {"history"},
                   "BODY_DRIFT",
                   "",
                   {{"sd_mm_s", 0, 0, 5, 0.8}, {"correlation_s", 120, 5, 900, 60}},
                   1,
                   [](std::span<const double> v, FloorSettings& s) {
                     add_noise(s, "wandering-speed", Effect::BODY_DRIFT, v[0], v[1]);
                   }});
  terms.push_back({"stalls",
                   {"history"},
                   "WHEEL_GAIN",
                   "",
                   {{"per_hour", 0, 0, 240, 12}, {"scale_s", 8, 1, 120, 4}, {"tail", 1.8, 1.1, 6, 0.3}},
                   1,
                   [](std::span<const double> v, FloorSettings& s) {
                     Effect& effect = add_effect(s, "stalls", Effect::WHEEL_GAIN);
                     add_function(effect, Function::NOTHING).set_constant(-1);
                     proto::Episodes& episodes = *add_function(effect, Function::NOTHING).mutable_episodes();
                     episodes.set_mean_apart_s(3600 / std::max(v[0], 0.0036));
                     episodes.set_scale_s(v[1]);
                     episodes.set_tail(v[2]);
                   }});
  terms.push_back(
      {"slowing",
       {"time"},
       "WHEEL_GAIN",
       "the clock and the motors' own time are one here, since motors never rest: let some robots rest for half of "
       "a run",
       {{"per_hour", 0, -1, 2, 0.12}},
       1,
       [](std::span<const double> v, FloorSettings& s) {
         const double rate = std::abs(v[0]) < 1e-4 ? 1e-4 : v[0];
         proto::Exponential& decay =
             *add_function(add_effect(s, "slowing", Effect::WHEEL_GAIN), Function::TIME).mutable_exponential();
         decay.set_at_zero(0);
         decay.set_at_infinity(-1);
         decay.set_scale(3600 / rate);
       }});
  terms.push_back({"wall-drag",
                   {"position"},
                   "WHEEL_GAIN",
                   "drag at the wall and what the walls' messages make robots do act in the same place: let robots "
                   "drive along a wall without them",
                   {{"drag", 0, 0, 0.98, 0.6}, {"zone_mm", 26, 18, 80, 6}},
                   1,
                   [half_x_mm, half_y_mm](std::span<const double> v, FloorSettings& s) {
                     add_drag(s, "wall-drag-x", Function::X, half_x_mm, v[0], v[1]);
                     add_drag(s, "wall-drag-y", Function::Y, half_y_mm, v[0], v[1]);
                   }});
  terms.push_back({"crowd",
                   {"neighbours"},
                   "WHEEL_GAIN",
                   "",
                   {{"gain", 0, -0.95, 1, 0.15}, {"radius_mm", 50, 34, 120, 10}},
                   1,
                   [](std::span<const double> v, FloorSettings& s) {
                     Function& function =
                         add_function(add_effect(s, "crowd", Effect::WHEEL_GAIN), Function::DENSITY);
                     function.set_radius_mm(v[1]);
                     function.mutable_exponential()->set_at_zero(0);
                     function.mutable_exponential()->set_at_infinity(v[0]);
                     function.mutable_exponential()->set_scale(1);
                   }});
  terms.push_back({"middle",
                   {"position"},
                   "WHEEL_GAIN",
                   "",
                   {{"gain", 0, -0.9, 0.9, 0.12}},
                   1,
                   [floor](std::span<const double> v, FloorSettings& s) {
                     Effect& effect = add_effect(s, "middle", Effect::WHEEL_GAIN);
                     add_harmonic(add_function(effect, Function::X), v[0], 0, 2 * floor.width_mm);
                     add_harmonic(add_function(effect, Function::Y), 1, 0, 2 * floor.height_mm);
                   }});
  terms.push_back({"slope-of-speed",
                   {"position"},
                   "WHEEL_GAIN",
                   "",
                   {{"x", 0, -0.6, 0.6, 0.12}, {"y", 0, -0.6, 0.6, 0.12}},
                   2,
                   [floor](std::span<const double> v, FloorSettings& s) {
                     add_harmonic(add_function(add_effect(s, "slope-x", Effect::WHEEL_GAIN), Function::X), 0, v[0],
                                  2 * floor.width_mm);
                     add_harmonic(add_function(add_effect(s, "slope-y", Effect::WHEEL_GAIN), Function::Y), 0, v[1],
                                  2 * floor.height_mm);
                   }});
  terms.push_back({"grain",
                   {"heading", "world_frame"},
                   "WHEEL_GAIN",
                   "",
                   {{"cosine", 0, -0.5, 0.5, 0.1}, {"sine", 0, -0.5, 0.5, 0.1}},
                   2,
                   [](std::span<const double> v, FloorSettings& s) {
                     add_harmonic(add_function(add_effect(s, "grain", Effect::WHEEL_GAIN), Function::HEADING), v[0],
                                  v[1], 3.141592653589793);
                   }});
  terms.push_back(
      {"drift",
       {"world_frame"},
       "WORLD_DRIFT",
       "",
       {{"x_mm_s", 0, -3, 3, 0.4}, {"y_mm_s", 0, -3, 3, 0.4}},
       2,
       [](std::span<const double> v, FloorSettings& s) {
         add_function(add_effect(s, "drift-x", Effect::WORLD_DRIFT), Function::NOTHING).set_constant(v[0]);
         Effect& effect = add_effect(s, "drift-y", Effect::WORLD_DRIFT);
         effect.set_direction_deg(90);
         add_function(effect, Function::NOTHING).set_constant(v[1]);
       }});
  terms.push_back({"slow-start",
                   {"time_since_command"},
                   "WHEEL_GAIN",
                   "",
                   {{"gain", 0, -0.95, 0.95, 0.2}, {"scale_s", 2, 0.2, 15, 1}},
                   1,
                   [](std::span<const double> v, FloorSettings& s) {
                     proto::Exponential& e = *add_function(add_effect(s, "slow-start", Effect::WHEEL_GAIN),
                                                           Function::TIME_SINCE_COMMAND)
                                                  .mutable_exponential();
                     e.set_at_zero(v[0]);
                     e.set_at_infinity(0);
                     e.set_scale(v[1]);
                   }});
  terms.push_back({"pull",
                   {},
                   "TURN_RATE",
                   "",
                   {{"rad_s", 0, -0.2, 0.2, 0.02}},
                   1,
                   [](std::span<const double> v, FloorSettings& s) {
                     Effect& effect = add_effect(s, "pull", Effect::TURN_RATE);
                     effect.add_during(proto::STRAIGHT);
                     add_function(effect, Function::NOTHING).set_constant(v[0]);
                   }});
  return terms;
}

void FloorModel::add(const FloorTerm& term) {
  terms.push_back(term);
  for (const FloorParameter& parameter : term.parameters) values.push_back(parameter.start);
}

std::size_t FloorModel::first_of(std::size_t term) const {
  std::size_t first = 0;
  for (std::size_t t = 0; t < term; ++t) first += terms[t].parameters.size();
  return first;
}

std::vector<FloorParameter> FloorModel::parameters() const {
  std::vector<FloorParameter> all;
  for (const FloorTerm& term : terms) all.insert(all.end(), term.parameters.begin(), term.parameters.end());
  return all;
}

FloorSettings FloorModel::settings(std::span<const double> values_of_all) const {
  FloorSettings settings;
  settings.radio.rim = rim;
  settings.radio.later = later;
  std::size_t first = 0;
  for (const FloorTerm& term : terms) {
    term.apply(values_of_all.subspan(first, term.parameters.size()), settings);
    first += term.parameters.size();
  }
  return settings;
}

FloorModel FloorModel::without(std::size_t term) const {
  FloorModel less;
  less.rim = rim;
  less.later = later;
  for (std::size_t t = 0; t < terms.size(); ++t) {
    if (t == term) continue;
    less.terms.push_back(terms[t]);
    const std::size_t first = first_of(t);
    less.values.insert(less.values.end(), values.begin() + static_cast<std::ptrdiff_t>(first),
                       values.begin() + static_cast<std::ptrdiff_t>(first + terms[t].parameters.size()));
  }
  return less;
}

}  // namespace kilotwin::kilogrid
