/// The robots' oscillators and what the firmware's timer interrupt counts with them.
///
/// Timer 0 counts 0..255 for ever, 1024 cycles of the robot's own clock per count, and interrupts where it equals the
/// compare register. That register holds 255, so that an interrupt comes every 256 counts; after an aborted attempt it
/// holds a random value for once, which puts one more interrupt between two regular ones. Each interrupt is one kilo_tick,
/// and adds the value that matched to tx_clock, a 16-bit number. tx_clock runs from the reset on, whatever the robot does, and
/// only a message sent sets it back: robots that have been on for a while find it anywhere, and so send at once, all of them,
/// when they are told to RUN. With `model: PROPAGATION` they have been; else they are reset at tick 0.
#pragma once

#include <cstdint>
#include <vector>

#include "core/plan/plan.hpp"
#include "services/comm/air.hpp"

namespace kilotwin::comm {

class TickTimers {
 public:
  static constexpr std::uint8_t kRegular = 255;

  /// Rates and phases are drawn from the plan's seed; what is known of a robot's rate is added. The first interrupt of a robot comes within its first period.
  explicit TickTimers(const RunPlan&);

  /// When robot `i` is interrupted next.
  [[nodiscard]] Cycles next(std::uint32_t i) const { return next_[i]; }
  /// tx_clock as the next interrupt will find it.
  [[nodiscard]] std::uint16_t next_clock(std::uint32_t i) const { return sum(clock_[i], compare_[i]); }
  /// Nominal cycles between two regular interrupts.
  [[nodiscard]] Cycles period(std::uint32_t i) const { return period_[i]; }
  /// kilo_ticks since begin_tick().
  [[nodiscard]] const std::vector<std::uint8_t>& counts() const { return count_; }

  void begin_tick() { count_.assign(count_.size(), 0); }
  /// The next interrupt takes place.
  void interrupt(std::uint32_t i) {
    count_[i] = static_cast<std::uint8_t>(count_[i] + (count_[i] != 255));
    clock_[i] = next_clock(i);
    next_[i] += until_regular(i, compare_[i]);
    compare_[i] = kRegular;
  }
  /// All interrupts before `end` take place.
  void pass(std::uint32_t i, Cycles end) {
    while (next_[i] < end) interrupt(i);
  }
  /// A message has left: tx_clock starts again.
  void restart_clock(std::uint32_t i) { clock_[i] = 0; }
  /// The attempt of the last interrupt is given up at `now`: the compare register becomes `value`. A value that the timer
  /// has passed already matches one round later.
  void back_off(std::uint32_t i, Cycles now, std::uint8_t value) {
    compare_[i] = value;
    next_[i] -= until_regular(i, value) % period_[i];
    if (next_[i] <= now) next_[i] += period_[i];
  }
  /// Whether tx_clock exceeds `tx_period` at an interrupt in [from, until), if nothing is sent before.
  [[nodiscard]] bool exceeds(std::uint32_t i, std::uint16_t tx_period, Cycles from, Cycles until) const {
    std::uint16_t clock = clock_[i];
    if (until - next_[i] <= kLookAhead * shortest_period_ && clock + kMostAhead <= tx_period) return false;
    std::uint8_t compare = compare_[i];
    for (Cycles t = next_[i]; t < until; compare = kRegular) {
      clock = sum(clock, compare);
      if (t >= from && clock > tx_period) return true;
      t += until_regular(i, compare);
    }
    return false;
  }
  /// The state of robot `i` in two words.
  [[nodiscard]] std::uint64_t time_word(std::uint32_t i) const { return static_cast<std::uint64_t>(next_[i]); }
  [[nodiscard]] std::uint32_t count_word(std::uint32_t i) const {
    return std::uint32_t{clock_[i]} | std::uint32_t{compare_[i]} << 16 | std::uint32_t{count_[i]} << 24;
  }
  void restore(std::uint32_t i, std::uint64_t time_word, std::uint32_t count_word) {
    next_[i] = static_cast<Cycles>(time_word);
    clock_[i] = static_cast<std::uint16_t>(count_word);
    compare_[i] = static_cast<std::uint8_t>(count_word >> 16);
    count_[i] = static_cast<std::uint8_t>(count_word >> 24);
  }

 private:
  static std::uint16_t sum(std::uint16_t clock, std::uint8_t compare) {
    return static_cast<std::uint16_t>(clock + compare);
  }
  /// Nominal cycles from where the timer equals `compare` to where it equals 255 next.
  [[nodiscard]] Cycles until_regular(std::uint32_t i, std::uint8_t compare) const {
    return compare == kRegular ? period_[i] : period_[i] * Cycles{kRegular - compare} / kTimerCounts;
  }

  /// In so many periods of a timer come at most so many interrupts, one of them for a back-off, and so tx_clock rises by at
  /// most kMostAhead: most robots need no closer look.
  static constexpr Cycles kLookAhead = 3;
  static constexpr int kMostAhead = (kLookAhead + 2) * kRegular;

  Cycles shortest_period_ = 0;
  std::vector<Cycles> next_;
  std::vector<std::uint32_t> period_;
  std::vector<std::uint16_t> clock_;  ///< tx_clock
  std::vector<std::uint8_t> compare_;
  std::vector<std::uint8_t> count_;
};

}  // namespace kilotwin::comm
