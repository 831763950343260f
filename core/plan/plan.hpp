/// RunPlan: the resolved experiment. Every federate computes the same plan from the same manifest. Every engine is built from a
/// plan and its index in it.
///
/// Each subject's settings have a header (motion_settings.hpp, radio_settings.hpp...). Units include only the headers of the
/// settings that they read. No header of this folder includes the schema.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/ids.hpp"
#include "core/base/pose.hpp"
#include "core/base/time.hpp"
#include "core/plan/memory_layout.hpp"
#include "core/plan/run_settings.hpp"
#include "core/plan/world.hpp"

namespace kilotwin {

namespace proto {
class Manifest;
}
struct ArenaFieldSettings;
struct BatterySettings;
struct EffectSettings;
struct LightSettings;
struct MotionSettings;
struct PhysicsSettings;
struct PlanSettings;
struct RadioSettings;
struct RobotSettings;
struct StationSettings;
struct TemperatureSettings;
struct TrackingSettings;

/// A half-open rectangle of the arena, mm. Outer edges of the outermost partitions are infinite, so that every pose has an owner.
struct Rectangle {
  double x_min_mm, y_min_mm, x_max_mm, y_max_mm;
  [[nodiscard]] bool contains(double x_mm, double y_mm) const {
    return x_mm >= x_min_mm && x_mm < x_max_mm && y_mm >= y_min_mm && y_mm < y_max_mm;
  }
  /// Distance of a point from the rectangle; 0 inside.
  [[nodiscard]] double distance_mm(double x_mm, double y_mm) const;
  /// Distance of two rectangles; 0 if they touch or overlap.
  [[nodiscard]] double distance_mm(const Rectangle& other) const;
};

/// Division of the arena into columns x rows equal rectangles. Partition (column, row) has id row * columns + column; row 0 is the
/// bottom row.
class PartitionGrid {
 public:
  PartitionGrid(double arena_width_mm, double arena_height_mm, std::uint32_t columns, std::uint32_t rows);
  [[nodiscard]] std::uint32_t columns() const { return columns_; }
  [[nodiscard]] std::uint32_t rows() const { return rows_; }
  [[nodiscard]] std::uint32_t size() const { return columns_ * rows_; }
  [[nodiscard]] const Rectangle& rectangle(PartitionId p) const { return rectangles_[p.value()]; }
  /// The partition that owns a robot at this position.
  [[nodiscard]] PartitionId owner(double x_mm, double y_mm) const;
  /// Ascending ids of the partitions other than `p` whose rectangle lies within `margin_mm` of that of `p`.
  [[nodiscard]] std::vector<PartitionId> neighbours(PartitionId p, double margin_mm) const;

 private:
  std::uint32_t columns_, rows_;
  double x0_mm_, y0_mm_, cell_width_mm_, cell_height_mm_;
  std::vector<Rectangle> rectangles_;
};

/// A range of robot ids, [first, last).
struct Share {
  std::uint32_t first, last;
  [[nodiscard]] std::uint32_t size() const { return last - first; }
  [[nodiscard]] bool contains(std::uint32_t robot) const { return robot >= first && robot < last; }
};

class RunPlan {
  // Declared first, because the members below are initialised from them.
  std::shared_ptr<const proto::Manifest> manifest_;
  std::shared_ptr<const PlanSettings> settings_;

 public:
  /// Throws UserError if the manifest has another format or is inconsistent.
  explicit RunPlan(proto::Manifest manifest);

  const TickLength tick_length;
  const double duration_s;  ///< as stated in the experiment
  const Tick last_tick;     ///< the run ends at this tick
  const World world;        ///< walls, obstacles, movable bodies
  const PartitionGrid grid;
  const std::uint32_t hosts;
  const MemoryLayout memory;  ///< layout of the effects' memory
  const std::uint64_t hash;   ///< hash of all that determines results and topology; alike in all federates of a run
  const bool resumed;         ///< the run starts from the checkpoint in resumed/ of the run directory
  const double pace;          ///< upper limit of simulated time over wall time; 0: none
  const double max_lateness_s;  ///< of a tick behind the pace before the run stops; 0: any
  const std::string mode;       ///< "local" or "federated"
  const std::string build;  ///< build identity of the program that prepared the run: core/base/build_identity.hpp

  /// The manifest of which the plan was made. Callers include idl/manifest.pb.h.
  [[nodiscard]] const proto::Manifest& manifest() const { return *manifest_; }

  [[nodiscard]] std::uint64_t run() const { return run_; }
  [[nodiscard]] std::uint64_t seed() const { return seed_; }
  /// Ticks between checkpoints; 0: none.
  [[nodiscard]] std::int64_t checkpoint_every() const { return checkpoint_every_; }
  [[nodiscard]] const std::string& experiment_name() const;
  [[nodiscard]] std::uint32_t run_number() const;  ///< the covariate RUN
  [[nodiscard]] const MotionSettings& motion_settings() const;
  /// Settings of single robots. They may contain ids that this run does not have.
  [[nodiscard]] const std::vector<RobotSettings>& robot_settings() const;
  [[nodiscard]] const std::vector<EffectSettings>& effects() const;
  [[nodiscard]] const std::vector<ArenaFieldSettings>& fields() const;
  [[nodiscard]] const PhysicsSettings& physics_settings() const;
  [[nodiscard]] const RadioSettings& radio_settings() const;
  [[nodiscard]] const StationSettings& station_settings() const;
  [[nodiscard]] const std::optional<LightSettings>& light_settings() const;
  [[nodiscard]] const std::optional<BatterySettings>& battery_settings() const;
  [[nodiscard]] const std::optional<TemperatureSettings>& temperature_settings() const;
  [[nodiscard]] const TrackingSettings& tracking_settings() const;
  [[nodiscard]] const RecordingSettings& recording_settings() const;
  [[nodiscard]] const std::vector<Program>& programs() const;
  [[nodiscard]] const std::vector<RobotEeprom>& eeproms() const;  ///< the EEPROMs that the experiment states
  [[nodiscard]] const std::vector<ProgramFailure>& program_failures() const;

  [[nodiscard]] std::uint32_t robots() const { return static_cast<std::uint32_t>(program_of_.size()); }
  [[nodiscard]] Pose initial_pose(std::uint32_t robot) const;
  /// Index of the robot's program in programs(), or kNoProgram where it runs none.
  [[nodiscard]] std::uint32_t program_of(std::uint32_t robot) const { return program_of_[robot]; }
  /// Whether the robot is a real one. It may have a program, its shadow.
  [[nodiscard]] bool tracked(std::uint32_t robot) const { return tracked_[robot] != 0; }
  /// Whether any robot is.
  [[nodiscard]] bool any_tracked() const { return any_tracked_; }
  /// Whether the robot is immobile: motors have no effect, and nothing moves it.
  [[nodiscard]] bool immobile(std::uint32_t robot) const { return immobile_[robot] != 0; }
  /// Side of the robot's square if it is a cell of a Kilogrid, mm; 0: it is a robot.
  [[nodiscard]] double cell_side_mm(std::uint32_t robot) const {
    return cell_side_mm_.empty() ? 0 : cell_side_mm_[robot];
  }
  /// Whether any is a cell.
  [[nodiscard]] bool any_cells() const { return !cell_side_mm_.empty(); }
  /// Number of bodies that robots can push: world.movables.
  [[nodiscard]] std::uint32_t movables() const { return static_cast<std::uint32_t>(world.movables.size()); }
  /// Whether the robot runs AVR firmware. The radio simulates its processor.
  [[nodiscard]] bool firmware(std::uint32_t robot) const;
  /// Whether any robot runs AVR firmware.
  [[nodiscard]] bool has_firmware() const;
  /// The robot's calibrated kilo_uid: its id, or its number in the group plus the group's first uid.
  [[nodiscard]] std::uint16_t uid_of(std::uint32_t robot) const { return uid_of_[robot]; }
  /// Whether behaviours hosts need poses: for light, and for batteries that can be charged.
  [[nodiscard]] bool hosts_see_bodies() const;
  /// The loop rate of the robot's group.
  [[nodiscard]] LoopRate loop_rate(std::uint32_t robot) const { return loop_rate_[robot]; }
  /// The robots of a behaviours host: a range of ids. The sizes of all hosts' shares differ by at most one.
  [[nodiscard]] Share share(HostId host) const;
  [[nodiscard]] HostId host_of(std::uint32_t robot) const;

  // Federates, in the order of their ids: partitions, radio, station, hosts.
  [[nodiscard]] std::uint32_t federates() const { return grid.size() + 2 + hosts; }
  [[nodiscard]] FederateId physics(PartitionId p) const { return FederateId{p.value()}; }
  [[nodiscard]] FederateId radio() const { return FederateId{grid.size()}; }
  [[nodiscard]] FederateId station() const { return FederateId{grid.size() + 1}; }
  [[nodiscard]] FederateId behaviours(HostId h) const { return FederateId{grid.size() + 2 + h.value()}; }
  [[nodiscard]] std::vector<FederateId> all_physics() const { return ids(0, grid.size()); }
  [[nodiscard]] std::vector<FederateId> all_behaviours() const { return ids(grid.size() + 2, federates()); }
  /// "physics 0,1" (column, row), "radio", "station", "behaviours 1/3" (counted from 1).
  [[nodiscard]] std::string name(FederateId id) const;

 private:
  static std::vector<FederateId> ids(std::uint32_t from, std::uint32_t to) {
    std::vector<FederateId> result;
    for (std::uint32_t i = from; i < to; ++i) result.push_back(FederateId{i});
    return result;
  }

  std::uint64_t run_, seed_;
  std::int64_t checkpoint_every_;
  bool any_tracked_ = false;
  // Per robot.
  std::vector<std::uint32_t> program_of_;
  std::vector<std::uint8_t> immobile_, tracked_;
  std::vector<double> cell_side_mm_;  ///< empty: no cells
  std::vector<LoopRate> loop_rate_;
  std::vector<std::uint16_t> uid_of_;
};

}  // namespace kilotwin
