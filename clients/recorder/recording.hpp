/// Parts of the recording format beyond idl/recording.proto: frames, header.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/base/recording_schedule.hpp"
#include "core/plan/world.hpp"
#include "idl/manifest.pb.h"
#include "idl/recording.pb.h"

namespace kilotwin::recorder {

/// Format 1 had no checksum of a frame's length.
inline constexpr std::uint32_t kRecordingFormat = 2;
/// A prefix precedes each record: the record's length, its CRC, and the CRC of these two.
inline constexpr std::size_t kFramePrefix_bytes = 12;
/// Largest length of a record. A state of 100,000 robots has 2.6 MB; protobuf's limit is 2 GiB.
inline constexpr std::uint32_t kLongestRecord_bytes = 1u << 30;

/// The header of a run that starts at `first_tick` with the state hash `first_hash`.
[[nodiscard]] inline proto::RecordingHeader recording_header(const proto::Manifest& manifest,
                                                             Tick first_tick = Tick{0},
                                                             std::uint64_t first_hash = 0) {
  const proto::Experiment& experiment = manifest.experiment();
  proto::RecordingHeader header;
  header.set_format(kRecordingFormat);
  header.set_run(manifest.run());
  header.set_name(experiment.name());
  header.set_seed(experiment.seed());
  header.set_tick_cycles(experiment.tick_cycles());
  header.set_robots(static_cast<std::uint32_t>(manifest.x_mm_size()));
  header.set_every_s(experiment.recording().every_s());
  const ArenaShape arena(experiment.arena());
  header.set_arena_width_mm(2 * arena.half_width_mm());
  header.set_arena_height_mm(2 * arena.half_height_mm());
  if (arena.kind() != ArenaShape::Kind::kRectangle) *header.mutable_arena() = experiment.arena();
  *header.mutable_obstacle() = experiment.obstacle();
  *header.mutable_movable() = experiment.movable();
  if (experiment.has_light()) *header.mutable_light() = experiment.light();
  for (const proto::RobotGroup& group : experiment.robots()) header.add_group_robots(group.count());
  const bool any_cells = std::any_of(experiment.robots().begin(), experiment.robots().end(),
                                     [](const proto::RobotGroup& group) { return group.has_cells(); });
  for (int g = 0; any_cells && g < experiment.robots_size(); ++g)
    header.add_group_cell_mm(experiment.robots(g).has_cells() ? experiment.robots(g).layout().grid().pitch_mm()
                                                              : 0);
  *header.mutable_environment() = experiment.station().environment();
  header.set_messages(experiment.recording().messages());
  for (const proto::ProgramVariable& variable : manifest.variable()) {
    proto::VariableColumn& column = *header.add_variable();
    column.set_name(variable.name());
    column.set_every_s(variable.every_s());
    column.set_integer(variable.integer());
  }
  *header.mutable_event() = experiment.recording().event();
  *header.mutable_observable() = experiment.observable();
  header.set_first_tick(first_tick.count());
  header.set_first_hash(first_hash);
  return header;
}

/// A field of a state as a span.
[[nodiscard]] inline std::span<const double> values(const google::protobuf::RepeatedField<double>& field) {
  return {field.data(), static_cast<std::size_t>(field.size())};
}

using kilotwin::RecordingSchedule;
using kilotwin::tick_at_or_after;

}  // namespace kilotwin::recorder
