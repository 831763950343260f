/// Keeps a run from going faster than wall time allows.
#pragma once

#include <chrono>
#include <thread>

#include "core/experiment/plan.hpp"

namespace kilotwin {

class Pace {
 public:
  explicit Pace(const RunPlan& plan) : factor_(plan.manifest.pace()), tick_s_(plan.tick_length.seconds()) {}

  /// Returns when `ticks` ticks may have passed; `wall_s`: how long the run has taken for them so far, pauses excluded.
  void hold(std::int64_t ticks, double wall_s) const {
    if (factor_ <= 0) return;
    const double ahead_s = static_cast<double>(ticks) * tick_s_ / factor_ - wall_s;
    if (ahead_s > 0) std::this_thread::sleep_for(std::chrono::duration<double>(ahead_s));
  }

 private:
  double factor_, tick_s_;
};

}  // namespace kilotwin
