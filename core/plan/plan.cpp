#include "core/plan/plan.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numeric>
#include <stdexcept>

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>

#include "core/base/error.hpp"
#include "core/base/state_hash.hpp"
#include "core/plan/from_manifest.hpp"
#include "idl/manifest.pb.h"

namespace kilotwin {
namespace {

std::shared_ptr<const proto::Manifest> checked(proto::Manifest manifest) {
  check_manifest(manifest);
  return std::make_shared<const proto::Manifest>(std::move(manifest));
}

World world_of(const proto::Experiment& experiment) {
  try {
    return World(experiment);
  } catch (const std::invalid_argument& error) {
    throw UserError(std::string("manifest: a shape of the experiment is wrong: ") + error.what() +
                    "; prepare the run again");
  }
}

/// Hash of all fields except `mode`: a local and a federated run of the same experiment are the same run.
std::uint64_t hash_of(proto::Manifest manifest) {
  manifest.clear_mode();
  std::string bytes;
  {
    google::protobuf::io::StringOutputStream stream(&bytes);
    google::protobuf::io::CodedOutputStream coded(&stream);
    coded.SetSerializationDeterministic(true);
    manifest.SerializeToCodedStream(&coded);
  }
  return hash_bytes(bytes);
}

/// Index 0..count-1 of the cell at `offset_cells`, the distance from the first edge in cells. Offsets outside belong to the outermost
/// cells.
std::uint32_t cell_of(double offset_cells, std::uint32_t count) {
  if (!(offset_cells >= 1)) return 0;
  return offset_cells < count ? static_cast<std::uint32_t>(offset_cells) : count - 1;
}

/// Distance of two intervals; 0 if they touch or overlap. Lower ends are never +infinity, upper ends never -infinity.
double gap(double a_min, double a_max, double b_min, double b_max) {
  return std::max({0.0, b_min - a_max, a_min - b_max});
}

}  // namespace

double Rectangle::distance_mm(double x_mm, double y_mm) const {
  return distance_mm(Rectangle{x_mm, y_mm, x_mm, y_mm});
}

double Rectangle::distance_mm(const Rectangle& other) const {
  const double dx_mm = gap(x_min_mm, x_max_mm, other.x_min_mm, other.x_max_mm);
  const double dy_mm = gap(y_min_mm, y_max_mm, other.y_min_mm, other.y_max_mm);
  return __builtin_sqrt(dx_mm * dx_mm + dy_mm * dy_mm);
}

PartitionGrid::PartitionGrid(double arena_width_mm, double arena_height_mm, std::uint32_t columns,
                             std::uint32_t rows)
    : columns_(columns),
      rows_(rows),
      x0_mm_(-arena_width_mm / 2),
      y0_mm_(-arena_height_mm / 2),
      cell_width_mm_(arena_width_mm / columns),
      cell_height_mm_(arena_height_mm / rows) {
  KILOTWIN_DEMAND(columns >= 1 && rows >= 1 && arena_width_mm > 0 && arena_height_mm > 0);
  constexpr double infinity = std::numeric_limits<double>::infinity();
  const auto edge = [](double first_mm, double cell_mm, std::uint32_t i, std::uint32_t count) {
    return i == 0 ? -infinity : i == count ? infinity : first_mm + cell_mm * i;
  };
  rectangles_.reserve(std::size_t{columns} * rows);
  for (std::uint32_t row = 0; row < rows; ++row) {
    for (std::uint32_t column = 0; column < columns; ++column) {
      rectangles_.push_back(
          {edge(x0_mm_, cell_width_mm_, column, columns), edge(y0_mm_, cell_height_mm_, row, rows),
           edge(x0_mm_, cell_width_mm_, column + 1, columns), edge(y0_mm_, cell_height_mm_, row + 1, rows)});
    }
  }
}

PartitionId PartitionGrid::owner(double x_mm, double y_mm) const {
  KILOTWIN_DEMAND(!std::isnan(x_mm) && !std::isnan(y_mm));
  std::uint32_t column = cell_of((x_mm - x0_mm_) / cell_width_mm_, columns_);
  std::uint32_t row = cell_of((y_mm - y0_mm_) / cell_height_mm_, rows_);
  // The quotient is rounded, so compare with the edges. The outermost edges are infinite and end the loops.
  const auto at = [this](std::uint32_t c, std::uint32_t r) -> const Rectangle& {
    return rectangles_[r * columns_ + c];
  };
  while (x_mm < at(column, row).x_min_mm) --column;
  while (column + 1 < columns_ && x_mm >= at(column, row).x_max_mm) ++column;
  while (y_mm < at(column, row).y_min_mm) --row;
  while (row + 1 < rows_ && y_mm >= at(column, row).y_max_mm) ++row;
  return PartitionId{row * columns_ + column};
}

std::vector<PartitionId> PartitionGrid::neighbours(PartitionId p, double margin_mm) const {
  std::vector<PartitionId> ids;
  for (std::uint32_t other = 0; other < size(); ++other) {
    if (other != p.value() && rectangle(p).distance_mm(rectangles_[other]) <= margin_mm) ids.emplace_back(other);
  }
  return ids;
}

RunPlan::RunPlan(proto::Manifest given)
    : manifest_(checked(std::move(given))),
      settings_(std::make_shared<const PlanSettings>(settings_of(*manifest_))),
      tick_length(manifest_->experiment().tick_cycles()),
      duration_s(manifest_->experiment().duration_s()),
      last_tick(tick_length.at_or_after(duration_s)),
      world(world_of(manifest_->experiment())),
      grid(2 * world.arena.half_width_mm(), 2 * world.arena.half_height_mm(),
           manifest_->experiment().deployment().partition_columns(),
           manifest_->experiment().deployment().partition_rows()),
      hosts(manifest_->experiment().deployment().hosts()),
      memory(settings_->effects, settings_->fields),
      hash(hash_of(*manifest_)),
      resumed(manifest_->resumed()),
      pace(manifest_->pace()),
      max_lateness_s(manifest_->max_lateness_ms() / 1000),
      mode(manifest_->mode()),
      build(manifest_->build()),
      run_(manifest_->run()),
      seed_(manifest_->experiment().seed()),
      checkpoint_every_(
          tick_length.at_or_after(manifest_->experiment().deployment().checkpoint_every_s()).count()) {
  const auto robots = settings_->poses.size();
  program_of_.reserve(robots);
  immobile_.reserve(robots);
  loop_rate_.reserve(robots);
  uid_of_.reserve(robots);
  for (int g = 0; g < manifest_->experiment().robots_size(); ++g) {
    const proto::RobotGroup& group = manifest_->experiment().robots(g);
    program_of_.insert(program_of_.end(), group.count(), manifest_->group_program(g));
    const bool tracked = group.body() == proto::RobotGroup::TRACKED;
    any_tracked_ = any_tracked_ || tracked;
    tracked_.insert(tracked_.end(), group.count(), static_cast<std::uint8_t>(tracked));
    immobile_.insert(immobile_.end(), group.count(), group.immobile());
    if (group.has_cells()) cell_side_mm_.resize(robots, 0);
    if (group.has_cells())
      std::fill_n(cell_side_mm_.begin() + static_cast<std::ptrdiff_t>(uid_of_.size()), group.count(),
                  group.layout().grid().pitch_mm());
    loop_rate_.insert(
        loop_rate_.end(), group.count(),
        group.loop_rate() == proto::RobotGroup::AS_ON_ROBOT ? LoopRate::kAsOnRobot : LoopRate::kOncePerTick);
    auto uid = group.has_first_uid() ? group.first_uid() : static_cast<std::uint32_t>(uid_of_.size());
    while (uid_of_.size() < program_of_.size()) uid_of_.push_back(static_cast<std::uint16_t>(uid++));
  }
}

const std::string& RunPlan::experiment_name() const { return settings_->name; }
std::uint32_t RunPlan::run_number() const { return settings_->run_number; }
const MotionSettings& RunPlan::motion_settings() const { return settings_->motion; }
const std::vector<RobotSettings>& RunPlan::robot_settings() const { return settings_->robots; }
const std::vector<EffectSettings>& RunPlan::effects() const { return settings_->effects; }
const std::vector<ArenaFieldSettings>& RunPlan::fields() const { return settings_->fields; }
const PhysicsSettings& RunPlan::physics_settings() const { return settings_->physics; }
const RadioSettings& RunPlan::radio_settings() const { return settings_->radio; }
const StationSettings& RunPlan::station_settings() const { return settings_->station; }
const std::optional<LightSettings>& RunPlan::light_settings() const { return settings_->light; }
const std::optional<BatterySettings>& RunPlan::battery_settings() const { return settings_->battery; }
const std::optional<TemperatureSettings>& RunPlan::temperature_settings() const { return settings_->temperature; }
const TrackingSettings& RunPlan::tracking_settings() const { return settings_->tracking; }
const RecordingSettings& RunPlan::recording_settings() const { return settings_->recording; }
const std::vector<Program>& RunPlan::programs() const { return settings_->programs; }
const std::vector<RobotEeprom>& RunPlan::eeproms() const { return settings_->eeproms; }
const std::vector<ProgramFailure>& RunPlan::program_failures() const { return settings_->program_failures; }

std::string Program::file() const {
  const bool hex = path.size() > 4 && (path.ends_with(".hex") || path.ends_with(".HEX"));
  return sha256 + (!firmware ? ".so" : hex ? ".hex" : ".elf");
}

bool RunPlan::firmware(std::uint32_t robot) const {
  return program_of_[robot] != kNoProgram && settings_->programs[program_of_[robot]].firmware;
}

bool RunPlan::has_firmware() const {
  return std::any_of(settings_->programs.begin(), settings_->programs.end(),
                     [](const Program& program) { return program.firmware; });
}

bool RunPlan::hosts_see_bodies() const {
  return settings_->light.has_value() || (settings_->battery && !settings_->battery->chargers.empty());
}

Pose RunPlan::initial_pose(std::uint32_t robot) const { return settings_->poses[robot]; }

Share RunPlan::share(HostId host) const {
  const auto first_of = [this](std::uint64_t h) { return static_cast<std::uint32_t>(h * robots() / hosts); };
  return {first_of(host.value()), first_of(std::uint64_t{host.value()} + 1)};
}

HostId RunPlan::host_of(std::uint32_t robot) const {
  // The last host whose share begins at or before the robot: floor(h n / hosts) <= robot.
  return HostId{static_cast<std::uint32_t>(((std::uint64_t{robot} + 1) * hosts - 1) / robots())};
}

std::string RunPlan::name(FederateId id) const {
  const std::uint32_t i = id.value();
  KILOTWIN_DEMAND(i < federates());
  if (i < grid.size()) {
    return "physics " + std::to_string(i % grid.columns()) + "," + std::to_string(i / grid.columns());
  }
  if (id == radio()) return "radio";
  if (id == station()) return "station";
  return "behaviours " + std::to_string(i - grid.size() - 1) + "/" + std::to_string(hosts);
}

}  // namespace kilotwin
