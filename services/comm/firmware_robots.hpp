/// The robots that run real firmware, as the radio drives them: light in, light out, to the cycle. Implemented by
/// services/comm/firmware.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/base/time.hpp"
#include "core/frames/swarm_view.hpp"
#include "core/model/ranging.hpp"
#include "services/comm/air.hpp"

namespace kilotwin::comm {

/// A pulse of infrared light at a receiver.
struct Pulse {
  Cycles time;
  Gains gains;
  bool operator==(const Pulse&) const = default;
};

class FirmwareRobots {
 public:
  /// Within a run, robots are looked at after each of so many cycles from its beginning on: whether their motors are kicked.
  static constexpr Cycles kSpan = 2048;

  struct Outputs {
    std::uint8_t motor_left = 0, motor_right = 0, led = 0;  ///< as in ActuationFrame
    /// Both motors were kicked: full duty for less than a tick does not show as a duty.
    bool spun_up = false;
    bool listening = true;       ///< neither halted nor asleep with its clocks off
    bool flat = false;           ///< off, as its battery is empty
    std::uint8_t fault = 0;      ///< firmware::Halt of one that has faulted, else 0
    std::uint32_t fault_at = 0;  ///< address in flash, octets
  };

  virtual ~FirmwareRobots() = default;
  /// Their ids, ascending. Below, robots are named by their index in it.
  [[nodiscard]] virtual std::span<const std::uint32_t> ids() const = 0;

  /// Runs robots to `until`, each from where commit() left it, even where it has run since. light[i]: what falls on robot i,
  /// ascending; flashes[i]: set to the starts of its own pulses, before `until`. Both have an entry per robot; only `robots` are touched.
  virtual void run(Cycles until, std::span<const std::uint32_t> robots,
                   const std::vector<std::vector<Pulse>>& light, std::vector<std::vector<Cycles>>& flashes) = 0;
  /// All have run to the same instant, and there is no way back. The next run begins there.
  virtual void commit() = 0;
  /// A robot has sent a whole packet within this tick.
  virtual void note_sent(std::uint32_t i) = 0;

  /// A tick begins, with these poses; and ends.
  virtual void begin_tick(const SwarmView&) = 0;
  virtual void end_tick() = 0;
  [[nodiscard]] virtual Outputs outputs(std::uint32_t i) const = 0;
  /// A word of its state, for the state hash.
  [[nodiscard]] virtual std::uint64_t word(std::uint32_t i) const = 0;
  [[nodiscard]] virtual std::string save(std::uint32_t i) const = 0;
  /// What save() made. Throws RunError where it does not fit.
  virtual void load(std::uint32_t i, const std::string& octets) = 0;
};

}  // namespace kilotwin::comm
