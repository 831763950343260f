/// Real robots and their tracker, played by the simulator's own drive model without contacts, for the monitor's tests and
/// measurements. The robots wander: they drive, turn and rest for random times, and turn away from walls.
#pragma once

#include <functional>
#include <random>
#include <string>
#include <vector>

#include "clients/monitor/monitor.hpp"
#include "core/plan/plan.hpp"
#include "services/physics/drive.hpp"

namespace kilotwin::monitor::testing {

struct ArenaOptions {
  std::uint32_t robots = 50;
  double side_mm = 3000;
  std::uint64_t seed = 1;
  std::string model;   ///< the monitor's and the robots': blocks of an experiment
  std::string faults;  ///< the robots' only: effects
  double position_sd_mm = 0.5, heading_sd_rad = 0.05;
  bool tells_headings = true;
  double drops = 0.02;  ///< fraction of frames without a robot
  bool rests = true;    ///< robots also rest
  std::string tracker;  ///< a block for the monitor's experiment
};

class VirtualArena {
 public:
  VirtualArena(const ArenaOptions& options, const MonitorSettings& settings);

  /// Advances robots, tracker and monitor by one tick. `knock` (x mm, y mm, turn rad) shifts what the tracker reports.
  void step(std::array<double, 3> knock = {});
  /// Moves a robot by hand.
  void carry(std::uint32_t robot, double dx_mm, double dy_mm);

  [[nodiscard]] Monitor& monitor() { return monitor_; }
  [[nodiscard]] Tick now() const { return swarm_.tick; }
  [[nodiscard]] double now_s() const { return plan_.tick_length.seconds_at(swarm_.tick); }
  [[nodiscard]] double x_mm(std::uint32_t robot) const { return x_mm_[robot]; }
  [[nodiscard]] double y_mm(std::uint32_t robot) const { return y_mm_[robot]; }
  [[nodiscard]] MotionCommand command(std::uint32_t robot) const { return command_[robot]; }
  /// CPU time within the monitor, ns.
  [[nodiscard]] double monitor_ns() const { return monitor_ns_; }
  [[nodiscard]] const physics::DriveModel& drive() const { return drive_; }

 private:
  void choose_commands();
  void move();
  void tell_monitor(std::uint32_t robot, MotionCommand command);
  [[nodiscard]] TrackerSample picture(std::array<double, 3> knock);

  const ArenaOptions options_;
  const RunPlan plan_, reality_;
  physics::DriveModel drive_;
  physics::Drives drives_;
  RobotParameters parameters_;
  Monitor monitor_;
  SwarmView swarm_;
  std::mt19937_64 random_;
  std::vector<double> x_mm_, y_mm_, heading_rad_, memory_;
  std::vector<std::uint32_t> ids_;
  std::vector<std::uint8_t> tracked_;
  std::vector<Duties> duties_;
  std::vector<MotionCommand> command_;
  const StationCommands
      station_commands_;             ///< not empty: the robots have no shadows, and the station commands them
  std::vector<std::int64_t> until_;  ///< tick at which a robot chooses again
  std::uint64_t frame_ = 0;
  double monitor_ns_ = 0;
};

}  // namespace kilotwin::monitor::testing
