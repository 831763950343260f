/// Tracked robots over DDS: one TrackerFrame of idl/public.idl per camera frame.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "clients/track/tracker.hpp"
#include "core/dds/dds.hpp"
#include "core/federation/topics.hpp"

namespace kilotwin::cli {

class TrackerStream {
 public:
  /// `source`: the tracker's name, at most 64 characters.
  TrackerStream(const dds::Transport& transport, std::string source);

  /// `capture_ns`: steady clock.
  void publish(std::uint64_t frame, std::int64_t capture_ns, const std::vector<track::TrackedRobot>& robots);

 private:
  std::string source_;
  dds::Participant participant_;
  dds::Writer<PublicTrackerFrame> writer_;
};

}  // namespace kilotwin::cli
