#include "tests/support/scenes.hpp"

#include <google/protobuf/text_format.h>

#include <cmath>
#include <stdexcept>
#include <utility>

#include "idl/manifest.pb.h"

namespace kilotwin::testing {
namespace {

/// A generator of its own (splitmix64), so that scenes do not depend on the tested code.
class Scatter {
 public:
  explicit Scatter(std::uint64_t seed) : state_(seed) {}
  double uniform() {
    state_ += 0x9e3779b97f4a7c15u;
    std::uint64_t z = state_;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return static_cast<double>((z ^ z >> 31) >> 11) * 0x1.0p-53;
  }
  double heading() { return (2 * uniform() - 1) * kPi; }

 private:
  std::uint64_t state_;
};

}  // namespace

RunPlan make_plan(const std::string& experiment, const std::vector<ScenePose>& poses) {
  proto::Manifest manifest;
  manifest.set_run(1);
  proto::Experiment& e = *manifest.mutable_experiment();
  if (!google::protobuf::TextFormat::ParseFromString(experiment, &e))
    throw std::runtime_error("scene does not parse: " + experiment);
  if (e.robots_size() == 0) e.add_robots()->set_count(static_cast<std::uint32_t>(poses.size()));
  manifest.add_program()->set_path("scene.c");
  std::size_t robots = 0;
  for (const proto::RobotGroup& group : e.robots()) {
    const bool has_program = group.body() != proto::RobotGroup::TRACKED || group.says().shadow();
    manifest.add_group_program(has_program ? 0 : kNoProgram);
    robots += group.count();
  }
  if (robots != poses.size()) throw std::runtime_error("scene: groups and poses differ in number");
  for (const ScenePose& pose : poses) {
    manifest.add_x_mm(pose.x_mm);
    manifest.add_y_mm(pose.y_mm);
    manifest.add_heading_rad(pose.heading_rad);
  }
  return RunPlan(std::move(manifest));
}

RunPlan make_plan(const std::string& experiment, const std::vector<ScenePose>& poses, std::uint32_t columns,
                  std::uint32_t rows, std::uint32_t hosts) {
  return make_plan(experiment + " deployment { partition_columns: " + std::to_string(columns) +
                       " partition_rows: " + std::to_string(rows) + " hosts: " + std::to_string(hosts) + " }",
                   poses);
}

std::vector<ScenePose> grid_crowd(std::uint32_t robots, double pitch_mm, Facing facing, std::uint64_t seed) {
  std::uint32_t columns = 1;
  while (columns * columns < robots) ++columns;
  const std::uint32_t rows = (robots + columns - 1) / columns;
  Scatter scatter(seed);
  std::vector<ScenePose> poses;
  for (std::uint32_t i = 0; i < robots; ++i) {
    const double x = (i % columns - (columns - 1) / 2.0) * pitch_mm,
                 y = (i / columns - (rows - 1) / 2.0) * pitch_mm;
    const double random = scatter.heading();
    const double heading = facing == Facing::kRight ? 0 : facing == Facing::kRandom ? random : std::atan2(-y, -x);
    poses.push_back({x, y, heading});
  }
  return poses;
}

std::vector<ScenePose> random_crowd(std::uint32_t robots, double width_mm, double height_mm, double spacing_mm,
                                    std::uint64_t seed) {
  Scatter scatter(seed);
  std::vector<ScenePose> poses;
  for (std::uint32_t attempts = 0; poses.size() < robots; ++attempts) {
    if (attempts > 10000 * robots) throw std::runtime_error("scene: no room for so many robots");
    const double x = (scatter.uniform() - 0.5) * width_mm, y = (scatter.uniform() - 0.5) * height_mm;
    bool free = true;
    for (const ScenePose& other : poses) {
      free = free &&
             (other.x_mm - x) * (other.x_mm - x) + (other.y_mm - y) * (other.y_mm - y) >= spacing_mm * spacing_mm;
    }
    if (free) poses.push_back({x, y, scatter.heading()});
  }
  return poses;
}

ActuationFrame motors(Tick tick, const std::vector<std::uint8_t>& left, const std::vector<std::uint8_t>& right,
                      std::uint32_t first_robot) {
  ActuationFrame frame;
  frame.tick = tick;
  frame.first_robot = first_robot;
  frame.motor_left = left;
  frame.motor_right = right;
  frame.led.assign(left.size(), 0);
  frame.life_cycle.assign(left.size(), static_cast<std::uint8_t>(LifeCycle::kRunning));
  frame.tx_period.assign(left.size(), 0);
  frame.spin_up.assign(left.size(), 0);
  return frame;
}

}  // namespace kilotwin::testing
