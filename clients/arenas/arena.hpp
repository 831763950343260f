/// An experiment whose caller decides when it steps: for optimisers, learning, and whatever else is a loop around a swarm.
///
/// It has the results of a local run: after the same number of ticks, the same state hash. Messages to robots, placements and
/// changes of variables are inputs beside the experiment; a run that a recording describes has no such changes of variables.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "clients/local/engines.hpp"
#include "core/federation/schedule.hpp"
#include "core/frames/overhead_packet.hpp"
#include "core/observations/variable_place.hpp"
#include "core/os/worker_pool.hpp"
#include "core/plan/plan.hpp"
#include "services/ark/station_outputs.hpp"

namespace kilotwin::arenas {

class Arena {
 public:
  /// At tick 0. `run_directory` holds programs and plugins. The variables are those of the plan's manifest.
  Arena(std::shared_ptr<const RunPlan> plan, const std::shared_ptr<behaviours::ProgramSet>& programs,
        const std::filesystem::path& run_directory);

  /// Steps `ticks` times, and no further than the experiment's end. Throws RunError where a plugin's failure ends the run.
  void step(std::int64_t ticks);
  [[nodiscard]] Tick now() const { return engines_.swarm().tick; }
  [[nodiscard]] bool ended() const { return now() >= plan_->last_tick; }
  [[nodiscard]] const RunPlan& plan() const { return *plan_; }
  [[nodiscard]] const SwarmView& swarm() const { return engines_.swarm(); }
  /// As in summary.json of a run that ended here.
  [[nodiscard]] std::uint64_t state_hash() const { return chain_; }
  [[nodiscard]] const comm::RadioEngine& radio() const { return engines_.radio(); }
  [[nodiscard]] std::uint32_t robots_failed() const { return engines_.robots_failed(); }
  /// Why robots failed, in order of time.
  [[nodiscard]] std::vector<behaviours::BehavioursEngine::Failure> failures() const;

  /// The packet reaches the overhead controller in the next step.
  void send(const OverheadPacket& packet);

  /// The robot or movable body stands there after the next step, as in a run with this request. Throws UserError where it
  /// cannot: no such body, a real robot, outside the arena, in an obstacle. `where.pose.heading_rad`: any angle.
  void place(const Relocation& where);

  [[nodiscard]] std::size_t variables() const { return places_.size(); }
  /// NaN where the robot's program has no such variable, or it runs as firmware. Batteries, those of firmware robots included:
  /// core/observations/variable_sampler.hpp.
  [[nodiscard]] double variable(std::size_t index, std::uint32_t robot) const;
  /// A new value for a variable of a robot's program.
  struct Write {
    std::uint32_t robot = 0;
    std::uint64_t address = 0;
    std::size_t octets = 0;
    std::array<std::uint8_t, 8> content{};  ///< the first `octets` of them
  };
  /// Changes nothing yet. Throws UserError where variable() would be NaN, or the variable cannot hold the value.
  [[nodiscard]] Write writing(std::size_t index, std::uint32_t robot, double value) const;
  void write(const Write& write);
  /// For a watchdog.
  [[nodiscard]] const std::vector<std::unique_ptr<behaviours::BehavioursEngine>>& hosts() const {
    return engines_.hosts();
  }

 private:
  void add(Directive directive);
  [[nodiscard]] const VariablePlace* place_of(std::size_t index, std::uint32_t robot) const;
  [[nodiscard]] behaviours::BehavioursEngine& host_of(std::uint32_t robot) const;
  [[nodiscard]] std::string name_of(std::size_t index) const;

  std::shared_ptr<const RunPlan> plan_;
  local::Engines engines_;
  RunSchedule schedule_;
  ark::StationOutputs station_outputs_;
  os::WorkerPool alone_{1};  ///< arenas step beside each other, not within
  /// Per variable and program: where it is, if anywhere.
  std::vector<std::vector<std::unique_ptr<const VariablePlace>>> places_;
  std::uint64_t chain_ = 0, directives_ = 0;
};

}  // namespace kilotwin::arenas
