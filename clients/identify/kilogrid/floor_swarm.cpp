#include "clients/identify/kilogrid/floor_swarm.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/pose.hpp"
#include "core/base/spin_up.hpp"
#include "core/math/elementary.h"
#include "idl/manifest.pb.h"
#include "services/physics/engine.hpp"

namespace kilotwin::kilogrid {
namespace {

/// Kilo_ticks per engine tick: the longest tick allowed.
constexpr std::int64_t kKiloTicks = 4;
constexpr std::uint32_t kTickCycles = kKiloTicks << 18;
constexpr std::uint8_t kDuty = 70;
constexpr double kRadius_mm = kRobotRadius_mm;

RunPlan plan_of(const FloorScene& scene, const Floor& floor, const proto::Model& model, std::uint64_t seed,
                Dice& dice) {
  proto::Manifest manifest;
  manifest.set_run(1);
  proto::Experiment& e = *manifest.mutable_experiment();
  e.set_seed(seed);
  e.set_duration_s(scene.duration_s);
  e.set_tick_cycles(kTickCycles);
  e.mutable_arena()->set_width_mm(floor.width_mm);
  e.mutable_arena()->set_height_mm(floor.height_mm);
  *e.mutable_motion() = model.motion();
  *e.mutable_robot_model() = model.robot();
  *e.mutable_effect() = model.effect();
  *e.mutable_field() = model.field();
  e.add_robots()->set_count(static_cast<std::uint32_t>(scene.x_mm.size()));
  manifest.add_program()->set_path("floor");
  manifest.add_group_program(0);
  for (std::size_t i = 0; i < scene.x_mm.size(); ++i) {
    manifest.add_x_mm(scene.x_mm[i] - floor.width_mm / 2);
    manifest.add_y_mm(scene.y_mm[i] - floor.height_mm / 2);
    manifest.add_heading_rad((2 * dice.uniform() - 1) * kPi);
  }
  return RunPlan(std::move(manifest));
}

}  // namespace

std::size_t boundary_section(const Floor& floor, double x_mm, double y_mm) {
  const double w = floor.width_mm, h = floor.height_mm;
  const double distance[] = {y_mm, w - x_mm, h - y_mm, x_mm};
  const double along[] = {x_mm, w + y_mm, w + h + (w - x_mm), 2 * w + h + (h - y_mm)};
  const auto side =
      static_cast<std::size_t>(std::min_element(std::begin(distance), std::end(distance)) - std::begin(distance));
  const double part = std::max(along[side], 0.0) / (2 * (w + h)) * static_cast<double>(kBoundarySections);
  return std::min(static_cast<std::size_t>(part), kBoundarySections - 1);
}

double boundary_cell_distance_mm(const Floor& floor, double x_mm, double y_mm) {
  const double half = floor.cell_mm / 2, w = floor.width_mm, h = floor.height_mm;
  const auto middle = [&](double v, double end) {
    return (std::floor(std::clamp(v, half, end - half) / floor.cell_mm) + 0.5) * floor.cell_mm;
  };
  const double x = middle(x_mm, w), y = middle(y_mm, h);
  double nearest = std::numeric_limits<double>::infinity();
  const double cells[][2] = {{x, half}, {x, h - half}, {half, y}, {w - half, y}};
  for (const auto& [cell_x, cell_y] : cells)
    nearest = std::min(nearest, (x_mm - cell_x) * (x_mm - cell_x) + (y_mm - cell_y) * (y_mm - cell_y));
  return std::sqrt(nearest);
}

FloorScene scene_of(const FloorRun& run, const Floor& floor, std::uint64_t seed) {
  Dice dice(seed);
  FloorScene scene{run.name, run.duration_s, {}, {}};
  const auto within = [](double v, double end) { return std::clamp(v, kRadius_mm, end - kRadius_mm); };
  for (const FloorTrack& track : run.tracks) {
    double x_mm = 0, y_mm = 0;
    // Searches for a free position at growing distances from the cell.
    for (int attempt = 0; attempt < 10000; ++attempt) {
      const double spread_mm = floor.cell_mm * (1 + 0.02 * attempt);
      x_mm = within(track.x_mm.front() + spread_mm * (dice.uniform() - 0.5), floor.width_mm);
      y_mm = within(track.y_mm.front() + spread_mm * (dice.uniform() - 0.5), floor.height_mm);
      bool free = true;
      for (std::size_t j = 0; j < scene.x_mm.size() && free; ++j)
        free = std::hypot(scene.x_mm[j] - x_mm, scene.y_mm[j] - y_mm) >= 2 * kRadius_mm + 0.5;
      if (free) break;
    }
    scene.x_mm.push_back(x_mm);
    scene.y_mm.push_back(y_mm);
  }
  return scene;
}

FloorRun simulate(const FloorScene& scene, const Floor& floor, const proto::Model& model, const WalkTimes& times,
                  const FloorRadio& radio, std::uint64_t seed) {
  Dice dice(seed * 2 + 1);
  const RunPlan plan = plan_of(scene, floor, model, seed, dice);
  const std::unique_ptr<physics::Engine> engine = physics::make_engine(plan, PartitionId{0});
  const std::uint32_t robots = plan.robots();
  std::vector<FloorProgram> programs;
  for (std::uint32_t robot = 0; robot < robots; ++robot) programs.emplace_back(times, dice.bits());
  FloorReporter reporter(floor, radio, robots, dice.bits());

  ActuationFrame actuation;
  actuation.motor_left.assign(robots, 0);
  actuation.motor_right.assign(robots, 0);
  actuation.spin_up.assign(robots, 0);
  std::vector<Motion> motion(robots, Motion::kStop);
  BodyFrame bodies;
  const double tick_s = plan.tick_length.seconds();
  for (Tick now{0}; now < plan.last_tick; ++now) {
    bodies.clear();
    engine->emit_bodies(bodies);
    const std::int64_t kilo_ticks = now.count() * kKiloTicks;
    for (std::size_t i = 0; i < bodies.robot.size(); ++i) {
      const std::uint32_t robot = bodies.robot[i];
      const double x_mm = bodies.x_mm[i] + floor.width_mm / 2, y_mm = bodies.y_mm[i] + floor.height_mm / 2;
      if (dice.uniform() < radio.wall_heard * tick_s) {
        const double boundary_mm = boundary_cell_distance_mm(floor, x_mm, y_mm);
        const bool may_be_heard = boundary_mm < radio.wall_range_mm + 4 * radio.wall_noise;
        const double reading_mm = may_be_heard ? boundary_mm + radio.wall_noise * dice.normal() : boundary_mm;
        // The program compares readings only, so the offset is arbitrary.
        constexpr double kStrongest = 1000;
        if (reading_mm < radio.wall_range_mm) programs[robot].hear_wall(kilo_ticks, kStrongest - reading_mm);
      }
      const Motion next = programs[robot].loop(kilo_ticks);
      actuation.spin_up[robot] = next != motion[robot] ? kOneSpinUp : std::uint8_t{0};
      motion[robot] = next;
      actuation.motor_left[robot] = next == Motion::kStraight || next == Motion::kLeft ? kDuty : 0;
      actuation.motor_right[robot] = next == Motion::kStraight || next == Motion::kRight ? kDuty : 0;
      reporter.see(robot, static_cast<double>(now.count()) * tick_s, x_mm, y_mm);
    }
    actuation.tick = now;
    const ActuationFrame* const frames[] = {&actuation};
    engine->step(now, {{}, frames, {}});
  }
  return reporter.take(scene.name, scene.duration_s);
}

}  // namespace kilotwin::kilogrid
