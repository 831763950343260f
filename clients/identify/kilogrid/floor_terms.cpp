#include <algorithm>
#include <array>
#include <cmath>

#include "clients/identify/kilogrid/floor_records.hpp"
#include "core/math/elementary.h"

namespace kilotwin::kilogrid {
namespace {

using proto::Effect, proto::Function;

void add_noise(FloorSettings& settings, const char* name, Effect::Target target, double sd, double correlation_s) {
  proto::Noise& noise = *add_function(add_effect(settings, name, target), Function::NOTHING).mutable_noise();
  noise.set_sd(sd);
  noise.set_correlation_s(correlation_s);
}

/// v: episodes per hour, their scale in s, their tail.
void set_episodes(Function& function, std::span<const double> v) {
  proto::Episodes& episodes = *function.mutable_episodes();
  episodes.set_mean_apart_s(3600 / std::max(v[0], 0.0036));
  episodes.set_scale_s(v[1]);
  episodes.set_tail(v[2]);
}

/// A table of values per robot, from a normal score z. Successive robots cover the distribution evenly (a
/// low-discrepancy sequence with increment `step`), so small swarms represent it. Independent tables use different
/// steps.
void add_table_of_robots(Effect& effect, double step, const std::function<double(double z)>& value) {
  constexpr std::uint32_t kRobots = 256;  // robots with a value; a larger swarm needs a longer table
  proto::Table& table = *add_function(effect, Function::ROBOT).mutable_table();
  for (std::uint32_t robot = 0; robot < kRobots; ++robot) {
    const double share = (robot + 0.5) * step;
    table.add_key(robot);
    table.add_value(value(kt_inverse_normal(share - std::floor(share))));
  }
}

/// Gains distributed as z + skew (z^2 - 1).
void add_speeds(FloorSettings& settings, double sd, double skew) {
  // Increment of the sequence, and least gain: at -1 robots would stand still. A lower one would let robots drive
  // backwards.
  constexpr double kGolden = 0.6180339887498949, kSlowest = -0.95;
  add_table_of_robots(add_effect(settings, "speed-of-robots", Effect::WHEEL_GAIN), kGolden, [=](double z) {
    return std::max(sd * (z + skew * (z * z - 1)) / std::sqrt(1 + 2 * skew * skew), kSlowest);
  });
}

/// Straight speeds distributed as z + skew (z^2 - 1). Turning speeds and biases stay.
void add_straight_speeds(FloorSettings& settings, double sd_mm_s, double skew) {
  constexpr double kGolden = 0.6180339887498949;  // increment of the sequence, as of other speeds
  Effect& effect = add_effect(settings, "straight-speed-of-robots", Effect::WHEEL_OFFSET);
  effect.add_during(proto::STRAIGHT);
  const double slowest_mm_s = 0.5 - settings.model.motion().straight_speed_mm_s();
  add_table_of_robots(effect, kGolden, [=](double z) {
    return std::max(sd_mm_s * (z + skew * (z * z - 1)) / std::sqrt(1 + 2 * skew * skew), slowest_mm_s);
  });
}

/// Turn rates distributed as z + tail z^3.
void add_turning(FloorSettings& settings, double sd, double tail) {
  // Increment other than kGolden, so that turning does not depend on the speed.
  constexpr double kSilver = 0.41421356237309505;
  const double scale = sd / std::sqrt(1 + 6 * tail + 15 * tail * tail);
  add_table_of_robots(add_effect(settings, "turning-of-robots", Effect::TURN_RATE), kSilver,
                      [=](double z) { return scale * (z + tail * z * z * z); });
}

void add_harmonic(Function& function, double cosine, double sine, double period) {
  function.mutable_harmonic()->set_cosine(cosine);
  function.mutable_harmonic()->set_sine(sine);
  function.mutable_harmonic()->set_period(period);
}

/// Robots that differ from each other.
void add_terms_of_robots(std::vector<FloorTerm>& terms) {
  terms.push_back({"speed-of-robots",
                   {"robot"},
                   "WHEEL_GAIN",
                   "speed differs between robots: relative standard deviation {0:.2f}, skewness {1:+.2f}",
                   "",
                   {{"sd", 0, 0, 0.5, 0.25}, {"skew", 0, -0.6, 0.6, 0.2}},
                   1,
                   [](std::span<const double> v, FloorSettings& s) { add_speeds(s, v[0], v[1]); }});
  terms.push_back(
      {"straight-speed-of-robots",
       {"robot", "command"},
       "WHEEL_OFFSET",
       "straight speed differs between robots, turning speed does not: standard deviation {0:.1f} mm/s, "
       "skewness {1:+.2f}",
       "",
       {{"sd_mm_s", 0, 0, 6, 2.5}, {"skew", -0.2, -0.6, 0.6, 0.2}},
       1,
       [](std::span<const double> v, FloorSettings& s) { add_straight_speeds(s, v[0], v[1]); }});
  terms.push_back({"turning-of-robots",
                   {"robot"},
                   "TURN_RATE",
                   "turn rate differs between robots: standard deviation {0:.3f} rad/s, heavy tail {1:.2f}",
                   "",
                   {{"sd_rad_s", 0, 0, 0.4, 0.05}, {"tail", 0.1, 0, 0.5, 0.1}},
                   1,
                   [](std::span<const double> v, FloorSettings& s) { add_turning(s, v[0], v[1]); }});
}

/// Noise with a memory, and episodes at rest.
void add_terms_of_history(const Floor& floor, std::vector<FloorTerm>& terms) {
  terms.push_back({"wandering-turn",
                   {"history"},
                   "TURN_RATE",
                   "turn rate noise of {0:.3f} rad/s (standard deviation), correlated over {1:.0f} s",
                   "",
                   {{"sd_rad_s", 0, 0, 0.4, 0.05}, {"correlation_s", 200, 5, 3000, 100}},
                   1,
                   [](std::span<const double> v, FloorSettings& s) {
                     add_noise(s, "wandering-turn", Effect::TURN_RATE, v[0], v[1]);
                   }});
  terms.push_back({"wandering-speed",
                   {"history"},
                   "BODY_DRIFT",
                   "speed noise of {0:.2f} mm/s (standard deviation), correlated over {1:.0f} s",
                   "",
                   {{"sd_mm_s", 0, 0, 5, 1}, {"correlation_s", 300, 5, 3000, 150}},
                   1,
                   [](std::span<const double> v, FloorSettings& s) {
                     add_noise(s, "wandering-speed", Effect::BODY_DRIFT, v[0], v[1]);
                   }});
  terms.push_back({"stalls",
                   {"history"},
                   "WHEEL_GAIN",
                   "robots stall {0:.1f} times per hour, P(duration > t) = (1 + t / {1:.1f} s)^-{2:.2f}",
                   "",
                   {{"per_hour", 0, 0, 240, 25}, {"scale_s", 8, 1, 120, 4}, {"tail", 1.8, 1.1, 6, 0.3}},
                   1,
                   [](std::span<const double> v, FloorSettings& s) {
                     Effect& effect = add_effect(s, "stalls", Effect::WHEEL_GAIN);
                     add_function(effect, Function::NOTHING).set_constant(-1);
                     set_episodes(add_function(effect, Function::NOTHING), v);
                   }});
  terms.push_back({"stuck-beside-walls",
                   {"position", "history"},
                   "WHEEL_GAIN",
                   "within 50 mm of a wall robots stall {0:.1f} times per hour and wall, P(duration > t) = "
                   "(1 + t / {1:.0f} s)^-{2:.2f}",
                   "film robots at rest beside a wall: the motors are on, or off",
                   {{"per_hour", 0, 0, 120, 12}, {"scale_s", 40, 2, 300, 15}, {"tail", 1.2, 0.3, 5, 0.25}},
                   1,
                   [floor](std::span<const double> v, FloorSettings& s) {
                     for (const Side& side : sides_of(floor)) {
                       Effect& effect =
                           add_effect(s, (std::string("stuck-") + side.name).c_str(), Effect::WHEEL_GAIN);
                       add_beside(effect, side, -1);
                       set_episodes(add_function(effect, Function::NOTHING), v);
                     }
                   }});
}

void add_terms_of_time_and_place(const Floor& floor, std::vector<FloorTerm>& terms) {
  terms.push_back(
      {"slowing",
       {"time"},
       "WHEEL_GAIN",
       "speed falls by a share of {0:.2f} per hour",
       "run time and motor-on time coincide, since motors never rest: let some robots rest for half of a run",
       {{"per_hour", 0, -1, 2, 0.3}},
       1,
       [](std::span<const double> v, FloorSettings& s) {
         const double rate = std::abs(v[0]) < 1e-4 ? 1e-4 : v[0];
         proto::Exponential& decay =
             *add_function(add_effect(s, "slowing", Effect::WHEEL_GAIN), Function::TIME).mutable_exponential();
         decay.set_at_zero(0);
         decay.set_at_infinity(-1);
         decay.set_scale(3600 / rate);
       }});
  terms.push_back({"crowd",
                   {"neighbours"},
                   "WHEEL_GAIN",
                   "neighbours within {1:.0f} mm change the wheel gain by up to {0:+.2f}",
                   "",
                   {{"gain", 0, -0.95, 1, 0.3}, {"radius_mm", 50, 34, 120, 10}},
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
                   "the wheel gain changes by {0:+.2f} in the middle of the floor, falling to 0 at the walls",
                   "",
                   {{"gain", 0, -0.9, 0.9, 0.25}},
                   1,
                   [floor](std::span<const double> v, FloorSettings& s) {
                     Effect& effect = add_effect(s, "middle", Effect::WHEEL_GAIN);
                     add_harmonic(add_function(effect, Function::X), v[0], 0, 2 * floor.width_mm);
                     add_harmonic(add_function(effect, Function::Y), 1, 0, 2 * floor.height_mm);
                   }});
  terms.push_back(
      {"slope-of-speed",
       {"position"},
       "WHEEL_GAIN",
       "speed changes linearly over the floor: by {0:+.2f} at the right end and {1:+.2f} at the upper end",
       "",
       {{"x", 0, -0.6, 0.6, 0.2}, {"y", 0, -0.6, 0.6, 0.2}},
       2,
       [floor](std::span<const double> v, FloorSettings& s) {
         add_harmonic(add_function(add_effect(s, "slope-x", Effect::WHEEL_GAIN), Function::X), 0, v[0],
                      2 * floor.width_mm);
         add_harmonic(add_function(add_effect(s, "slope-y", Effect::WHEEL_GAIN), Function::Y), 0, v[1],
                      2 * floor.height_mm);
       }});
}

/// Directions of the arena.
void add_terms_of_direction(const Floor& floor, std::vector<FloorTerm>& terms) {
  terms.push_back({"grain",
                   {"heading", "world_frame"},
                   "WHEEL_GAIN",
                   "speed depends on the heading (second harmonic), by {0:+.3f} and {1:+.3f}",
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
       "robots drift by {0:+.2f} and {1:+.2f} mm/s along x and y",
       "",
       {{"x_mm_s", 0, -3, 3, 0.8}, {"y_mm_s", 0, -3, 3, 0.8}},
       2,
       [](std::span<const double> v, FloorSettings& s) {
         add_function(add_effect(s, "drift-x", Effect::WORLD_DRIFT), Function::NOTHING).set_constant(v[0]);
         Effect& effect = add_effect(s, "drift-y", Effect::WORLD_DRIFT);
         effect.set_direction_deg(90);
         add_function(effect, Function::NOTHING).set_constant(v[1]);
       }});
  terms.push_back(
      {"to-the-middle",
       {"position", "world_frame"},
       "WORLD_DRIFT",
       "robots drift towards the middle lines of the floor, by {0:+.2f} mm/s beside the walls along x and {1:+.2f} "
       "along y, falling to 0 in the middle",
       "level the floor with a spirit level, or tap robots at rest on it: a slope makes them slide",
       {{"x_mm_s", 0, -2, 2, 0.3}, {"y_mm_s", 0, -2, 2, 0.3}},
       2,
       [floor](std::span<const double> v, FloorSettings& s) {
         add_harmonic(add_function(add_effect(s, "to-the-middle-x", Effect::WORLD_DRIFT), Function::X), 0, -v[0],
                      2 * floor.width_mm);
         Effect& effect = add_effect(s, "to-the-middle-y", Effect::WORLD_DRIFT);
         effect.set_direction_deg(90);
         add_harmonic(add_function(effect, Function::Y), 0, -v[1], 2 * floor.height_mm);
       }});
}

void add_terms_of_commands(std::vector<FloorTerm>& terms) {
  terms.push_back({"slow-start",
                   {"time_since_command"},
                   "WHEEL_GAIN",
                   "after a command the wheel gain starts with a change of {0:+.2f}, which decays within {1:.1f} s",
                   "",
                   {{"gain", 0, -0.95, 0.95, 0.4}, {"scale_s", 2, 0.2, 15, 1}},
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
                   "robots that drive straight turn by {0:+.3f} rad/s on average",
                   "",
                   {{"rad_s", 0, -0.2, 0.2, 0.04}},
                   1,
                   [](std::span<const double> v, FloorSettings& s) {
                     Effect& effect = add_effect(s, "pull", Effect::TURN_RATE);
                     effect.add_during(proto::STRAIGHT);
                     add_function(effect, Function::NOTHING).set_constant(v[0]);
                   }});
}

}  // namespace

FloorTerm base_term() {
  FloorTerm term{"base", {}, "", "", "", {}, 0, {}};
  term.parameters = {{"straight_speed_mm_s", 11.5, 3, 20, 1.2},
                     {"turn_speed_mm_s", 19, 5, 40, 3},
                     {"bias_sd_mm_s", 1.2, 0.05, 4, 0.4},
                     {"factor_variance_s", 0.06, 0, 2, 0.06},
                     {"range_mm", 47, 35, 70, 2},
                     {"heard", 0.97, 0.1, 1, 0.08},
                     {"heard_sd", 0.12, 0, 0.5, 0.06},
                     {"wall_range_mm", 52, 20, 75, 3},
                     {"wall_heard", 3.5, 0.3, 7, 1},
                     {"wall_noise", 4, 0.5, 60, 3},
                     {"while_talking", 0.15, 0.01, 1, 0.06},
                     {"same_cell", 0.12, 0.02, 0.5, 0.04},
                     {"in_turn", 0.6, 0, 1, 0.1},
                     {"blur_mm", 2, 0.5, 12, 1},
                     {"silent_s", 300, 30, 2000, 60},
                     {"talking_s", 225, 20, 2000, 50}};
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
    s.radio.in_turn = v[12];
    s.radio.blur_mm = v[13];
    s.radio.silent_s = v[14];
    s.radio.talking_s = v[15];
  };
  return term;
}

std::vector<FloorTerm> candidate_terms(const Floor& floor) {
  std::vector<FloorTerm> terms;
  add_terms_of_robots(terms);
  add_terms_of_history(floor, terms);
  add_terms_of_time_and_place(floor, terms);
  add_terms_of_direction(floor, terms);
  add_terms_of_commands(terms);
  return terms;
}

}  // namespace kilotwin::kilogrid
