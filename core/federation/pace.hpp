/// Limits the speed of a run: simulated time over wall time is at most RunPlan::pace.
#pragma once

#include <algorithm>
#include <chrono>
#include <thread>

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

}  // namespace kilotwin
