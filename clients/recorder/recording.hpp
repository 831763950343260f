/// What writer and readers of a recording agree on, besides idl/recording.proto.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/base/time.hpp"
#include "idl/manifest.pb.h"
#include "idl/recording.pb.h"

namespace kilotwin::recorder {

inline constexpr std::uint32_t kRecordingFormat = 1;
/// Length and CRC in front of each record.
inline constexpr std::size_t kFramePrefix_bytes = 8;
/// No record is longer: a state of 100,000 robots takes 2.6 MB, and protobuf ends at 2 GiB.
inline constexpr std::uint32_t kLongestRecord_bytes = 1u << 30;

/// The header that belongs to a run which starts at `first_tick` with the state hash `first_hash`.
[[nodiscard]] inline proto::RecordingHeader recording_header(const proto::Manifest& manifest, Tick first_tick = Tick{0},
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
  header.set_arena_width_mm(experiment.arena().width_mm());
  header.set_arena_height_mm(experiment.arena().height_mm());
  header.set_messages(experiment.recording().messages());
  header.set_first_tick(first_tick.count());
  header.set_first_hash(first_hash);
  return header;
}

/// At which ticks states are recorded: the first tick at or after 0, every_s, 2 every_s... A run's first and last states
/// are recorded besides.
class RecordingSchedule {
 public:
  RecordingSchedule(TickLength tick_length, double every_s) : tick_length_(tick_length), every_s_(every_s) {}
  [[nodiscard]] bool due(Tick tick) const { return at_or_after(tick) == tick; }
  /// The first scheduled tick at or after `tick` (>= 0).
  [[nodiscard]] Tick at_or_after(Tick tick) const {
    // Rounding may put the multiple in question one off, so that its neighbours are looked at too.
    auto multiple = static_cast<std::int64_t>(tick_length_.seconds_at(tick) / every_s_) - 1;
    if (multiple < 0) multiple = 0;
    Tick scheduled = tick_length_.at_or_after(static_cast<double>(multiple) * every_s_);
    while (scheduled < tick) scheduled = tick_length_.at_or_after(static_cast<double>(++multiple) * every_s_);
    return scheduled;
  }

 private:
  TickLength tick_length_;
  double every_s_;
};

}  // namespace kilotwin::recorder
