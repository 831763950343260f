/// Keeps a run from going faster than wall time allows.
#pragma once

#include <chrono>
#include <thread>

#include "core/experiment/plan.hpp"

namespace kilotwin {

class Pace {
 public:
  explicit Pace(const RunPlan& plan) : factor_(plan.manifest.pace()), tick_s_(plan.tick_length.seconds()) {}

  /// Returns when the wall time of `ticks` ticks after the first call has come; at once where the run goes as fast as it can.
  void hold(std::int64_t ticks) {
    if (factor_ <= 0) return;
    if (ticks == 0) begun_ = Clock::now();
    const std::chrono::duration<double> due(static_cast<double>(ticks) * tick_s_ / factor_);
    std::this_thread::sleep_until(begun_ + std::chrono::duration_cast<Clock::duration>(due));
  }

 private:
  using Clock = std::chrono::steady_clock;
  double factor_, tick_s_;
  Clock::time_point begun_ = Clock::now();
};

}  // namespace kilotwin
