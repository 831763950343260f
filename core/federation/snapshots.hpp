/// Snapshots: checkpoints for recovery. If a robot's program ends its host, the run continues from one.
#pragma once

#include <chrono>
#include <deque>
#include <filesystem>

#include "core/base/time.hpp"

namespace kilotwin {

/// One per minute of wall time; the last two are kept. A run that comes to its end leaves none.
class Snapshots {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr auto kPeriod = std::chrono::seconds(60);

  /// `wanted`: false if the run saves checkpoints anyway, or must not write any.
  Snapshots(std::filesystem::path run_directory, bool wanted)
      : run_directory_(std::move(run_directory)), wanted_(wanted) {}

  /// Whether one is due. Minutes are counted from the first call.
  [[nodiscard]] bool due(Clock::time_point now);
  /// A snapshot was taken at `tick`. Removes all but the last two.
  void taken(Tick tick);
  /// The run has come to its end.
  void remove_all();

 private:
  std::filesystem::path run_directory_;
  bool wanted_;
  Clock::time_point next_{};
  std::deque<Tick> taken_;
};

}  // namespace kilotwin
