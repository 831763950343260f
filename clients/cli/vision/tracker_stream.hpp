/// Tracked robots over DDS: one TrackerFrame of idl/public.idl per camera frame.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "clients/doors/tracked_frame.hpp"
#include "clients/track/tracker.hpp"
#include "core/dds/dds.hpp"

namespace kilotwin::cli {

/// Meaning of the ids of samples: tracks, or the robots' own numbers. Robots whose number is not known are then left out.
enum class SampleIds { kTracks, kNumbers };

class TrackerStream {
 public:
  /// `source`: the tracker's name, at most 64 characters.
  TrackerStream(const dds::Transport& transport, std::string source, SampleIds ids = SampleIds::kTracks);

  /// `capture_ns`: steady clock.
  void publish(std::uint64_t frame, std::int64_t capture_ns, const std::vector<track::TrackedRobot>& robots);
  [[nodiscard]] const dds::Participant& participant() const { return participant_; }

 private:
  SampleIds ids_;
  dds::Participant participant_;
  doors::FrameWriter writer_;
};

}  // namespace kilotwin::cli
