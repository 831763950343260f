/// Snapshots: checkpoints for recovery. If a robot's program crashes its host, the run continues from the last one.
#pragma once

#include <chrono>
#include <deque>
#include <filesystem>

#include "core/base/time.hpp"

namespace kilotwin {

/// Schedules one snapshot per minute of wall time and keeps the last two. A run that reaches its end keeps none.
class Snapshots {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr auto kPeriod = std::chrono::seconds(60);

  /// `wanted`: false if the run saves checkpoints anyway, or must not write any.
  Snapshots(std::filesystem::path run_directory, bool wanted)
      : run_directory_(std::move(run_directory)), wanted_(wanted) {}

  /// Whether a snapshot is due. The first call starts the first minute.
  [[nodiscard]] bool due(Clock::time_point now);
  /// Registers the snapshot of `tick` and removes all but the last two.
  void taken(Tick tick);
  /// Removes all snapshots, at the end of the run.
  void remove_all();

 private:
  std::filesystem::path run_directory_;
  bool wanted_;
  Clock::time_point next_{};
  std::deque<Tick> taken_;
};

}  // namespace kilotwin
