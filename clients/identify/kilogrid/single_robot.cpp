#include "clients/identify/kilogrid/single_robot.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/pose.hpp"
#include "core/effects/episodes.hpp"
#include "core/math/elementary.h"
#include "core/plan/from_manifest.hpp"

namespace kilotwin::kilogrid {

using proto::Effect, proto::Function;

SingleRobot::SingleRobot(const Floor& floor, const FloorSettings& settings) : floor_(floor), settings_(settings) {
  for (const Effect& effect : settings.model.effect()) {
    const bool is_gain = effect.acts_on() == Effect::WHEEL_GAIN;
    const bool left = effect.wheel() != Effect::RIGHT_WHEEL, right = effect.wheel() != Effect::LEFT_WHEEL;
    double along, across;
    kt_sincos(effect.direction_deg() * kPi / 180, &across, &along);
    Term term{is_gain && left,
              is_gain && right,
              unit_offsets(static_cast<EffectSettings::Target>(effect.acts_on()), left, right, along, across,
                           settings.model.motion().wheel_base_mm()),
              0,
              {}};
    for (const int command : effect.during())
      term.commands = static_cast<std::uint8_t>(term.commands | 1u << command);
    if (effect.during_size() == 0) term.commands = 0xe;
    for (const Function& f : effect.function()) {
      const double correlation_s = f.noise().correlation_s();
      const FunctionSettings settings_of_f = settings_of(f);
      const EpisodesShape episodes =
          settings_of_f.episodes() != nullptr ? *settings_of_f.episodes() : EpisodesShape{};
      Factor factor{EffectFunction(settings_of_f),
                    f.of(),
                    f.and_of(),
                    std::nullopt,
                    f.has_noise(),
                    f.has_episodes(),
                    correlation_s,
                    correlation_s > 0 ? kt_exp(-kStep_s / correlation_s) : 0,
                    episodes};
      if (factor.is_noise || factor.is_episodes) factor.slot = slots_++;
      if (f.of() == Function::DENSITY) neighbour_radius_mm_ = f.radius_mm();
      term.factors.push_back(std::move(factor));
    }
    terms_.push_back(std::move(term));
  }
}

RobotState SingleRobot::start(std::uint32_t number, double x_mm, double y_mm, double heading_rad,
                              Dice& dice) const {
  const double sd = settings_.model.motion().bias_sd_mm_s();
  RobotState state{number,
                   x_mm,
                   y_mm,
                   heading_rad,
                   sd * dice.normal(),
                   sd * dice.normal(),
                   0,
                   Motion::kStop,
                   FloorProgram(settings_.times, dice.bits()),
                   std::vector<double>(slots_, 0)};
  for (const Term& term : terms_) {
    for (const Factor& factor : term.factors) {
      if (factor.is_noise) state.memory[*factor.slot] = dice.normal();
      if (factor.is_episodes) state.memory[*factor.slot] = episode_wait_s(factor.episodes, dice.uniform());
    }
  }
  keep_inside(state);
  return state;
}

void SingleRobot::renew(RobotState& state, double keep, Dice& dice) const {
  const double fresh = std::sqrt(1 - keep * keep), sd = settings_.model.motion().bias_sd_mm_s();
  state.bias_left_mm_s = keep * state.bias_left_mm_s + fresh * sd * dice.normal();
  state.bias_right_mm_s = keep * state.bias_right_mm_s + fresh * sd * dice.normal();
  for (const Term& term : terms_) {
    for (const Factor& factor : term.factors) {
      if (factor.is_noise) state.memory[*factor.slot] = keep * state.memory[*factor.slot] + fresh * dice.normal();
    }
  }
}

void SingleRobot::keep_inside(RobotState& state) const {
  state.x_mm = std::clamp(state.x_mm, kRobotRadius_mm, floor_.width_mm - kRobotRadius_mm);
  state.y_mm = std::clamp(state.y_mm, kRobotRadius_mm, floor_.height_mm - kRobotRadius_mm);
}

SingleRobot::Driven SingleRobot::run_program(RobotState& state, std::int64_t kilo_ticks, Dice& dice) const {
  // As often as in the engine: turns may be shorter than a step.
  constexpr std::int64_t kEvery = 4;  // kilo_ticks
  constexpr double kPart = static_cast<double>(kEvery) / kStepTicks;
  const FloorRadio& radio = settings_.radio;
  const double heard = radio.wall_heard * kStep_s * kPart;
  // Boundary cell centres have at least this distance from the wall.
  const double wall_mm = std::min(std::min(state.x_mm, floor_.width_mm - state.x_mm),
                                  std::min(state.y_mm, floor_.height_mm - state.y_mm));
  const double farthest_mm = radio.wall_range_mm + 4 * radio.wall_noise;
  const bool may_hear = wall_mm - floor_.cell_mm / 2 < farthest_mm;
  double reading_mm = -1;
  Driven driven;
  for (std::int64_t t = 0; t < kStepTicks; t += kEvery) {
    if (may_hear && dice.uniform() < heard) {
      if (reading_mm < 0) reading_mm = boundary_cell_distance_mm(floor_, state.x_mm, state.y_mm);
      // The program compares readings only, so the offset is arbitrary.
      constexpr double kStrongest = 1000;
      const double noisy_mm = reading_mm < farthest_mm ? reading_mm + radio.wall_noise * dice.normal() : reading_mm;
      if (noisy_mm < radio.wall_range_mm) state.program.hear_wall(kilo_ticks + t, kStrongest - noisy_mm);
    }
    const Motion motion = state.program.loop(kilo_ticks + t);
    state.since_command_s = motion == state.motion ? state.since_command_s + kStep_s * kPart : 0;
    state.motion = motion;
    driven.straight += motion == Motion::kStraight ? kPart : 0;
    driven.left += motion == Motion::kLeft ? kPart : 0;
    driven.right += motion == Motion::kRight ? kPart : 0;
  }
  return driven;
}

void SingleRobot::step(RobotState& state, std::int64_t k, Dice& dice, double neighbours) const {
  const Driven driven = run_program(state, k * kStepTicks, dice);
  if (state.motion == Motion::kStop) return remember(state, dice);
  const proto::Motion& base = settings_.model.motion();
  const double spread = std::sqrt(base.factor_variance_s() / kStep_s);
  double left = driven.straight * base.straight_speed_mm_s() + driven.right * base.turn_speed_mm_s();
  double right = driven.straight * base.straight_speed_mm_s() + driven.left * base.turn_speed_mm_s();
  left = (left + state.bias_left_mm_s) * (1 + spread * dice.normal());
  right = (right + state.bias_right_mm_s) * (1 + spread * dice.normal());
  MotionChange change;
  for (const Term& term : terms_) {
    const double value = value_of(term, state, static_cast<double>(k) * kStep_s, neighbours, dice);
    if (term.left_gain) change.left_gain *= 1 + value;
    if (term.right_gain) change.right_gain *= 1 + value;
    term.unit.add_to(change, value);
  }
  const DriveSpeeds speeds = changed_speeds(left, right, change, base.effects_limit_mm_s());
  const double turn_rad = (speeds.right_mm_s - speeds.left_mm_s) / base.wheel_base_mm() * kStep_s;
  // Second-order midpoint step: half of the turn before the displacement, half after. The reference point lies
  // behind the centre.
  double s, c, s1, c1, s2, c2;
  kt_sincos(state.heading_rad, &s, &c);
  kt_sincos(state.heading_rad + turn_rad / 2, &s1, &c1);
  state.heading_rad = wrapped(state.heading_rad + turn_rad);
  kt_sincos(state.heading_rad, &s2, &c2);
  const double way = (speeds.left_mm_s + speeds.right_mm_s) / 2 * kStep_s, across = speeds.sideways_mm_s * kStep_s;
  const double offset = base.axle_offset_mm();
  state.x_mm += c1 * way - s1 * across + speeds.drift_x_mm_s * kStep_s + offset * (c2 - c);
  state.y_mm += s1 * way + c1 * across + speeds.drift_y_mm_s * kStep_s + offset * (s2 - s);
  keep_inside(state);
  remember(state, dice);
}

double SingleRobot::covariate(Function::Covariate of, const RobotState& state, double time_s,
                              double neighbours) const {
  const double x = state.x_mm - floor_.width_mm / 2, y = state.y_mm - floor_.height_mm / 2;
  switch (of) {
    case Function::TIME:
    case Function::DRIVEN_TIME:
    case Function::MOTOR_TIME: return time_s;
    case Function::X: return x;
    case Function::Y: return y;
    case Function::RADIUS: return std::sqrt(x * x + y * y);
    case Function::HEADING: return state.heading_rad;
    case Function::ROBOT: return state.number;
    case Function::COMMAND: return static_cast<double>(state.motion);
    case Function::TIME_SINCE_COMMAND: return state.since_command_s;
    case Function::DENSITY: return neighbours;
    default: return 0;
  }
}

double SingleRobot::value_of(const Term& term, const RobotState& state, double time_s, double neighbours,
                             Dice& dice) const {
  if ((term.commands & 1u << static_cast<unsigned>(state.motion)) == 0) return 0;
  double value = 1;
  for (const Factor& factor : term.factors) {
    if (factor.is_episodes && !(state.memory[*factor.slot] < 0)) return 0;
    value *= factor.function(covariate(factor.of, state, time_s, neighbours),
                             covariate(factor.and_of, state, time_s, neighbours));
    if (value == 0) return 0;
    if (factor.is_noise)
      value *= factor.correlation_s > 0 ? state.memory[*factor.slot] : dice.normal() / std::sqrt(kStep_s);
  }
  return value;
}

void SingleRobot::remember(RobotState& state, Dice& dice) const {
  for (const Term& term : terms_) {
    for (const Factor& factor : term.factors) {
      if (!factor.slot) continue;
      double& slot = state.memory[*factor.slot];
      if (factor.is_noise && factor.correlation_s > 0) {
        slot = factor.keep * slot + std::sqrt(1 - factor.keep * factor.keep) * dice.normal();
      } else if (factor.is_episodes) {
        // Counts down to the next episode, then up to its end.
        const bool on = slot < 0;
        slot += on ? kStep_s : -kStep_s;
        if (on && slot >= 0) slot = episode_wait_s(factor.episodes, dice.uniform());
        if (!on && slot <= 0) {
          slot = -std::clamp(episode_length_s(factor.episodes, dice.uniform()), kStep_s, factor.episodes.longest_s);
        }
      }
    }
  }
}

}  // namespace kilotwin::kilogrid
