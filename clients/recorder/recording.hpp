/// Parts of the recording format beyond idl/recording.proto: frames, header, schedule.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "core/base/time.hpp"
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
  *header.mutable_environment() = experiment.station().environment();
  header.set_messages(experiment.recording().messages());
  header.set_first_tick(first_tick.count());
  header.set_first_hash(first_hash);
  return header;
}

/// A field of a state as a span.
[[nodiscard]] inline std::span<const double> values(const google::protobuf::RepeatedField<double>& field) {
  return {field.data(), static_cast<std::size_t>(field.size())};
}

/// The first tick at or after `seconds` (>= 0). A multiple of an interval that rounding raises by some nanoseconds above a
/// tick counts as that tick.
[[nodiscard]] inline Tick tick_at_or_after(TickLength length, double seconds) {
  constexpr double kSlack_ticks = 1e-6;
  const double ticks = seconds / length.seconds() - kSlack_ticks;
  if (ticks <= 0) return Tick{0};
  const auto whole = static_cast<std::int64_t>(ticks);
  return Tick{static_cast<double>(whole) < ticks ? whole + 1 : whole};
}

/// Ticks at which states are recorded: the first tick at or after 0, every_s, 2 every_s... The first and last states of a
/// run are recorded in addition.
class RecordingSchedule {
 public:
  RecordingSchedule(TickLength tick_length, double every_s) : tick_length_(tick_length), every_s_(every_s) {}
  [[nodiscard]] bool due(Tick tick) const { return at_or_after(tick) == tick; }
  /// The tick of instant `number` * every_s.
  [[nodiscard]] Tick tick(std::int64_t number) const {
    return tick_at_or_after(tick_length_, static_cast<double>(number) * every_s_);
  }
  /// The first instant whose tick is `from` (>= 0) or later.
  [[nodiscard]] std::int64_t number_from(Tick from) const {
    // The quotient is exact to +-1. If an interval is shorter than a tick, several instants have the same tick.
    auto number = static_cast<std::int64_t>(tick_length_.seconds_at(from) / every_s_);
    while (number > 0 && tick(number - 1) >= from) --number;
    while (tick(number) < from) ++number;
    return number;
  }
  /// The first scheduled tick at or after `from` (>= 0).
  [[nodiscard]] Tick at_or_after(Tick from) const { return tick(number_from(from)); }

 private:
  TickLength tick_length_;
  double every_s_;
};

}  // namespace kilotwin::recorder
