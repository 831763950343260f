// Laws of the identification: exact arcs, recovered parameters, the right covariates, no effects in data without
// effects.
#include <gtest/gtest.h>

#include <cmath>

#include "clients/identify/fit/fitter.hpp"
#include "clients/identify/identify.hpp"
#include "clients/identify/model/effect_records.hpp"
#include "core/random/random.hpp"

namespace kilotwin::identify {
namespace {

struct World {
  double tracker_mm = 0.8, tracker_rad = 0.05, factor_s = 0.004;
  double slowing_s = 0;  ///< above 0: speeds fall as exp(-t / slowing_s)
  bool headings = true;
};

/// The same robots in all sets, far from each other, simulated with the model of docs/explanation/motion.md in
/// steps of 20 ms.
MeasuredSet played(const World& world, std::uint64_t seed, std::uint32_t robots, std::uint32_t runs,
                   double duration_s) {
  const Random random(seed), robots_own(7);
  const double dt = 0.02;
  MeasuredSet set;
  set.has_commands = true;
  set.has_headings = world.headings;
  for (std::uint32_t run = 0; run < runs; ++run) {
    Run& made = set.runs.emplace_back();
    made.name = "r" + std::to_string(run);
    for (std::uint32_t robot = 0; robot < robots; ++robot) {
      Track& track = made.tracks.emplace_back();
      track.robot = robot;
      const std::uint32_t entity = run * 1000 + robot;
      const double bias_left = 1.5 * robots_own.normal(Stream::kWheelBias, robot, Tick{0}, 0),
                   bias_right = 1.5 * robots_own.normal(Stream::kWheelBias, robot, Tick{0}, 1);
      double x = 3000.0 * robot, y = 0, heading = 1.0 * entity;
      track.commands.push_back({-1e300, Motion::kStop});
      double next_command_s = 0;
      const auto steps = static_cast<int>(duration_s / dt);
      for (int k = 0; k <= steps; ++k) {
        const double t = k * dt;
        if (k % 25 == 0) {
          const auto noise = [&](std::uint32_t draw) {
            return random.normal(Stream::kMeasurementNoise, entity, Tick{k}, draw);
          };
          track.samples.push_back(
              {t, x + 9.2 * std::cos(heading) + world.tracker_mm * noise(0),
               y + 9.2 * std::sin(heading) + world.tracker_mm * noise(1),
               world.headings ? wrapped_angle(heading + world.tracker_rad * noise(2)) : std::nan("")});
        }
        if (t >= next_command_s - 1e-9) {
          const bool straight = track.commands.back().motion != Motion::kStraight;
          const double draw = random.uniform(Stream::kLayout, entity, Tick{k}, 0);
          const Motion motion = straight ? Motion::kStraight : draw < 0.5 ? Motion::kLeft : Motion::kRight;
          track.commands.push_back({t, motion});
          next_command_s = t + (straight ? 4 + 8 * draw : 1 + 2 * draw);
        }
        const Eigen::Vector2d v = nominal_speeds(BaseParameters{}, track.commands.back().motion);
        const double slow = world.slowing_s > 0 ? std::exp(-t / world.slowing_s) : 1;
        const double sd = std::sqrt(world.factor_s / dt);
        Rates rates;
        rates.left_mm_s =
            slow * (v[0] + bias_left) * (1 + sd * random.normal(Stream::kWheelFactor, entity, Tick{k}, 0));
        rates.right_mm_s =
            slow * (v[1] + bias_right) * (1 + sd * random.normal(Stream::kWheelFactor, entity, Tick{k}, 1));
        const Arc arc = arc_of(rates, 25, heading, dt);
        x += arc.dx_mm;
        y += arc.dy_mm;
        heading += arc.dheading_rad;
      }
    }
  }
  return set;
}

TEST(Identify, ArcsAreExact) {
  Rates rates;
  rates.left_mm_s = 8;
  rates.right_mm_s = 13;
  const double turn = 5.0 / 25, radius = 10.5 / turn, h = 1.7;
  const Arc arc = arc_of(rates, 25, 0.3, h);
  EXPECT_NEAR(arc.dheading_rad, turn * h, 1e-12);
  EXPECT_NEAR(arc.dx_mm, radius * (std::sin(0.3 + turn * h) - std::sin(0.3)), 1e-9);
  EXPECT_NEAR(arc.dy_mm, -radius * (std::cos(0.3 + turn * h) - std::cos(0.3)), 1e-9);
}

TEST(Identify, CommandsCountTheMotorsTheyRun) {
  Track track;
  track.commands = {{-1e300, Motion::kStop}, {1, Motion::kStraight}, {3, Motion::kLeft}, {4, Motion::kStraight}};
  const CommandClock clock(track);
  const CommandState at = clock.at(6);
  EXPECT_EQ(at.command, Motion::kStraight);
  EXPECT_EQ(at.previous, Motion::kLeft);
  EXPECT_EQ(at.last_turn, Motion::kLeft);
  EXPECT_DOUBLE_EQ(at.since_s, 2);
  EXPECT_DOUBLE_EQ(at.motor_s[0], 4);  // the left wheel rests in a left turn
  EXPECT_DOUBLE_EQ(at.motor_s[1], 5);
  EXPECT_DOUBLE_EQ(at.driven_s, 5);
}

TEST(Identify, ParametersAreRecovered) {
  const World world;
  const MeasuredSet set = played(world, 7, 10, 2, 120);
  const Fitter fitter(set, 2);
  FitState state(set);
  MotionModel& model = state.model;
  fitter.fit(state, 4);
  EXPECT_NEAR(std::sqrt(model.noise.position_mm2), world.tracker_mm, 0.05);
  EXPECT_NEAR(std::sqrt(model.noise.heading_rad2), world.tracker_rad, 0.003);
  // Fitted biases absorb a part: 0.87 of the truth over eight seeds, standard deviation 0.09.
  EXPECT_NEAR(model.noise.factor_s / world.factor_s, 0.87, 0.27);
  EXPECT_NEAR(model.base.ahead_mm, 9.2, 0.2);
  // Headings determine ratios of speeds and wheel base. Their common scale is less certain.
  EXPECT_NEAR(model.base.turn_mm_s / model.base.wheel_base_mm, 0.8, 0.03);
  EXPECT_NEAR(model.base.straight_mm_s, 10, 1.2);
  // Straight speed of each robot, biases included.
  const Random random(7);
  for (const auto& [robot, bias] : model.robots) {
    const double left = 10 + 1.5 * random.normal(Stream::kWheelBias, robot, Tick{0}, 0);
    EXPECT_NEAR(model.base.straight_mm_s + bias.mean_mm_s[0], left, 0.5) << robot;
  }
}

TEST(Identify, NoEffectInDataWithoutEffects) {
  const MeasuredSet train = played({}, 11, 8, 2, 100), test = played({}, 12, 8, 1, 60);
  const Identified found = identify(train, &test, {});
  const identification::Result& result = found.found.result();
  EXPECT_TRUE(result.effects().empty()) << result.DebugString();
  EXPECT_EQ(found.predictions.size(), 8u * 11);
  EXPECT_NEAR(result.before().rmse_mm().number_value(), result.noise_floor_mm(), 0.35 * result.noise_floor_mm());
}

TEST(Identify, SlowingOverTimeIsAttributedToTime) {
  World world;
  world.slowing_s = 150;
  const MeasuredSet train = played(world, 21, 8, 2, 100), test = played(world, 22, 8, 1, 60);
  const Identified found = identify(train, &test, {});
  const identification::Result& result = found.found.result();
  ASSERT_EQ(result.effects_size(), 1) << result.DebugString();
  ASSERT_EQ(result.effects(0).covariates_size(), 1);
  EXPECT_EQ(result.effects(0).covariates(0), "time");
  EXPECT_LT(result.after().rmse_mm().number_value(), result.before().rmse_mm().number_value());
  bool written = false;
  for (const auto& effect : found.model.effect()) written = written || effect.name().starts_with("speed-by-time");
  EXPECT_TRUE(written);
}

TEST(Identify, WrittenEffectsEqualTerms) {
  Factor steps;
  steps.shape = Factor::Shape::kAtLeast;
  steps.axis.of = Covariate::kTime;
  steps.points = {10, 20};
  Term term{"bump", {{Target::kMeasuredX, Basis{{steps}}, kAlways}}, Eigen::Vector2d(3, -1), Eigen::Vector2d(1, 1)};
  const std::vector<proto::Effect> effects = effects_of_term(term);
  ASSERT_EQ(effects.size(), 1u);
  EXPECT_EQ(effects[0].acts_on(), proto::Effect::MEASURED_OFFSET);
  const proto::Steps& written = effects[0].function(0).steps();
  ASSERT_EQ(written.value_size(), 3);
  EXPECT_EQ(written.value(1), 3);
  EXPECT_EQ(written.value(2), 2);
}

}  // namespace
}  // namespace kilotwin::identify
