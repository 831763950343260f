/// A planned recording: where robots start, and what they are commanded to do. All instants are ticks of a run.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "clients/identify/data/measured_set.hpp"

namespace kilotwin::identify {

/// Length of a tick, s: 2^18 cycles of the robots' clocks of 8 MHz.
inline constexpr double kPlanTick_s = 0.032768;
/// Commands change at multiples of this, in ticks: about one second. A shorter command shows little beside the tracker's noise.
inline constexpr std::int64_t kPlanStep = 32;

struct PlannedCommand {
  std::int64_t tick;  ///< from when it holds; a multiple of kPlanStep
  Motion motion;
};

struct PlannedRobot {
  std::uint32_t robot = 0;                     ///< its number
  double x_mm = 0, y_mm = 0, heading_rad = 0;  ///< centre of the disc at the start
  /// Ascending ticks, from kPlanStep; each motion differs from the one before. Robots rest before the first.
  std::vector<PlannedCommand> commands;
};

/// Origin at the centre.
struct PlanArena {
  double width_mm = 1000, height_mm = 1000;
};

struct RecordingPlan {
  PlanArena arena;
  std::int64_t ticks = 0;  ///< duration, a multiple of kPlanStep
  std::vector<PlannedRobot> robots;

  [[nodiscard]] double duration_s() const { return static_cast<double>(ticks) * kPlanTick_s; }
};

/// Sets the motion from tick `from` to `to`; what was commanded afterwards continues at `to`. Both are multiples of kPlanStep, and
/// `end` is the end of the plan.
void overwrite(std::vector<PlannedCommand>& commands, std::int64_t from, std::int64_t to, std::int64_t end,
               Motion motion);

/// commands.csv of `kilotwin identify`.
[[nodiscard]] std::string commands_csv(const RecordingPlan&, const std::string& run);
/// Poses of an experiment's layout. Robots have the row's number.
[[nodiscard]] std::string poses_csv(const RecordingPlan&);
/// A C program for simulated and real robots: robot N follows the commands of the N-th planned robot.
[[nodiscard]] std::string program_c(const RecordingPlan&);
/// Whether that program fits a robot: a command takes 3 octets of the flash, which has 28 KiB below the boot loader.
[[nodiscard]] bool fits_robots(const RecordingPlan&);
/// The experiment that plays the plan; `program` and `poses` are files beside it.
[[nodiscard]] std::string experiment_text(const RecordingPlan&, const std::string& name, const std::string& program,
                                          const std::string& poses, double every_s);

}  // namespace kilotwin::identify
