/// Who must be heard before a federate may step: a pure state machine, free of clocks and networks.
#pragma once

#include <vector>

#include "core/base/ids.hpp"
#include "core/base/time.hpp"

namespace kilotwin {

/// Frames of a publisher that may be outstanding at once. A publisher is at most 4 ticks ahead of a reader (schedule.hpp),
/// so a ring of this many slots never overwrites what is still to be read.
inline constexpr std::int64_t kFrameRing = 8;

/// Keeps, per expected publisher, the newest tick heard. Frames of one publisher arrive in order and without gaps
/// (reliable delivery).
class TickGate {
 public:
  /// `first`: the tick of the first frame expected from everybody, and where the reader stands.
  TickGate(std::vector<FederateId> publishers, Tick first);

  /// A hello, which carries no state, was heard. False: nobody expects this publisher here.
  bool hello(FederateId publisher);
  enum class Arrival { kNew, kRepeated, kUnexpected };
  /// What a frame is that was just heard. kNew: the next one of its publisher. kRepeated: an older one again, or one from
  /// before `first`. kUnexpected: not one of ours, or one that leaves a gap or runs ahead of the reader by the whole ring.
  [[nodiscard]] Arrival arrival(FederateId publisher, Tick tick) const;
  /// A new frame can be read from now on. False where it is not new.
  bool accept(FederateId publisher, Tick tick);
  /// The reader has come to `tick`: it reads the frames of that tick, and is done with those before.
  void reading(Tick tick) { reading_ = tick; }

  /// Every publisher has said hello.
  [[nodiscard]] bool heard_all() const;
  /// Every publisher's frame of `tick` is here.
  [[nodiscard]] bool ready(Tick tick) const;
  /// The publishers whose frame of `tick` is not here yet, ascending.
  [[nodiscard]] std::vector<FederateId> missing(Tick tick) const;
  /// Those who have not said hello yet.
  [[nodiscard]] std::vector<FederateId> unheard() const;
  [[nodiscard]] const std::vector<FederateId>& publishers() const { return publishers_; }
  /// Index of a publisher in publishers(), or -1.
  [[nodiscard]] std::ptrdiff_t index_of(FederateId publisher) const;

 private:
  std::vector<FederateId> publishers_;
  std::vector<Tick> newest_;  // first - 1: nothing yet
  Tick reading_;
  std::vector<bool> hello_;
};

}  // namespace kilotwin
