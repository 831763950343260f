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

namespace kilotwin {
namespace {

constexpr std::uint32_t kManifestFormat = 1;

void require(bool condition, const std::string& wrong, const char* right) {
  if (!condition) throw UserError("manifest: " + wrong + "; " + right);
}

/// The manifest itself, where it is one from which a plan can be made.
proto::Manifest checked(proto::Manifest manifest) {
  require(manifest.format() == kManifestFormat, "is of format " + std::to_string(manifest.format()),
          "this program reads format 1: prepare the run again");
  const proto::Experiment& experiment = manifest.experiment();
  const proto::Deployment& deployment = experiment.deployment();
  require(experiment.tick_cycles() > 0, "tick_cycles is 0", "2^15..2^20");
  require(experiment.duration_s() > 0 && experiment.duration_s() <= 1e6, "duration_s is out of range",
          "above 0, at most 1e6");
  require(experiment.arena().width_mm() > 0 && experiment.arena().height_mm() > 0, "the arena is empty",
          "40..1e6 mm");
  const auto divides = [](std::uint32_t n) { return n >= 1 && n <= 64; };
  require(divides(deployment.partition_columns()) && divides(deployment.partition_rows()) &&
              divides(deployment.hosts()),
          "partition_columns, partition_rows or hosts is out of range", "1..64 each");

  std::uint64_t robots = 0;
  for (const proto::RobotGroup& group : experiment.robots()) robots += group.count();
  const auto poses = static_cast<std::uint64_t>(manifest.x_mm_size());
  require(poses == robots && manifest.y_mm_size() == manifest.x_mm_size() &&
              manifest.heading_rad_size() == manifest.x_mm_size(),
          "the initial poses do not match the " + std::to_string(robots) + " robots of the experiment",
          "one pose per robot");
  require(manifest.group_program_size() == experiment.robots_size(),
          "group_program does not match the groups of robots", "one entry per group");
  for (const std::uint32_t program : manifest.group_program()) {
    require(
        program == kNoProgram || program < static_cast<std::uint32_t>(manifest.program_size()),
        "group_program names program " + std::to_string(program) + " of " + std::to_string(manifest.program_size()),
        "an index into program");
  }
  int rasters = 0;
  for (const proto::LightImage& image : experiment.light().image()) rasters += image.png_size();
  require(manifest.light_raster_size() == rasters, "the pictures of light do not match the experiment",
          "one raster per picture");
  for (const proto::LightRaster& raster : manifest.light_raster()) {
    const std::uint64_t pixels = std::uint64_t{raster.columns()} * raster.rows();
    require(pixels > 0 && raster.brightness().size() == pixels, "a picture of light is damaged",
            "as many octets as pixels");
  }
  for (const proto::RobotEeprom& eeprom : manifest.eeprom()) {
    require(eeprom.robot() < robots && eeprom.content().size() == 1024, "an EEPROM is damaged", "1024 octets");
  }
  return manifest;
}

World world_of(const proto::Experiment& experiment) {
  try {
    return World(experiment);
  } catch (const std::invalid_argument& error) {
    throw UserError(std::string("manifest: a shape of the experiment is wrong: ") + error.what() +
                    "; prepare the run again");
  }
}

/// Of all fields but `mode`: a local and a federated run of the same experiment are the same run.
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

/// Index of the cell of `count` that `offset_cells` (distance from the first edge, in cells) falls into, ends included.
std::uint32_t cell_of(double offset_cells, std::uint32_t count) {
  if (!(offset_cells >= 1)) return 0;
  return offset_cells < count ? static_cast<std::uint32_t>(offset_cells) : count - 1;
}

/// Distance of two intervals, 0 where they touch or overlap. Lower ends are never +infinity, upper ends never -infinity.
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
  // The quotient is rounded; the edges decide. The outermost ones are infinite and end the loops.
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
    : manifest(checked(std::move(given))),
      tick_length(experiment().tick_cycles()),
      last_tick(tick_length.at_or_after(experiment().duration_s())),
      world(world_of(experiment())),
      grid(2 * world.arena.half_width_mm(), 2 * world.arena.half_height_mm(),
           experiment().deployment().partition_columns(), experiment().deployment().partition_rows()),
      hosts(experiment().deployment().hosts()),
      memory(experiment()),
      hash(hash_of(manifest)) {
  program_of_.reserve(robots());
  group_of_.reserve(robots());
  uid_of_.reserve(robots());
  for (int group = 0; group < experiment().robots_size(); ++group) {
    const proto::RobotGroup& robots_of_group = experiment().robots(group);
    program_of_.insert(program_of_.end(), robots_of_group.count(), manifest.group_program(group));
    immobile_.insert(immobile_.end(), robots_of_group.count(), robots_of_group.immobile());
    group_of_.insert(group_of_.end(), robots_of_group.count(), static_cast<std::uint32_t>(group));
    std::uint32_t uid =
        robots_of_group.has_first_uid() ? robots_of_group.first_uid() : static_cast<std::uint32_t>(uid_of_.size());
    while (uid_of_.size() < program_of_.size()) uid_of_.push_back(static_cast<std::uint16_t>(uid++));
  }
}

std::string program_file(const proto::Program& program) {
  const std::string& path = program.path();
  const bool hex = path.size() > 4 && (path.ends_with(".hex") || path.ends_with(".HEX"));
  return program.sha256() + (!program.firmware() ? ".so" : hex ? ".hex" : ".elf");
}

bool RunPlan::has_firmware() const {
  return std::any_of(manifest.program().begin(), manifest.program().end(),
                     [](const proto::Program& program) { return program.firmware(); });
}

Pose RunPlan::initial_pose(std::uint32_t robot) const {
  const int i = static_cast<int>(robot);
  return {{manifest.x_mm(i), manifest.y_mm(i)}, manifest.heading_rad(i)};
}

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
