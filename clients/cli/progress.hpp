/// How far work is, on stderr: on a terminal one line that is kept up to date, else a line now and then.
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>

#include "core/federation/run_observer.hpp"
#include "core/plan/plan.hpp"

namespace kilotwin::cli {

/// Shows the share done, the time since the start, and what is being done. All functions may be called from any thread.
class Progress {
 public:
  /// `shown`: false for one that stays silent.
  explicit Progress(bool shown);
  /// Takes the line off the screen.
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// The share done, 0..1, and what is done now; shown when enough time has passed. Work in parts that last names them: a
  /// new part is shown at once, and the time goes on while it lasts.
  void show(double share, const std::string& what, const std::string& part = {});
  /// Whether show() would show anything: a caller for whom the text is costly asks first.
  [[nodiscard]] bool due();
  /// Takes the line off the screen until the next show().
  void clear();
  /// "[######........]  43 %  1:07  what"
  [[nodiscard]] static std::string line(double share, double seconds, const std::string& what, bool bar);

 private:
  using Clock = std::chrono::steady_clock;
  void watch();
  void print();
  [[nodiscard]] bool time_for_another() const { return Clock::now() >= next_; }

  const bool shown_, terminal_;
  const Clock::time_point start_;
  std::mutex mutex_;
  std::condition_variable changed_;
  double share_ = 0;
  std::string what_, part_;
  Clock::time_point next_;
  bool on_screen_ = false, ends_ = false;
  std::thread watcher_;  ///< keeps the time going while a part lasts
};

/// The progress of a run: simulated time, speed over real time, robots, messages, and for whom the run waits.
class ProgressBar {
 public:
  ProgressBar(const RunPlan& plan, bool shown);
  void show(const RunProgress& progress);
  void clear() { progress_.clear(); }
  [[nodiscard]] std::string text(const RunProgress& progress) const;

 private:
  const TickLength tick_length_;
  const Tick last_;
  const std::uint32_t robots_;
  Tick first_{-1};
  Progress progress_;
};

}  // namespace kilotwin::cli
