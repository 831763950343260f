#include "clients/cli/progress.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

#include "core/base/say.hpp"

namespace kilotwin::cli {
namespace {
constexpr int kBarWidth = 24;
constexpr auto kBarPeriod = std::chrono::milliseconds(200);
constexpr auto kLinePeriod = std::chrono::seconds(5);
}  // namespace

ProgressBar::ProgressBar(const RunPlan& plan, bool shown)
    : tick_length_(plan.tick_length),
      last_(plan.last_tick),
      robots_(plan.robots()),
      shown_(shown),
      terminal_(isatty(STDERR_FILENO) == 1),
      next_(std::chrono::steady_clock::now() +
            (terminal_ ? std::chrono::milliseconds(0) : std::chrono::milliseconds(kLinePeriod))) {}

ProgressBar::~ProgressBar() { clear(); }

std::string ProgressBar::line(const RunProgress& progress, bool bar) const {
  const double simulated_s = tick_length_.seconds_at(progress.now);
  const double end_s = tick_length_.seconds_at(last_);
  std::string text;
  if (bar) {
    const double part = end_s > 0 ? std::clamp(simulated_s / end_s, 0.0, 1.0) : 1.0;
    const int filled = static_cast<int>(part * kBarWidth);
    text = fmt::format("[{}{}] ", std::string(static_cast<std::size_t>(filled), '#'),
                       std::string(static_cast<std::size_t>(kBarWidth - filled), '.'));
  }
  text += fmt::format("{:.1f} of {:.1f} s", simulated_s, end_s);
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
  const auto now = std::chrono::steady_clock::now();
  if (!shown_ || now < next_) return;
  next_ = now + (terminal_ ? std::chrono::milliseconds(kBarPeriod) : std::chrono::milliseconds(kLinePeriod));
  if (terminal_) {
    std::fputs(("\r\x1b[K" + line(progress, true)).c_str(), stderr);
    on_screen_ = true;
  } else {
    say(line(progress, false));
  }
}

void ProgressBar::clear() {
  if (on_screen_) std::fputs("\r\x1b[K", stderr);
  on_screen_ = false;
}

}  // namespace kilotwin::cli
