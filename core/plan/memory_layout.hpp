/// Layout of the effects' memory: the doubles per robot that the effects of an experiment need from tick to tick. It is the same
/// for all robots of a run. Physics holds them, frames carry them between partitions, checkpoints and hashes include them.
#pragma once

#include <cstdint>
#include <vector>

namespace kilotwin {

struct ArenaFieldSettings;
struct EffectSettings;

/// Meaning of one double per robot.
struct MemorySlot {
  enum class Kind : std::uint8_t {
    kCommand,           ///< the MotionCommand of the previous tick; initially kStop
    kTimeSinceCommand,  ///< duration of that command so far, s
    kEpisode,  ///< effect `index`, function `function`: >= 0: s until the next episode; < 0: minus s until its end
    kLeftMotorTime,  ///< motor-on time, s; it decays exponentially with time constant `forget_s`
    kRightMotorTime,
    kDrivenTime,
    kPreviousForward,  ///< velocity in the previous tick, mm/s
    kPreviousSideways,
    kPreviousTurn,     ///< rad/s
    kFieldCell,        ///< cell of field `index` that last counted the robot; -1: none
    kNoise,            ///< state of the noise of effect `index`, function `function`, `wheel`
    kPreviousCommand,  ///< the MotionCommand before that of kCommand; initially kStop
    kLastTurn,         ///< the last MotionCommand that was kTurnLeft or kTurnRight; initially 0
    kPreviousLasted,   ///< duration of the command before that of kCommand, s; initially 0
    kSinceRest,        ///< time since both motors were last at rest, s
    kEarlierTurn,      ///< the last MotionCommand before that of kCommand that was a turn; initially 0
    kCommandCount,     ///< number of changes of the MotionCommand
  };
  Kind kind;
  double forget_s = 0;
  std::uint32_t index = 0, function = 0,
                wheel = 0;  ///< wheel: 1 for the right one if each wheel has a slot, else 0

  bool operator==(const MemorySlot&) const = default;
};

class MemoryLayout {
 public:
  MemoryLayout() = default;
  MemoryLayout(const std::vector<EffectSettings>&, const std::vector<ArenaFieldSettings>&);

  [[nodiscard]] const std::vector<MemorySlot>& slots() const { return slots_; }
  [[nodiscard]] std::uint32_t size() const { return static_cast<std::uint32_t>(slots_.size()); }
  /// Requires that the slot exists.
  [[nodiscard]] std::uint32_t index_of(const MemorySlot&) const;

 private:
  void need(const MemorySlot&);

  std::vector<MemorySlot> slots_;
};

}  // namespace kilotwin
