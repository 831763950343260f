#include "clients/cli/progress.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "core/base/say.hpp"

namespace kilotwin::cli {
namespace {
constexpr int kBarWidth = 24;
constexpr std::size_t kLongest = 100;
constexpr auto kBarPeriod = std::chrono::milliseconds(200), kLinePeriod = std::chrono::milliseconds(5000);
}  // namespace

Progress::Progress(bool shown)
    : shown_(shown),
      terminal_(isatty(STDERR_FILENO) == 1),
      start_(Clock::now()),
      next_(start_ + (terminal_ ? std::chrono::milliseconds(0) : kLinePeriod)) {}

Progress::~Progress() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
  }
  changed_.notify_all();
  if (watcher_.joinable()) watcher_.join();
  clear();
}

std::string Progress::line(double share, double seconds, const std::string& what, bool bar) {
  const double part = std::clamp(share, 0.0, 1.0);
  const int filled = static_cast<int>(part * kBarWidth), whole = static_cast<int>(seconds);
  return fmt::format("{}{:3.0f} %  {}:{:02}  {}",
                     bar ? fmt::format("[{:#>{}}{:.>{}}] ", "", filled, "", kBarWidth - filled) : "",
                     std::floor(100 * part), whole / 60, whole % 60, what.substr(0, kLongest));
}

double Progress::seconds() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }

bool Progress::due() {
  if (!shown_) return false;
  const std::lock_guard lock(mutex_);
  return time_for_another();
}

void Progress::show(double share, const std::string& what, const std::string& part) {
  change(share, what, part, {});
}

void Progress::follow(std::function<Shown(double)> now, const std::string& part) {
  change(0, part, part, std::move(now));
}

void Progress::change(double share, const std::string& what, const std::string& part,
                      std::function<Shown(double)> now) {
  if (!shown_) return;
  const std::lock_guard lock(mutex_);
  if (!part.empty() && !watcher_.joinable()) watcher_ = std::thread([this] { watch(); });
  // The caller may revise its estimate of the work, but the displayed fraction must not decrease.
  share_ = std::max(share_, share);
  const bool another_part = part != part_;
  what_ = what;
  part_ = part;
  now_ = std::move(now);
  if (another_part || time_for_another()) print();
}

void Progress::clear() {
  const std::lock_guard lock(mutex_);
  if (on_screen_) std::fputs("\r\x1b[K", stderr);
  on_screen_ = false;
}

void Progress::watch() {
  std::unique_lock lock(mutex_);
  while (!changed_.wait_for(lock, terminal_ ? std::chrono::milliseconds(1000) : kLinePeriod,
                            [this] { return ends_; })) {
    if (!what_.empty() && (!terminal_ || on_screen_) && time_for_another()) print();
  }
}

void Progress::print() {
  const auto now = Clock::now();
  next_ = now + (terminal_ ? kBarPeriod : kLinePeriod);
  if (now_) {
    const Shown shown = now_(seconds());
    share_ = std::max(share_, shown.share);
    what_ = shown.what;
  }
  const std::string text = line(share_, seconds(), what_, terminal_);
  if (terminal_) {
    std::fputs(("\r\x1b[K" + text).c_str(), stderr);
    on_screen_ = true;
  } else {
    say(text);
  }
}

void WorkProgress::begin(const stats::Work& work) {
  if (work.kind != stats::Work::kSame) time_left_.begin(progress_.seconds(), work);
  const std::string part = work.activity.empty() ? work.stage : work.stage + ": " + work.activity;
  progress_.follow(
      [time = time_left_, part](double seconds) {
        return Progress::Shown{time.share(seconds), stats::in_words(time.at(seconds)) + "; " + part};
      },
      part);
}

ProgressBar::ProgressBar(const RunPlan& plan, bool shown)
    : tick_length_(plan.tick_length), last_(plan.last_tick), robots_(plan.robots()), progress_(shown) {}

std::string ProgressBar::text(const RunProgress& progress) const {
  const double simulated_s = tick_length_.seconds_at(progress.now);
  std::string text = fmt::format("{:.1f} of {:.1f} s", simulated_s, tick_length_.seconds_at(last_));
  const double stepped_s = simulated_s - tick_length_.seconds_at(std::max(first_, Tick{0}));
  if (progress.wall_s > 0) text += fmt::format(", {:.1f} x real time", stepped_s / progress.wall_s);
  text += fmt::format(", {} robots, {} messages sent, {} received", robots_, progress.sent, progress.received);
  if (progress.robots_failed > 0) text += fmt::format(", {} robots failed", progress.robots_failed);
  if (progress.paused) text += ", paused";
  if (!progress.waiting_for.empty()) text += ", waits for " + progress.waiting_for;
  return text;
}

void ProgressBar::show(const RunProgress& progress) {
  if (first_ < Tick{0}) first_ = progress.now;
  if (!progress_.due()) return;
  const double end_s = tick_length_.seconds_at(last_);
  progress_.show(end_s > 0 ? tick_length_.seconds_at(progress.now) / end_s : 1, text(progress));
}

}  // namespace kilotwin::cli
