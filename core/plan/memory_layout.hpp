/// What every robot must remember from tick to tick for the effects of an experiment: a number of doubles per robot, the
/// same for all robots of a run. Physics keeps them, frames carry them between partitions, checkpoints and hashes hold them.
#pragma once

#include <cstdint>
#include <vector>

#include "idl/experiment.pb.h"

namespace kilotwin {

/// One double of each robot.
struct MemorySlot {
  enum class Kind : std::uint8_t {
    kCommand,           ///< number of the Command of the tick before; STOP at first
    kTimeSinceCommand,  ///< s for which that has lasted
    kEpisode,           ///< of effect `index`, `function`: s until the next begins, or less than 0: until it ends
    kLeftMotorTime,     ///< s, forgetting within `forget_s`
    kRightMotorTime,
    kDrivenTime,
    kPreviousForward,  ///< mm/s
    kPreviousSideways,
    kPreviousTurn,     ///< rad/s
    kFieldCell,        ///< cell of field `index` in which the robot was counted last; -1: none
    kNoise,            ///< of effect `index`, `function`, `wheel`
    kPreviousCommand,  ///< number of the Command before kCommand; STOP at first
    kLastTurn,         ///< number of the last Command that was LEFT or RIGHT; 0 at first
    kPreviousLasted,   ///< s for which the Command before kCommand lasted; 0 at first
    kSinceRest,        ///< s for which a motor has turned without a rest of both
  };
  Kind kind;
  double forget_s = 0;
  std::uint32_t index = 0, function = 0, wheel = 0;  ///< wheel: 1 for the right one where both have their own

  bool operator==(const MemorySlot&) const = default;
};

class MemoryLayout {
 public:
  MemoryLayout() = default;
  explicit MemoryLayout(const proto::Experiment&);

  [[nodiscard]] const std::vector<MemorySlot>& slots() const { return slots_; }
  [[nodiscard]] std::uint32_t size() const { return static_cast<std::uint32_t>(slots_.size()); }
  /// The slot must be there.
  [[nodiscard]] std::uint32_t index_of(const MemorySlot&) const;

 private:
  void need(const MemorySlot&);

  std::vector<MemorySlot> slots_;
};

/// Whether the effect acts on what is measured, not on how robots move.
[[nodiscard]] bool is_measured(proto::Effect::Target);
/// Whether the effect is computed for each wheel on its own: its noise and what it looks at are the wheel's.
[[nodiscard]] bool is_per_wheel(const proto::Effect&);

}  // namespace kilotwin
