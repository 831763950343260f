/// How far work is that takes a while, on stderr: the share done, what is being done, and for how long: on a terminal one line that
/// is kept up to date, else a line for each part, and one now and then while a part goes on.
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>

namespace kilotwin::cli {

class WorkProgress {
 public:
  /// `shown`: false for one that stays silent.
  explicit WorkProgress(bool shown);
  /// Takes the line off the screen.
  ~WorkProgress();
  WorkProgress(const WorkProgress&) = delete;
  WorkProgress& operator=(const WorkProgress&) = delete;

  /// The share done, 0..1, and what is done now.
  void show(double share, const std::string& what);
  /// "[######........]  43 %  1:07  what"
  [[nodiscard]] static std::string line(double share, double seconds, const std::string& what);

 private:
  using Clock = std::chrono::steady_clock;
  void watch();
  void print(bool again);

  const bool shown_, terminal_;
  const Clock::time_point start_;
  std::mutex mutex_;
  std::condition_variable changed_;
  double share_ = 0;
  std::string what_;
  Clock::time_point printed_;
  bool ends_ = false;
  std::thread watcher_;  ///< keeps the time going
};

}  // namespace kilotwin::cli
