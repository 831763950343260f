/// One robot on the floor, in steps of half a second: its program, its drive and the model's effects, read from the model's
/// records so that any of them counts. Walls stop it; others are not there for it but as a number of neighbours.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "clients/identify/kilogrid/floor_model.hpp"
#include "core/effects/function.hpp"

namespace kilotwin::kilogrid {

/// What a robot is and remembers.
struct LoneState {
  std::uint32_t number;            ///< which one it is, where the model knows them apart
  double x_mm, y_mm, heading_rad;  ///< of the disc's centre, in the floor's frame
  double bias_left_mm_s, bias_right_mm_s;
  double since_command_s;
  Motion motion;
  FloorProgram program;
  std::vector<double> memory;  ///< of noise and episodes
};

class LoneRobot {
 public:
  static constexpr std::int64_t kStepTicks = 16;  ///< kilo_ticks
  static constexpr double kStep_s = kStepTicks * 0.032768;

  /// Both must live as long as this.
  LoneRobot(const Floor&, const FloorSettings&);

  /// A robot of the model, with biases and a program of its own.
  [[nodiscard]] LoneState start(std::uint32_t number, double x_mm, double y_mm, double heading_rad, Dice&) const;
  /// From step `k` to the next; `neighbours`: others within crowd_radius_mm().
  void step(LoneState&, std::int64_t k, Dice&, double neighbours = 0) const;
  /// What lasts for a robot drawn again, but for `keep` of it; not its number.
  void renew(LoneState&, double keep, Dice&) const;
  void keep_inside(LoneState&) const;
  /// Of effects of neighbours; 0 if there are none.
  [[nodiscard]] double crowd_radius_mm() const { return crowd_radius_mm_; }

 private:
  struct Factor {
    EffectFunction function;
    proto::Function::Covariate of, and_of;
    std::optional<std::size_t> slot;  ///< of what it remembers
    bool is_noise, is_episodes;
    double correlation_s, keep;  ///< keep: of noise, from step to step
    double apart_s, scale_s, tail, longest_s;
  };
  struct Term {
    proto::Effect::Target target;
    bool left, right;
    double along, across;
    std::uint8_t commands;
    std::vector<Factor> factors;
  };
  /// Parts of the step in which each wheel was driven straight or to turn.
  struct Driven {
    double straight = 0, left = 0, right = 0;
  };

  [[nodiscard]] Driven run_program(LoneState&, std::int64_t kilo_ticks, Dice&) const;
  [[nodiscard]] double covariate(proto::Function::Covariate, const LoneState&, double time_s,
                                 double neighbours) const;
  [[nodiscard]] double value_of(const Term&, const LoneState&, double time_s, double neighbours, Dice&) const;
  void remember(LoneState&, Dice&) const;

  const Floor& floor_;
  const FloorSettings& settings_;
  std::vector<Term> terms_;
  std::size_t slots_ = 0;
  double crowd_radius_mm_ = 0;
};

}  // namespace kilotwin::kilogrid
