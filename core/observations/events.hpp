/// Events for the recording: idl/recording.proto, EventRecord.
#pragma once

#include <cstdint>
#include <string>

#include "core/frames/swarm_view.hpp"
#include "core/plan/plan.hpp"

namespace kilotwin {

namespace proto {
class EventRecord;
class Observations;
}  // namespace proto

/// The kinds of events that a run records.
struct RecordedEvents {
  bool led = false, motion = false, state = false, sent = false, received = false, station = false;
  explicit RecordedEvents(const RunPlan& plan);
};

/// Adds the packets that the station sends in the step from the frame's tick.
void note_packets(const OverheadFrame& frame, proto::Observations& to);
/// Adds a robot's failure in the step from `tick`. `text`: one line, what happened and where in the program.
void note_failure(Tick tick, std::uint32_t robot, const std::string& text, proto::Observations& to);

/// Changes of LEDs, motors and life cycles from tick to tick. At the first tick every robot's state counts as a change.
class ChangeObserver {
 public:
  explicit ChangeObserver(const RunPlan& plan) : recorded_(plan) {}
  [[nodiscard]] bool any() const { return recorded_.led || recorded_.motion || recorded_.state; }
  void observe(const SwarmView& swarm, proto::Observations& to);
  /// Takes over what an earlier recording of the run said.
  void take(const proto::EventRecord& earlier, std::uint32_t robots);

 private:
  const RecordedEvents recorded_;
  std::vector<std::uint32_t> led_, motion_, state_;  ///< per robot: the last value; empty before the first
};

}  // namespace kilotwin
