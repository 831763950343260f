/// Interface of the robots that run real firmware, for the radio: light in, light out, exact to the cycle. Implemented by
/// services/comm/firmware.
#pragma once

#include <algorithm>
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
  /// The radio advances robots in spans of this length.
  static constexpr Cycles kSpan = 2048;

  struct Outputs {
    std::uint8_t motor_left = 0, motor_right = 0, led = 0;  ///< as in ActuationFrame
    std::uint8_t spin_up = 0;    ///< how long both motors had full duty in the tick: core/base/spin_up.hpp
    bool listening = true;       ///< neither halted nor asleep with its clocks off
    bool flat = false;           ///< off because its battery is empty
    std::uint8_t fault = 0;      ///< firmware::Halt of a robot that has faulted, else 0
    std::uint32_t fault_at = 0;  ///< address in flash, octets
  };

  virtual ~FirmwareRobots() = default;
  /// Ids of the robots, ascending. All other functions take an index into this list.
  [[nodiscard]] virtual std::span<const std::uint32_t> ids() const = 0;

  /// Runs `robots` to `until`, each from the last commit(), even if it has run since. light[i]: pulses on robot i, ascending.
  /// flashes[i] is set to the starts of its own pulses before `until`. Both vectors have an entry per firmware robot; only
  /// entries of `robots` are used.
  virtual void run(Cycles until, std::span<const std::uint32_t> robots,
                   const std::vector<std::vector<Pulse>>& light, std::vector<std::vector<Cycles>>& flashes) = 0;
  /// Makes the last run final. All robots have reached the same time; the next run begins there.
  virtual void commit() = 0;
  /// Robot i has sent a whole packet within this tick.
  virtual void note_sent(std::uint32_t i) = 0;

  /// Begins a tick with these poses.
  virtual void begin_tick(const SwarmView&) = 0;
  virtual void end_tick() = 0;
  [[nodiscard]] virtual Outputs outputs(std::uint32_t i) const = 0;
  /// Copies octets of robot i's RAM, which begins at address 0x100. Returns false where it has none there.
  [[nodiscard]] virtual bool read(std::uint32_t i, std::uint16_t address, std::span<std::uint8_t> to) const {
    return static_cast<void>(i), static_cast<void>(address), static_cast<void>(to), false;
  }
  /// Voltage of robot i's battery, V. Called only if the experiment has batteries.
  [[nodiscard]] virtual double battery_V(std::uint32_t i) const { return static_cast<void>(i), 0; }
  /// Writes the text that robots have printed and that waits. Throws RunError if a file cannot be written.
  virtual void flush_logs() const {}
  /// Digest of the robot's state, for the state hash.
  [[nodiscard]] virtual std::uint64_t word(std::uint32_t i) const = 0;
  [[nodiscard]] virtual std::string save(std::uint32_t i) const = 0;
  /// Restores the result of save(). Throws RunError if it does not fit.
  virtual void load(std::uint32_t i, const std::string& octets) = 0;
};

/// The index of a firmware robot.
[[nodiscard]] inline std::uint32_t index_of(std::uint32_t robot, const FirmwareRobots& robots) {
  const auto ids = robots.ids();
  return static_cast<std::uint32_t>(std::lower_bound(ids.begin(), ids.end(), robot) - ids.begin());
}

}  // namespace kilotwin::comm
