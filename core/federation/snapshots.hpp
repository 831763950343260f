/// Checkpoints that a run takes by itself: from them it continues when a robot's program has brought down its host.
#pragma once

#include <chrono>
#include <deque>
#include <filesystem>

#include "core/base/time.hpp"

namespace kilotwin {

/// One for each minute that a run takes, of which the last two are kept. A run that comes to its end leaves none.
class Snapshots {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr auto kPeriod = std::chrono::seconds(60);

  /// `wanted`: false where the run has checkpoints of its own, or is not to write any.
  Snapshots(std::filesystem::path run_directory, bool wanted)
      : run_directory_(std::move(run_directory)), wanted_(wanted) {}

  /// Whether one is due. Minutes are counted from the first call.
  [[nodiscard]] bool due(Clock::time_point now);
  /// One is taken at `tick`; removes the one before the one before.
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
