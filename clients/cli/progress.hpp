/// How far a run is, on stderr: a bar where that is a terminal, else a line now and then.
#pragma once

#include <chrono>
#include <string>

#include "core/federation/run_observer.hpp"
#include "core/plan/plan.hpp"

namespace kilotwin::cli {

class ProgressBar {
 public:
  /// `shown`: false for one that stays silent.
  ProgressBar(const RunPlan& plan, bool shown);
  ~ProgressBar();
  /// Shows it where enough wall time has passed since the last time.
  void show(const RunProgress& progress);
  /// The line to show: simulated time, speed over real time, robots, messages, and for whom the run waits.
  [[nodiscard]] std::string line(const RunProgress& progress, bool bar) const;
  /// Takes the bar off the screen.
  void clear();

 private:
  const TickLength tick_length_;
  const Tick last_;
  const std::uint32_t robots_;
  Tick first_{-1};
  const bool shown_, terminal_;
  bool on_screen_ = false;
  std::chrono::steady_clock::time_point next_;
};

}  // namespace kilotwin::cli
