/// Gate before a step: it knows which publishers' frames are missing. A pure state machine without clock and network.
#pragma once

#include <vector>

#include "core/base/ids.hpp"
#include "core/base/time.hpp"

namespace kilotwin {

/// Slots of a publisher's ring buffer. A publisher is at most 4 ticks ahead of a reader (schedule.hpp), so a frame is never
/// overwritten before it is read.
inline constexpr std::int64_t kFrameRing = 8;

/// Tracks the newest tick received from each expected publisher. Frames of one publisher arrive in order and without gaps, because
/// delivery is reliable.
class TickGate {
 public:
  /// `first`: the tick of the first frame expected from each publisher, and the reader's current tick.
  TickGate(std::vector<FederateId> publishers, Tick first);

  /// Registers a hello, which carries no state. False if the publisher is not expected.
  bool hello(FederateId publisher);
  enum class Arrival { kNew, kRepeated, kUnexpected };
  /// Classifies a received frame. kNew: the publisher's next frame. kRepeated: an older one, or one before `first`. kUnexpected: the
  /// publisher is not expected, or the frame leaves a gap, or it is ahead of the reader by the whole ring.
  [[nodiscard]] Arrival arrival(FederateId publisher, Tick tick) const;
  /// Makes a new frame readable. False if it is not new.
  bool accept(FederateId publisher, Tick tick);
  /// Sets the tick whose frames the reader uses. It no longer needs older frames.
  void reading(Tick tick) { reading_ = tick; }

  /// Whether every publisher has sent a hello.
  [[nodiscard]] bool heard_all() const;
  /// Whether every publisher's frame of `tick` has arrived.
  [[nodiscard]] bool ready(Tick tick) const;
  /// The publishers whose frame of `tick` is missing, ascending.
  [[nodiscard]] std::vector<FederateId> missing(Tick tick) const;
  /// The publishers that have not sent a hello, ascending.
  [[nodiscard]] std::vector<FederateId> unheard() const;
  [[nodiscard]] const std::vector<FederateId>& publishers() const { return publishers_; }
  /// Index of a publisher in publishers(), or -1.
  [[nodiscard]] std::ptrdiff_t index_of(FederateId publisher) const;

 private:
  std::vector<FederateId> publishers_;
  std::vector<Tick> newest_;  // per publisher; first - 1 before its first frame
  Tick reading_;
  std::vector<bool> hello_;
};

}  // namespace kilotwin
