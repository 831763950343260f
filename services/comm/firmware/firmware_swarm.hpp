/// All robots of a run that run firmware, on several threads.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "core/base/motor_share.hpp"
#include "core/logs/robot_logs.hpp"
#include "core/plan/plan.hpp"
#include "services/comm/firmware/mcu.hpp"
#include "services/comm/firmware_robots.hpp"

namespace kilotwin::os {
class WorkerPool;
}

namespace kilotwin::firmware {

/// Each robot is switched on less than one tick of its own clock before the run begins. Its first timer interrupt then comes
/// at the same time as for a robot with a native program. Rate and phase of the clocks are those of comm::TickTimers.
class FirmwareSwarm final : public comm::FirmwareRobots {
 public:
  /// Reads the programs in programs/ of the run directory. `threads`: number of threads; results do not depend on it.
  /// With `keeps_logs`, the robots' printed text goes to their logs in that directory (core/logs/robot_logs.hpp). `first`: the
  /// first tick of the run; if it is not 0, the caller must call load(). Throws UserError if a program is missing or damaged.
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
  [[nodiscard]] bool read(std::uint32_t i, std::uint16_t address, std::span<std::uint8_t> to) const override;
  [[nodiscard]] double battery_V(std::uint32_t i) const override { return senses_.battery_V(ids_[i]); }
  void flush_logs() const override;
  [[nodiscard]] std::uint64_t word(std::uint32_t i) const override;
  [[nodiscard]] std::string save(std::uint32_t i) const override;
  void load(std::uint32_t i, const std::string& octets) override;

  /// The processor of robot i, for tests.
  [[nodiscard]] const Mcu& mcu(std::uint32_t i) const { return *robots_[i].mcu; }

 private:
  struct Robot {
    std::unique_ptr<Mcu> mcu;
    comm::Cycles switched_on;  ///< at most 0
    comm::Cycles period;       ///< nominal cycles in which its own clock counts 2^18 cycles
    bool has_run = false;      ///< since the last commit
    std::uint8_t shown_left = 0, shown_right = 0;
    std::uint8_t spin_up = 0;  ///< core/base/spin_up.hpp
    MotorShare motor_share;
    bool has_sent = false;  ///< in this tick
    bool flat = false;
    std::vector<Light> light;
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
