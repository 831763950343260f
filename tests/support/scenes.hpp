/// Scenes for tests and benchmarks: a RunPlan from an experiment's text and a list of poses, and the poses of some common
/// crowds.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/frames/frames.hpp"
#include "core/plan/plan.hpp"

namespace kilotwin::testing {

struct ScenePose {
  double x_mm, y_mm, heading_rad;
};

/// The plan of an experiment in protobuf text format, with robots at `poses`. If the text has no group, one group of simulated
/// robots is added; otherwise the groups' counts must add up to the number of poses. Throws std::runtime_error if the
/// text does not parse.
[[nodiscard]] RunPlan make_plan(const std::string& experiment, const std::vector<ScenePose>& poses);

/// The same with another partition grid and number of hosts.
[[nodiscard]] RunPlan make_plan(const std::string& experiment, const std::vector<ScenePose>& poses,
                                std::uint32_t columns, std::uint32_t rows, std::uint32_t hosts = 1);

enum class Facing { kRight, kRandom, kInwards };

/// A square grid around the origin, row by row from the bottom left, as square as possible. Headings are a pure function
/// of `seed` and the robot.
[[nodiscard]] std::vector<ScenePose> grid_crowd(std::uint32_t robots, double pitch_mm, Facing,
                                                std::uint64_t seed = 1);

/// Uniform in a rectangle around the origin, centres at least `spacing_mm` apart.
[[nodiscard]] std::vector<ScenePose> random_crowd(std::uint32_t robots, double width_mm, double height_mm,
                                                  double spacing_mm, std::uint64_t seed);

/// A frame at `tick` in which the robots first_robot.. have these motors.
[[nodiscard]] ActuationFrame motors(Tick tick, const std::vector<std::uint8_t>& left,
                                    const std::vector<std::uint8_t>& right, std::uint32_t first_robot = 0);

}  // namespace kilotwin::testing
