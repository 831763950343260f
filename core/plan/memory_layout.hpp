/// What every robot must remember from tick to tick for the effects of an experiment: a number of doubles per robot, the
/// same for all robots of a run. Physics keeps them, frames carry them between partitions, checkpoints and hashes hold them.
#pragma once

#include <cstdint>
#include <vector>

namespace kilotwin {

struct ArenaFieldSettings;
struct EffectSettings;

/// One double of each robot.
struct MemorySlot {
  enum class Kind : std::uint8_t {
    kCommand,           ///< the MotionCommand of the tick before; kStop at first
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
    kPreviousCommand,  ///< the MotionCommand before that of kCommand; kStop at first
    kLastTurn,         ///< the last MotionCommand that was kTurnLeft or kTurnRight; 0 at first
    kPreviousLasted,   ///< s for which the command before that of kCommand lasted; 0 at first
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
  MemoryLayout(const std::vector<EffectSettings>&, const std::vector<ArenaFieldSettings>&);

  [[nodiscard]] const std::vector<MemorySlot>& slots() const { return slots_; }
  [[nodiscard]] std::uint32_t size() const { return static_cast<std::uint32_t>(slots_.size()); }
  /// The slot must be there.
  [[nodiscard]] std::uint32_t index_of(const MemorySlot&) const;

 private:
  void need(const MemorySlot&);

  std::vector<MemorySlot> slots_;
};

}  // namespace kilotwin
