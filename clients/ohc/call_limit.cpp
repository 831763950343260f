#include "clients/ohc/call_limit.hpp"

#include <unistd.h>

#include <csignal>

#include "core/base/error.hpp"
#include "core/os/files.hpp"

namespace kilotwin::ohc {
namespace {

/// A signal that comes just before a call would be lost: it comes again.
constexpr long kAgain_ns = 50'000'000;

timespec time_of(std::chrono::milliseconds time) {
  return {static_cast<time_t>(time.count() / 1000), static_cast<long>(time.count() % 1000) * 1'000'000};
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
  if (timer_create(CLOCK_MONOTONIC, &event, &timer_) != 0)
    throw RunError("no timer for the serial port: " + os::system_reason());
  const itimerspec times{{0, kAgain_ns}, time_of(limit)};
  timer_settime(timer_, 0, &times, nullptr);
}

CallLimit::~CallLimit() { timer_delete(timer_); }

}  // namespace kilotwin::ohc
