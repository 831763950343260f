/// One robot on the floor in steps of half a second: its program, drive and effects. Effects come from the model
/// file's records, so any effect is supported. Walls stop it. Other robots enter as a number of neighbours only.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "clients/identify/kilogrid/floor_model.hpp"
#include "core/effects/function.hpp"
#include "core/effects/motion_change.hpp"

namespace kilotwin::kilogrid {

/// State of a robot.
struct RobotState {
  std::uint32_t number;            ///< identity, for effects per robot
  double x_mm, y_mm, heading_rad;  ///< disc centre, floor frame
  double bias_left_mm_s, bias_right_mm_s;
  double since_command_s;
  Motion motion;
  FloorProgram program;
  std::vector<double> memory;  ///< state of noise and episode functions
};

class SingleRobot {
 public:
  static constexpr std::int64_t kStepTicks = 16;  ///< kilo_ticks
  static constexpr double kStep_s = kStepTicks * 0.032768;

  /// Both must outlive it.
  SingleRobot(const Floor&, const FloorSettings&);

  /// A new robot with random biases and its own program.
  [[nodiscard]] RobotState start(std::uint32_t number, double x_mm, double y_mm, double heading_rad, Dice&) const;
  /// Advances from step `k` to the next. `neighbours`: number within neighbour_radius_mm().
  void step(RobotState&, std::int64_t k, Dice&, double neighbours = 0) const;
  /// Redraws persistent properties, except its number; `keep`: correlation with the present ones.
  void renew(RobotState&, double keep, Dice&) const;
  void keep_inside(RobotState&) const;
  /// Radius of neighbour effects, mm; 0 if there are none.
  [[nodiscard]] double neighbour_radius_mm() const { return neighbour_radius_mm_; }

 private:
  struct Factor {
    EffectFunction function;
    proto::Function::Covariate of, and_of;
    std::optional<std::size_t> slot;  ///< index into RobotState::memory
    bool is_noise, is_episodes;
    double correlation_s, keep;  ///< keep: correlation of noise from step to step
    EpisodesShape episodes;
  };
  struct Term {
    bool left_gain, right_gain;  ///< the wheels on whose gain it acts
    UnitOffsets unit;
    std::uint8_t commands;
    std::vector<Factor> factors;
  };
  /// Fractions of the step with both wheels, the left, or the right wheel driven.
  struct Driven {
    double straight = 0, left = 0, right = 0;
  };

  [[nodiscard]] Driven run_program(RobotState&, std::int64_t kilo_ticks, Dice&) const;
  [[nodiscard]] double covariate(proto::Function::Covariate, const RobotState&, double time_s,
                                 double neighbours) const;
  [[nodiscard]] double value_of(const Term&, const RobotState&, double time_s, double neighbours, Dice&) const;
  void remember(RobotState&, Dice&) const;

  const Floor& floor_;
  const FloorSettings& settings_;
  std::vector<Term> terms_;
  std::size_t slots_ = 0;
  double neighbour_radius_mm_ = 0;
};

}  // namespace kilotwin::kilogrid
