// The fitted model moves robots as the simulator does with the model's file: random models and commands, also beyond the limit of
// effects.
#include <gtest/gtest.h>

#include <cmath>

#include "clients/identify/model/model_file.hpp"
#include "core/base/pose.hpp"
#include "core/random/random.hpp"
#include "idl/manifest.pb.h"
#include "services/physics/drive.hpp"

namespace kilotwin::identify {
namespace {

/// Draws of one case, in order.
class Draws {
 public:
  explicit Draws(std::uint32_t number) : number_(number) {}
  double normal() { return random_.normal(Stream::kLayout, number_, Tick{0}, next_++); }
  std::uint32_t below(std::uint32_t n) {
    return static_cast<std::uint32_t>(random_.uniform(Stream::kLayout, number_, Tick{0}, next_++) * n);
  }

 private:
  Random random_{12};
  std::uint32_t number_, next_ = 0;
};

/// Constant terms on targets of motion. Their sums exceed the limit in some cases.
MotionModel random_model(Draws& draws) {
  MotionModel model;
  model.noise = {0, 0, 0, 0, 0, 0};
  model.base.centre_mm = 9 + draws.normal();
  model.base.wheel_base_mm = 25 + draws.normal();
  model.base.straight_mm_s = 10 + draws.normal();
  model.base.turn_mm_s = 18 + draws.normal();
  model.robots[0].mean_mm_s = {draws.normal(), draws.normal()};
  const std::uint32_t terms = 1 + draws.below(5);
  for (std::uint32_t t = 0; t < terms; ++t) {
    const auto target = static_cast<Target>(draws.below(static_cast<std::uint32_t>(Target::kMeasuredX)));
    const double size = target <= Target::kGainRight ? 0.5 : target == Target::kTurn ? 2 : 25;
    Term term{"term" + std::to_string(t), {{target, {}, draws.below(2) == 0 ? kDriven : kAlways}}, {}, {}};
    term.coefficients = Eigen::VectorXd::Constant(1, size * draws.normal());
    term.precision = Eigen::VectorXd::Ones(1);
    model.terms.push_back(term);
  }
  return model;
}

RunPlan plan_of(const proto::Model& model) {
  proto::Manifest manifest;
  proto::Experiment& experiment = *manifest.mutable_experiment();
  experiment.set_duration_s(1);
  experiment.set_tick_cycles(1 << 18);
  *experiment.mutable_motion() = model.motion();
  *experiment.mutable_robot_model() = model.robot();
  *experiment.mutable_effect() = model.effect();
  experiment.add_robots()->set_count(1);
  manifest.add_program()->set_path("none");
  manifest.add_group_program(0);
  manifest.add_x_mm(0);
  manifest.add_y_mm(0);
  manifest.add_heading_rad(0);
  return RunPlan(std::move(manifest));
}

struct Motion3 {
  double x_mm, y_mm, turn_rad;  ///< of the disc's centre in one tick
};

Motion3 by_simulator(const RunPlan& plan, Motion command, double heading_rad) {
  constexpr std::uint8_t kDuty = 70;
  const auto on = [&](Motion one) {
    return command == Motion::kStraight || command == one ? kDuty : std::uint8_t{0};
  };
  // The left motor drives the right-hand wheel.
  const Duties duties[] = {{on(Motion::kLeft), on(Motion::kRight), 0}};
  const std::uint32_t robot[] = {0};
  const std::uint8_t tracked[] = {0};
  const double x[] = {0}, y[] = {0}, heading[] = {heading_rad};
  physics::DriveModel drive(plan);
  physics::Drives drives;
  drives.reserve(1);
  drive.add(drives, 0, 0, Tick{0}, duties[0], heading_rad, 1);
  if (!drive.effects().empty()) drive.change(drives, Tick{0}, {robot, x, y, heading, {}, duties, tracked}, nullptr);
  drive.integrate(drives);
  return {drives.x_mm[0], drives.y_mm[0], drives.turn_rad[0]};
}

Motion3 by_model(const MotionModel& model, Motion command, double heading_rad) {
  Situation situation;
  situation.heading_rad = heading_rad;
  situation.commands.command = command;
  const Rates rates = model.rates(situation, model.bias_of(0).mean_mm_s);
  const Arc arc = arc_of(rates, model.base.wheel_base_mm, heading_rad, (1 << 18) / 8e6);
  const double after = heading_rad + arc.dheading_rad, centre = model.base.centre_mm;
  return {arc.dx_mm + centre * (std::cos(after) - std::cos(heading_rad)),
          arc.dy_mm + centre * (std::sin(after) - std::sin(heading_rad)), arc.dheading_rad};
}

TEST(MotionModel, MovesAsTheSimulatorDoes) {
  int limited = 0;
  for (std::uint32_t number = 0; number < 400; ++number) {
    Draws draws(number);
    const MotionModel model = random_model(draws);
    const RunPlan plan = plan_of(proto_of(model));
    const auto command = static_cast<Motion>(draws.below(4));
    const double heading_rad = kPi * std::tanh(draws.normal());
    const Motion3 simulated = by_simulator(plan, command, heading_rad);
    const Motion3 modelled = by_model(model, command, heading_rad);
    // Model files have numbers of six digits.
    EXPECT_NEAR(modelled.x_mm, simulated.x_mm, 1e-5) << number;
    EXPECT_NEAR(modelled.y_mm, simulated.y_mm, 1e-5) << number;
    EXPECT_NEAR(modelled.turn_rad, simulated.turn_rad, 1e-6) << number;
    proto::Model unlimited = proto_of(model);
    unlimited.mutable_motion()->set_effects_limit_mm_s(1e6);
    limited +=
        std::abs(by_simulator(plan_of(unlimited), command, heading_rad).x_mm - simulated.x_mm) > 1e-3 ? 1 : 0;
  }
  EXPECT_GT(limited, 20);
}

}  // namespace
}  // namespace kilotwin::identify
