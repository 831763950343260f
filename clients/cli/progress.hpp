/// Progress display on stderr: on a terminal one line that is updated, else a line at intervals.
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

#include "core/federation/run_observer.hpp"
#include "core/plan/plan.hpp"
#include "core/stats/time_left.hpp"

namespace kilotwin::cli {

/// Shows the completed fraction, the time since the start, and the current activity. All functions may be called from any thread.
class Progress {
 public:
  /// `shown`: false disables the display.
  explicit Progress(bool shown);
  /// Removes the line from the screen.
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Sets the completed fraction, 0..1, and the current activity. The display changes if enough time has passed since the last
  /// change. `part` names a long part of the work: the display changes immediately when the part changes, and its time advances
  /// while the part lasts.
  void show(double share, const std::string& what, const std::string& part = {});
  /// The same for a display that changes while the part lasts: `now` gives its share and text after so many seconds since the start. It
  /// is called by any thread, under the lock of this object.
  struct Shown {
    double share;
    std::string what;
  };
  void follow(std::function<Shown(double seconds)> now, const std::string& part);
  /// Since the start.
  [[nodiscard]] double seconds() const;
  /// Whether show() would change the display. Call it first if the text is costly.
  [[nodiscard]] bool due();
  /// Removes the line from the screen until the next show().
  void clear();
  /// "[######........]  43 %  1:07  what"
  [[nodiscard]] static std::string line(double share, double seconds, const std::string& what, bool bar);

 private:
  using Clock = std::chrono::steady_clock;
  void change(double share, const std::string& what, const std::string& part, std::function<Shown(double)> now);
  void watch();
  void print();
  [[nodiscard]] bool time_for_another() const { return Clock::now() >= next_; }

  const bool shown_, terminal_;
  const Clock::time_point start_;
  std::mutex mutex_;
  std::condition_variable changed_;
  double share_ = 0;
  std::string what_, part_;
  std::function<Shown(double)> now_;  ///< empty: share_ and what_
  Clock::time_point next_;
  bool on_screen_ = false, ends_ = false;
  std::thread watcher_;  ///< updates the time while a part lasts
};

/// Progress of work that is reported by units: its stage, its activity, and the time that it still takes.
class WorkProgress {
 public:
  explicit WorkProgress(bool shown) : progress_(shown) {}
  void begin(const stats::Work&);

 private:
  stats::TimeLeft time_left_;
  Progress progress_;
};

/// Progress of a run: simulated time, speed relative to real time, robots, messages, and the federates for which the run waits.
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
