#include "clients/cli/work_progress.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace kilotwin::cli {
namespace {
constexpr int kBarWidth = 24;
constexpr std::size_t kLongest = 70;
constexpr auto kRefresh = std::chrono::seconds(1), kLinePeriod = std::chrono::seconds(15);
}  // namespace

WorkProgress::WorkProgress(bool shown)
    : shown_(shown), terminal_(isatty(STDERR_FILENO) == 1), start_(Clock::now()), printed_(start_) {
  if (shown_) watcher_ = std::thread([this] { watch(); });
}

WorkProgress::~WorkProgress() {
  if (!shown_) return;
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
  }
  changed_.notify_all();
  watcher_.join();
  if (terminal_) std::fputs("\r\x1b[K", stderr);
}

std::string WorkProgress::line(double share, double seconds, const std::string& what) {
  const double part = std::clamp(share, 0.0, 1.0);
  const int filled = static_cast<int>(part * kBarWidth), whole = static_cast<int>(seconds);
  return fmt::format("[{}{}] {:3.0f} %  {}:{:02}  {}", std::string(static_cast<std::size_t>(filled), '#'),
                     std::string(static_cast<std::size_t>(kBarWidth - filled), '.'), std::floor(100 * part),
                     whole / 60, whole % 60, what.substr(0, kLongest));
}

void WorkProgress::show(double share, const std::string& what) {
  if (!shown_) return;
  const std::lock_guard lock(mutex_);
  const bool same = what == what_;
  // Estimates of what is left to do may be revised; what was shown as done stays done.
  share_ = std::max(share_, share);
  what_ = what;
  if (terminal_ || !same) print(false);
}

void WorkProgress::watch() {
  std::unique_lock lock(mutex_);
  while (!changed_.wait_for(lock, kRefresh, [this] { return ends_; })) {
    if (!what_.empty() && (terminal_ || Clock::now() - printed_ >= kLinePeriod)) print(true);
  }
}

void WorkProgress::print(bool again) {
  printed_ = Clock::now();
  const double seconds = std::chrono::duration<double>(printed_ - start_).count();
  if (terminal_) {
    std::fputs(("\r\x1b[K" + line(share_, seconds, what_)).c_str(), stderr);
  } else {
    fmt::print(stderr, "{:3.0f} %  {}:{:02}  {}{}\n", std::floor(100 * std::clamp(share_, 0.0, 1.0)),
               static_cast<int>(seconds) / 60, static_cast<int>(seconds) % 60, again ? "still " : "", what_);
  }
}

}  // namespace kilotwin::cli
