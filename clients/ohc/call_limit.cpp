#include "clients/ohc/call_limit.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <string>

#include "core/base/say.hpp"
#include "core/os/files.hpp"

namespace kilotwin::ohc {
namespace {

/// A signal that comes just before a call would be lost: it comes again.
constexpr long kAgain_ns = 50'000'000;

timespec time_of(std::chrono::milliseconds time) {
  return {static_cast<time_t>(time.count() / 1000), static_cast<long>(time.count() % 1000) * 1'000'000};
}

void say_once(const std::string& reason) {
  static std::atomic_flag said;
  if (said.test_and_set()) return;
  warn(
      fmt::format("kilotwin: no timer for the serial port ({}); if the adapter hangs, unplug it, or raise the "
                  "limit of pending signals (ulimit -i)",
                  reason));
}

}  // namespace

CallLimit::CallLimit(std::chrono::milliseconds limit) {
  struct sigaction action {};
  action.sa_handler = [](int) {};  // without SA_RESTART: the call ends
  sigaction(SIGRTMIN, &action, nullptr);
  sigevent event{};
  event.sigev_notify = SIGEV_THREAD_ID;
  event.sigev_signo = SIGRTMIN;
  event._sigev_un._tid = gettid();
  timer_t timer{};
  if (timer_create(CLOCK_MONOTONIC, &event, &timer) != 0) {
    say_once(os::system_reason());
    return;
  }
  timer_ = timer;
  const itimerspec times{{0, kAgain_ns}, time_of(limit)};
  timer_settime(timer, 0, &times, nullptr);
}

CallLimit::~CallLimit() {
  if (timer_) timer_delete(*timer_);
}

}  // namespace kilotwin::ohc
