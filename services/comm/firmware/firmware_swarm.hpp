/// All robots of a run that run firmware, on several threads.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "core/logs/robot_logs.hpp"
#include "core/plan/plan.hpp"
#include "services/comm/firmware/mcu.hpp"
#include "services/comm/firmware_robots.hpp"

namespace kilotwin::os {
class WorkerPool;
}

namespace kilotwin::firmware {

/// Each robot was switched on within the last tick of its own clock before the run began, such that its first timer interrupt
/// comes when that of a robot with a native program would: rate and phase of clocks are those of comm::TickTimers.
class FirmwareSwarm final : public comm::FirmwareRobots {
 public:
  /// Reads programs/ of the run directory. `threads`: how many run robots at a time; results do not depend on it.
  /// With `keeps_logs`, what robots print goes to their logs there (core/logs/robot_logs.hpp). `first`: the tick at which the run
  /// starts; load() follows where that is not 0. Throws UserError where a program is missing or damaged.
  FirmwareSwarm(const RunPlan&, const std::filesystem::path& run_directory, std::uint32_t threads, Tick first,
                bool keeps_logs);
  ~FirmwareSwarm() override;

  [[nodiscard]] std::span<const std::uint32_t> ids() const override { return ids_; }
  void run(comm::Cycles until, std::span<const std::uint32_t> robots,
           const std::vector<std::vector<comm::Pulse>>& light,
           std::vector<std::vector<comm::Cycles>>& flashes) override;
  void commit() override;
  void note_sent(std::uint32_t i) override { robots_[i].has_sent = true; }
  void begin_tick(const SwarmView&) override;
  void end_tick() override;
  [[nodiscard]] Outputs outputs(std::uint32_t i) const override;
  [[nodiscard]] std::uint64_t word(std::uint32_t i) const override;
  [[nodiscard]] std::string save(std::uint32_t i) const override;
  void load(std::uint32_t i, const std::string& octets) override;

  /// The processor of robot i, for tests.
  [[nodiscard]] const Mcu& mcu(std::uint32_t i) const { return *robots_[i].mcu; }

 private:
  struct Robot {
    std::unique_ptr<Mcu> mcu;
    comm::Cycles switched_on;  ///< at most 0
    comm::Cycles period;       ///< nominal cycles of 2^18 own ones
    bool has_run = false;      ///< since the last commit
    // Full duty of both motors: now, during all of this tick, at some time in it or in a kick that it continues.
    bool full = false, full_throughout = false, kicked = false;
    bool kick_goes_on = false;  ///< at the end of the last tick
    std::uint8_t shown_left = 0, shown_right = 0;
    bool spun_up = false;
    bool has_sent = false;  ///< in this tick
    bool flat = false;
    std::vector<Light> light;
    std::vector<std::uint8_t> fulls;  ///< of this run: full duty at the end of each span
  };

  [[nodiscard]] OwnCycles own(const Robot&, comm::Cycles) const;
  [[nodiscard]] comm::Cycles nominal(const Robot&, OwnCycles) const;
  void run_robot(Robot&, comm::Cycles until, const std::vector<comm::Pulse>& light,
                 std::vector<comm::Cycles>& flashes);
  void write_log(std::uint32_t i);
  void use_battery(std::uint32_t i);

  mutable std::optional<RobotLogs> logs_;  ///< nothing: none are kept
  std::vector<std::uint32_t> ids_;
  std::vector<Robot> robots_;
  const comm::Cycles cycles_per_tick_;
  comm::Cycles begin_ = 0, until_ = 0;  ///< of the run at hand
  senses::RobotSenses senses_;          ///< of all robots of the run
  std::unique_ptr<os::WorkerPool> workers_;
};

/// The plan's firmware robots; null where there are none.
[[nodiscard]] std::unique_ptr<comm::FirmwareRobots> make_firmware_robots(const RunPlan&,
                                                                         const std::filesystem::path& run_directory,
                                                                         std::uint32_t threads, Tick first,
                                                                         bool keeps_logs);

}  // namespace kilotwin::firmware
