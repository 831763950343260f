// Poses as a tracker measures them, against closed forms.
#include "core/effects/measurement.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/scenes.hpp"

namespace kilotwin {
namespace {

using testing::make_plan;
using testing::ScenePose;

const std::vector<ScenePose> kTwo = {{300, -400, 0.6}, {-100, 50, 3.1}};

/// Measured poses at a tick with these motors.
MeasuredPoses seen(const RunPlan& plan, const std::vector<ScenePose>& poses, Tick tick = Tick{0},
                   std::uint8_t left = 0) {
  Measurement measurement(plan);
  EXPECT_TRUE(measurement.any());
  BodyFrame bodies;
  for (std::uint32_t r = 0; r < poses.size(); ++r)
    bodies.add(r, poses[r].x_mm, poses[r].y_mm, poses[r].heading_rad);
  bodies.memory.assign(poses.size() * plan.memory.size(), 0);
  const std::vector<std::uint8_t> zeros(poses.size(), 0), lefts(poses.size(), left);
  const ActuationFrame actuation = testing::motors(tick, lefts, zeros);
  const BodyFrame* const frames[] = {&bodies};
  const ActuationFrame* const motors[] = {&actuation};
  MeasuredPoses measured;
  SwarmView swarm(plan.robots(), plan.movables(), plan.memory.size());
  swarm.gather(tick, frames);
  swarm.gather(motors);
  measurement.measure(swarm, measured);
  return measured;
}

TEST(Measurement, IsEmptyWithoutEffects) {
  EXPECT_FALSE(
      Measurement(make_plan("effect { name: 'a' acts_on: TURN_RATE function { constant: 1 } }", kTwo)).any());
}

TEST(Measurement, OffsetsScaleAndHeadingCompose) {
  const RunPlan plan = make_plan(
      "effect { name: 'a' acts_on: MEASURED_BODY_OFFSET direction_deg: 90 function { constant: 5 } } "
      "effect { name: 'b' acts_on: MEASURED_SCALE function { of: RADIUS linear { slope: 1e-4 } } } "
      "effect { name: 'c' acts_on: MEASURED_SCALE function { constant: -0.5 } } "
      "effect { name: 'd' acts_on: MEASURED_OFFSET direction_deg: 180 function { constant: 2 } } "
      "effect { name: 'e' acts_on: MEASURED_HEADING function { constant: 0.1 } }",
      kTwo);
  const MeasuredPoses measured = seen(plan, kTwo);
  for (std::size_t r = 0; r < 2; ++r) {
    const ScenePose& p = kTwo[r];
    const double scale = (1 + 1e-4 * std::hypot(p.x_mm, p.y_mm)) * 0.5;
    EXPECT_NEAR(measured.x_mm[r], (p.x_mm - 5 * std::sin(p.heading_rad)) * scale - 2, 1e-10);
    EXPECT_NEAR(measured.y_mm[r], (p.y_mm + 5 * std::cos(p.heading_rad)) * scale, 1e-10);
    EXPECT_NEAR(std::remainder(measured.heading_rad[r] - p.heading_rad - 0.1, 2 * kPi), 0, 1e-13);
    EXPECT_LT(measured.heading_rad[r], kPi);
  }
}

TEST(Measurement, NoiseIsIndependentPerPosition) {
  const auto crowd = testing::grid_crowd(5000, 50, testing::Facing::kRight);
  const std::string text =
      "effect { name: 'x' acts_on: MEASURED_OFFSET function { noise { sd: 0.7 } } } "
      "effect { name: 'y' acts_on: MEASURED_OFFSET direction_deg: 90 function { noise { sd: 0.2 } } }";
  for (const std::uint32_t cycles : {1u << 16, 1u << 19}) {
    const RunPlan plan = make_plan(
        "tick_cycles: " + std::to_string(cycles) + " arena { width_mm: 9000 height_mm: 9000 } " + text, crowd);
    const MeasuredPoses a = seen(plan, crowd, Tick{3}), b = seen(plan, crowd, Tick{4});
    double x = 0, y = 0, both = 0, next = 0;
    for (std::size_t r = 0; r < crowd.size(); ++r) {
      const double dx = (a.x_mm[r] - crowd[r].x_mm) / 0.7, dy = (a.y_mm[r] - crowd[r].y_mm) / 0.2;
      x += dx * dx;
      y += dy * dy;
      both += dx * dy;
      next += dx * (b.x_mm[r] - crowd[r].x_mm) / 0.7;
    }
    const double n = 5000, bound = 4.4 * std::sqrt(2 / n);
    EXPECT_NEAR(x / n, 1, bound);
    EXPECT_NEAR(y / n, 1, bound);
    EXPECT_NEAR(both / n, 0, bound);
    EXPECT_NEAR(next / n, 0, bound);
  }
}

TEST(Measurement, DependsOnCommandsAndExcludesRealRobots) {
  const RunPlan plan = make_plan(
      "robots { count: 1 } robots { count: 1 body: TRACKED } "
      "effect { name: 'a' acts_on: MEASURED_OFFSET during: LEFT function { constant: 3 } }",
      kTwo);
  EXPECT_EQ(seen(plan, kTwo).x_mm[0], 300);
  EXPECT_EQ(seen(plan, kTwo, Tick{0}, 70).x_mm[0], 303);
  EXPECT_EQ(seen(plan, kTwo, Tick{0}, 70).x_mm[1], -100);
}

}  // namespace
}  // namespace kilotwin
