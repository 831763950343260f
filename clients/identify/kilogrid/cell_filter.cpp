#include "clients/identify/kilogrid/cell_filter.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/pose.hpp"
#include "core/effects/function.hpp"
#include "core/math/elementary.h"

namespace kilotwin::kilogrid {
namespace {

using proto::Effect, proto::Function;

constexpr std::int64_t kStepTicks = 16;
constexpr double kStep_s = kStepTicks * 0.032768;
constexpr double kEvery_s = 5, kFirst_s = 10;
/// Of a report to come from anywhere: what the kernel does not know.
constexpr double kAstray = 2e-4;
/// How far copies of a particle part, and how many of them get a new heading.
constexpr double kPart_mm = 4, kPart_rad = 0.15, kTurned = 0.1;

/// One term of the model for a robot alone.
struct LoneTerm {
  Effect::Target target;
  bool left, right;
  double along, across;
  std::uint8_t commands;
  struct Factor {
    EffectFunction function;
    Function::Covariate of, and_of;
    std::optional<std::size_t> slot;  ///< of what it remembers
    bool is_noise, is_episodes;
    double correlation_s;
    proto::Episodes episodes;
  };
  std::vector<Factor> factors;
};

/// Numbers that a robot may have in the model, where it knows them apart.
constexpr std::uint64_t kNumbers = 100;

struct Particle {
  std::uint32_t number;            ///< which one it may be
  double x_mm, y_mm, heading_rad;  ///< of the disc's centre
  double bias_left_mm_s, bias_right_mm_s;
  double since_command_s;
  Motion motion;
  FloorProgram program;
  std::vector<double> memory;
};

class LoneRobot {
 public:
  LoneRobot(const Floor& floor, const FloorSettings& settings) : floor_(floor), settings_(settings) {
    for (const Effect& effect : settings.model.effect()) {
      LoneTerm term{effect.acts_on(),
                    effect.wheel() != Effect::RIGHT_WHEEL,
                    effect.wheel() != Effect::LEFT_WHEEL,
                    1,
                    0,
                    0,
                    {}};
      kt_sincos(effect.direction_deg() * kPi / 180, &term.across, &term.along);
      for (const int command : effect.during())
        term.commands = static_cast<std::uint8_t>(term.commands | 1u << command);
      if (effect.during_size() == 0) term.commands = 0xe;
      for (const Function& f : effect.function()) {
        LoneTerm::Factor factor{
            EffectFunction(f),         f.of(),      f.and_of(), std::nullopt, f.has_noise(), f.has_episodes(),
            f.noise().correlation_s(), f.episodes()};
        if (factor.is_noise || factor.is_episodes) factor.slot = slots_++;
        term.factors.push_back(std::move(factor));
      }
      terms_.push_back(std::move(term));
    }
  }

  /// What lasts for a robot is drawn again a little, so that no single draw is all that is left of it after a while.
  void renew(Particle& p, Dice& dice) const {
    const double keep = 0.97, fresh = std::sqrt(1 - keep * keep), sd = settings_.model.motion().bias_sd_mm_s();
    p.bias_left_mm_s = keep * p.bias_left_mm_s + fresh * sd * dice.normal();
    p.bias_right_mm_s = keep * p.bias_right_mm_s + fresh * sd * dice.normal();
    for (const LoneTerm& term : terms_) {
      for (const LoneTerm::Factor& factor : term.factors) {
        if (factor.is_noise) p.memory[*factor.slot] = keep * p.memory[*factor.slot] + fresh * dice.normal();
      }
    }
    if (dice.uniform() > keep) p.number = static_cast<std::uint32_t>(dice.bits() % kNumbers);
  }

  [[nodiscard]] Particle start(double x_mm, double y_mm, Dice& dice) const {
    const double sd = settings_.model.motion().bias_sd_mm_s();
    Particle p{static_cast<std::uint32_t>(dice.bits() % kNumbers),
               x_mm + 2 * floor_.cell_mm * (dice.uniform() - 0.5),
               y_mm + 2 * floor_.cell_mm * (dice.uniform() - 0.5),
               (2 * dice.uniform() - 1) * kPi,
               sd * dice.normal(),
               sd * dice.normal(),
               0,
               Motion::kStop,
               FloorProgram(settings_.times, dice.bits()),
               std::vector<double>(slots_, 0)};
    for (const LoneTerm& term : terms_) {
      for (const LoneTerm::Factor& factor : term.factors) {
        if (factor.is_noise) p.memory[*factor.slot] = dice.normal();
        if (factor.is_episodes) p.memory[*factor.slot] = -factor.episodes.mean_apart_s() * kt_log(dice.uniform());
      }
    }
    keep_inside(p);
    return p;
  }

  /// From step `k` to the next.
  void step(Particle& p, std::int64_t k, Dice& dice) const {
    const std::int64_t kilo_ticks = k * kStepTicks;
    hear_rim(p, kilo_ticks, dice);
    const Motion motion = p.program.loop(kilo_ticks);
    p.since_command_s = motion == p.motion ? p.since_command_s + kStep_s : 0;
    p.motion = motion;
    const proto::Motion& base = settings_.model.motion();
    double left = motion == Motion::kStraight ? base.straight_speed_mm_s()
                  : motion == Motion::kRight  ? base.turn_speed_mm_s()
                                              : 0;
    double right = motion == Motion::kStraight ? base.straight_speed_mm_s()
                   : motion == Motion::kLeft   ? base.turn_speed_mm_s()
                                               : 0;
    if (motion == Motion::kStop) return remember(p, dice);
    const double spread = std::sqrt(base.factor_variance_s() / kStep_s);
    left = (left + p.bias_left_mm_s) * (1 + spread * dice.normal());
    right = (right + p.bias_right_mm_s) * (1 + spread * dice.normal());
    double left_gain = 1, right_gain = 1, left_more = 0, right_more = 0, sideways = 0, drift_x = 0, drift_y = 0;
    const double half_base = base.wheel_base_mm() / 2;
    for (const LoneTerm& term : terms_) {
      const double value = value_of(term, p, static_cast<double>(k) * kStep_s, dice);
      if (value == 0) continue;
      switch (term.target) {
        case Effect::WHEEL_GAIN:
          left_gain *= term.left ? 1 + value : 1;
          right_gain *= term.right ? 1 + value : 1;
          break;
        case Effect::WHEEL_OFFSET:
          left_more += term.left ? value : 0;
          right_more += term.right ? value : 0;
          break;
        case Effect::TURN_RATE:
          left_more -= value * half_base;
          right_more += value * half_base;
          break;
        case Effect::BODY_DRIFT:
          left_more += value * term.along;
          right_more += value * term.along;
          sideways += value * term.across;
          break;
        case Effect::WORLD_DRIFT:
          drift_x += value * term.along;
          drift_y += value * term.across;
          break;
        default: break;
      }
    }
    left = left * left_gain + left_more;
    right = right * right_gain + right_more;
    const double turn_rad = (right - left) / base.wheel_base_mm() * kStep_s;
    // Half of the turn before and half after the way: good to the second order; the reference point lies behind the centre.
    double s, c, s1, c1, s2, c2;
    kt_sincos(p.heading_rad, &s, &c);
    kt_sincos(p.heading_rad + turn_rad / 2, &s1, &c1);
    p.heading_rad = wrapped(p.heading_rad + turn_rad);
    kt_sincos(p.heading_rad, &s2, &c2);
    const double way = (left + right) / 2 * kStep_s, across = sideways * kStep_s, offset = base.axle_offset_mm();
    p.x_mm += c1 * way - s1 * across + drift_x * kStep_s + offset * (c2 - c);
    p.y_mm += s1 * way + c1 * across + drift_y * kStep_s + offset * (s2 - s);
    keep_inside(p);
    remember(p, dice);
  }

  /// Of a report of the robot at this place to come from the cell.
  [[nodiscard]] double chance_of(const Particle& p, double cell_x_mm, double cell_y_mm) const {
    const double cell = floor_.cell_mm;
    const auto column = static_cast<int>(p.x_mm / cell), row = static_cast<int>(p.y_mm / cell);
    const int columns = static_cast<int>(floor_.width_mm / cell), rows = static_cast<int>(floor_.height_mm / cell);
    double all = 0;
    for (int r = std::max(row - 1, 0); r <= std::min(row + 1, rows - 1); ++r) {
      for (int c = std::max(column - 1, 0); c <= std::min(column + 1, columns - 1); ++c)
        all += kernel(p, (c + 0.5) * cell, (r + 0.5) * cell);
    }
    return (all > 0 ? kernel(p, cell_x_mm, cell_y_mm) / all : 0) + kAstray;
  }

 private:
  [[nodiscard]] double kernel(const Particle& p, double x_mm, double y_mm) const {
    const double dx = p.x_mm - x_mm, dy = p.y_mm - y_mm;
    // Wider than the floor's own: the filter's steps are coarse.
    const double over = (std::sqrt(dx * dx + dy * dy) - settings_.radio.range_mm) / (settings_.radio.blur_mm + 3);
    return 1 / (1 + kt_exp(std::min(over, 50.0)));
  }

  void keep_inside(Particle& p) const {
    p.x_mm = std::clamp(p.x_mm, kRobotRadius_mm, floor_.width_mm - kRobotRadius_mm);
    p.y_mm = std::clamp(p.y_mm, kRobotRadius_mm, floor_.height_mm - kRobotRadius_mm);
  }

  void hear_rim(Particle& p, std::int64_t kilo_ticks, Dice& dice) const {
    const FloorRadio& radio = settings_.radio;
    const double reading_mm = rim_cell_distance_mm(floor_, p.x_mm, p.y_mm);
    if (reading_mm > radio.wall_range_mm + 4 * radio.wall_noise) return;
    constexpr std::int64_t kHeardEvery = 4;  // kilo_ticks, as in the simulation
    for (std::int64_t t = 0; t < kStepTicks; t += kHeardEvery) {
      if (dice.uniform() > radio.wall_heard * kStep_s * kHeardEvery / kStepTicks) continue;
      const double noisy_mm = reading_mm + radio.wall_noise * dice.normal();
      if (noisy_mm < radio.wall_range_mm) p.program.hear_wall(kilo_ticks + t, 1000 - noisy_mm);
    }
  }

  [[nodiscard]] double covariate(Function::Covariate of, const Particle& p, double time_s) const {
    const double x = p.x_mm - floor_.width_mm / 2, y = p.y_mm - floor_.height_mm / 2;
    switch (of) {
      case Function::TIME:
      case Function::DRIVEN_TIME:
      case Function::MOTOR_TIME: return time_s;
      case Function::X: return x;
      case Function::Y: return y;
      case Function::RADIUS: return std::sqrt(x * x + y * y);
      case Function::HEADING: return p.heading_rad;
      case Function::ROBOT: return p.number;
      case Function::COMMAND: return static_cast<double>(p.motion);
      case Function::TIME_SINCE_COMMAND: return p.since_command_s;
      default: return 0;  // of neighbours: it has none
    }
  }

  [[nodiscard]] double value_of(const LoneTerm& term, const Particle& p, double time_s, Dice& dice) const {
    if ((term.commands & 1u << static_cast<unsigned>(p.motion)) == 0) return 0;
    double value = 1;
    for (const LoneTerm::Factor& factor : term.factors) {
      value *= factor.function(covariate(factor.of, p, time_s), covariate(factor.and_of, p, time_s));
      if (factor.is_episodes) value *= p.memory[*factor.slot] < 0 ? 1 : 0;
      if (factor.is_noise)
        value *= factor.correlation_s > 0 ? p.memory[*factor.slot] : dice.normal() / std::sqrt(kStep_s);
    }
    return value;
  }

  void remember(Particle& p, Dice& dice) const {
    for (const LoneTerm& term : terms_) {
      for (const LoneTerm::Factor& factor : term.factors) {
        if (!factor.slot) continue;
        double& slot = p.memory[*factor.slot];
        if (factor.is_noise && factor.correlation_s > 0) {
          const double keep = kt_exp(-kStep_s / factor.correlation_s);
          slot = keep * slot + std::sqrt(1 - keep * keep) * dice.normal();
        } else if (factor.is_episodes) {
          const bool on = slot < 0;
          slot += on ? kStep_s : -kStep_s;
          if (on && slot >= 0) slot = -factor.episodes.mean_apart_s() * kt_log(dice.uniform());
          if (!on && slot <= 0)
            slot =
                -std::clamp(factor.episodes.scale_s() * (kt_pow(dice.uniform(), -1 / factor.episodes.tail()) - 1),
                            kStep_s, factor.episodes.longest_s());
        }
      }
    }
  }

  const Floor& floor_;
  const FloorSettings& settings_;
  std::vector<LoneTerm> terms_;
  std::size_t slots_ = 0;
};

/// Draws as many particles as there are, each as often as its weight says.
void resample(const LoneRobot& robot, std::vector<Particle>& particles, std::vector<double>& weights, Dice& dice) {
  const std::size_t n = particles.size();
  std::vector<Particle> kept;
  kept.reserve(n);
  double at = dice.uniform() / static_cast<double>(n), below = weights[0];
  for (std::size_t i = 0, j = 0; i < n; ++i, at += 1 / static_cast<double>(n)) {
    while (at > below && j + 1 < n) below += weights[++j];
    kept.push_back(particles[j]);
    Particle& p = kept.back();
    p.program.reseed(dice.bits());
    robot.renew(p, dice);
    // Copies part, and some turn as the robot may just have: what the program does is not known.
    p.x_mm += kPart_mm * dice.normal();
    p.y_mm += kPart_mm * dice.normal();
    p.heading_rad = wrapped(dice.uniform() < kTurned ? (2 * dice.uniform() - 1) * kPi
                                                     : p.heading_rad + kPart_rad * dice.normal());
  }
  particles = std::move(kept);
  std::fill(weights.begin(), weights.end(), 1 / static_cast<double>(n));
}

}  // namespace

CellFilterResult filter_cells(const FloorTrack& track, const Floor& floor, const FloorSettings& settings,
                              double horizon_s, std::size_t count, std::uint64_t seed) {
  CellFilterResult result;
  Dice dice(seed);
  const LoneRobot robot(floor, settings);
  std::vector<Particle> particles;
  for (std::size_t i = 0; i < count; ++i)
    particles.push_back(robot.start(track.x_mm.front(), track.y_mm.front(), dice));
  std::vector<double> weights(count, 1 / static_cast<double>(count));
  auto k = static_cast<std::int64_t>(track.time_s.front() / kStep_s);
  std::size_t next = 1;
  const double end_s = track.time_s.back();
  double target_s = std::max(kFirst_s, kEvery_s * std::ceil((track.time_s.front() + horizon_s) / kEvery_s));
  std::size_t heard_next = 0;
  for (; static_cast<double>(k) * kStep_s <= end_s; ++k) {
    const double now_s = static_cast<double>(k) * kStep_s;
    for (; target_s - horizon_s <= now_s && target_s <= end_s; target_s += kEvery_s) {
      while (heard_next + 1 < track.size() &&
             std::abs(track.time_s[heard_next + 1] - target_s) <= std::abs(track.time_s[heard_next] - target_s))
        ++heard_next;
      if (std::abs(track.time_s[heard_next] - target_s) > 1) continue;
      std::vector<Particle> ahead = particles;
      const auto last = static_cast<std::int64_t>(target_s / kStep_s);
      CellPrediction prediction{target_s, 0, 0, track.x_mm[heard_next], track.y_mm[heard_next]};
      for (std::size_t i = 0; i < count; ++i) {
        for (std::int64_t q = k; q < last; ++q) robot.step(ahead[i], q, dice);
        prediction.x_mm += weights[i] * ahead[i].x_mm;
        prediction.y_mm += weights[i] * ahead[i].y_mm;
      }
      result.predictions.push_back(prediction);
    }
    for (Particle& p : particles) robot.step(p, k, dice);
    for (; next < track.size() && track.time_s[next] <= now_s + kStep_s; ++next) {
      double all = 0, squares = 0;
      for (std::size_t i = 0; i < count; ++i)
        all += weights[i] *= robot.chance_of(particles[i], track.x_mm[next], track.y_mm[next]);
      result.log_likelihood += kt_log(all);
      ++result.reports;
      if (all < 3 * kAstray) {
        // Nobody is where the robot was heard: begin again there.
        for (Particle& p : particles) p = robot.start(track.x_mm[next], track.y_mm[next], dice);
        std::fill(weights.begin(), weights.end(), 1 / static_cast<double>(count));
        continue;
      }
      for (double& w : weights) {
        w /= all;
        squares += w * w;
      }
      if (1 / squares < 0.5 * static_cast<double>(count)) resample(robot, particles, weights, dice);
    }
  }
  return result;
}

double cell_noise_mm(const Floor& floor, const FloorRadio& radio) {
  // Over distances from a cell's middle, each with the area that belongs to it.
  double squares = 0, all = 0;
  for (double d = 0.5; d < 3 * floor.cell_mm; ++d) {
    const double weight = d / (1 + std::exp((d - radio.range_mm) / radio.blur_mm));
    squares += weight * d * d;
    all += weight;
  }
  return std::sqrt(squares / all);
}

}  // namespace kilotwin::kilogrid
