/// The robots' oscillators, and the counters of the firmware's timer interrupt.
///
/// Timer 0 counts 0..255 cyclically, 1024 cycles of the robot's own clock per count. It interrupts when it equals the compare
/// register. The register normally holds 255, so an interrupt comes every 256 counts. After an aborted attempt it holds a
/// random value once, which inserts one interrupt between two regular ones. Each interrupt is one kilo_tick and adds the
/// compare value to the 16-bit tx_clock. tx_clock runs from the reset on in any state; only a sent message sets it to 0.
/// So robots that have been on for a while have arbitrary values, and most send as soon as they are set to RUN. With `model:
/// PROPAGATION` robots start so; otherwise all are reset at tick 0.
#pragma once

#include <cstdint>
#include <vector>

#include "core/plan/plan.hpp"
#include "services/comm/air.hpp"

namespace kilotwin::comm {

class TickTimers {
 public:
  static constexpr std::uint8_t kRegular = 255;

  /// Draws rates and phases from the plan's seed, and adds measured rates of the model. A robot's first interrupt comes within
  /// its first period.
  explicit TickTimers(const RunPlan&);

  /// Time of the robot's next interrupt.
  [[nodiscard]] Cycles next(std::uint32_t i) const { return next_[i]; }
  /// Value of tx_clock at the next interrupt.
  [[nodiscard]] std::uint16_t next_clock(std::uint32_t i) const { return sum(clock_[i], compare_[i]); }
  /// Nominal cycles between two regular interrupts.
  [[nodiscard]] Cycles period(std::uint32_t i) const { return period_[i]; }
  /// kilo_ticks since begin_tick().
  [[nodiscard]] const std::vector<std::uint8_t>& counts() const { return count_; }

  void begin_tick() { count_.assign(count_.size(), 0); }
  /// Processes the next interrupt.
  void interrupt(std::uint32_t i) {
    count_[i] = static_cast<std::uint8_t>(count_[i] + (count_[i] != 255));
    clock_[i] = next_clock(i);
    next_[i] += until_regular(i, compare_[i]);
    compare_[i] = kRegular;
  }
  /// Processes all interrupts before `end`.
  void pass(std::uint32_t i, Cycles end) {
    while (next_[i] < end) interrupt(i);
  }
  /// Sets tx_clock to 0 after a message was sent.
  void restart_clock(std::uint32_t i) { clock_[i] = 0; }
  /// Gives up the attempt of the last interrupt at `now`, and sets the compare register to `value`. If the timer has already
  /// passed that value, it matches one period later.
  void back_off(std::uint32_t i, Cycles now, std::uint8_t value) {
    compare_[i] = value;
    next_[i] -= until_regular(i, value) % period_[i];
    if (next_[i] <= now) next_[i] += period_[i];
  }
  /// Whether tx_clock exceeds `tx_period` at an interrupt in [from, until), if the robot sends nothing before.
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
  /// State of robot `i` in two words.
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
  /// Nominal cycles from the match of `compare` to the next match of 255.
  [[nodiscard]] Cycles until_regular(std::uint32_t i, std::uint8_t compare) const {
    return compare == kRegular ? period_[i] : period_[i] * Cycles{kRegular - compare} / kTimerCounts;
  }

  /// Within kLookAhead periods tx_clock rises by at most kMostAhead, with one extra interrupt for a back-off. Most robots need no
  /// closer look.
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
