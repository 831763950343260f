/// Limits the speed of a run: simulated time over wall time is at most RunPlan::pace.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <thread>

#include "core/base/error.hpp"
#include "core/os/interrupt.hpp"
#include "core/plan/plan.hpp"

namespace kilotwin {

class Pace {
 public:
  explicit Pace(const RunPlan& plan) : factor_(plan.pace), tick_s_(plan.tick_length.seconds()) {}

  /// Seconds by which `ticks` ticks in `wall_s` of wall time are ahead of the pace; 0 or less: not ahead.
  [[nodiscard]] double ahead_s(std::int64_t ticks, double wall_s) const {
    return factor_ <= 0 ? 0 : static_cast<double>(ticks) * tick_s_ / factor_ - wall_s;
  }

  /// Waits until the pace allows the end of `ticks` ticks, or the process is interrupted. `wall_s()` returns the wall time of the
  /// run so far, without pauses. Calls `idle()` about every 100 ms.
  template <class Wall, class Idle> void hold(std::int64_t ticks, Wall wall_s, Idle idle) const {
    if (factor_ <= 0) return;
    while (interrupted() == 0) {
      const double ahead = ahead_s(ticks, wall_s());
      if (ahead <= 0) return;
      std::this_thread::sleep_for(std::chrono::duration<double>(std::min(ahead, kIdle_s)));
      if (ahead > kIdle_s) idle();
    }
  }

 private:
  static constexpr double kIdle_s = 0.1;
  double factor_, tick_s_;
};

/// How far a run lags behind its pace.
struct LatenessTotals {
  std::uint64_t late_ticks = 0;  ///< that began more than kTolerance_s late
  double worst_s = 0;            ///< of a tick; 0 where none was late
};

/// Watches how late ticks begin, and ends a run that falls behind by more than it may.
class Lateness {
 public:
  /// A tick that begins so much behind its time is late, s; timers of operating systems are not more exact.
  static constexpr double kTolerance_s = 0.001;

  explicit Lateness(const RunPlan& plan) : paced_(plan.pace > 0), most_s_(plan.max_lateness_s) {}

  /// `ahead_s`: as Pace::ahead_s() says when the tick begins. Throws RunError where it is too late.
  void tick_begins(Tick tick, double ahead_s) {
    if (!paced_ || ahead_s >= -kTolerance_s) return;
    ++totals_.late_ticks;
    totals_.worst_s = std::max(totals_.worst_s, -ahead_s);
    if (most_s_ <= 0 || -ahead_s <= most_s_) return;
    throw RunError(
        fmt::format("tick {} began {:.1f} ms behind the pace, and --max-lateness allows {:g} ms; free the "
                    "machine, or allow more",
                    tick.count(), -ahead_s * 1e3, most_s_ * 1e3));
  }
  [[nodiscard]] const LatenessTotals& totals() const { return totals_; }

 private:
  bool paced_;
  double most_s_;
  LatenessTotals totals_;
};

}  // namespace kilotwin
