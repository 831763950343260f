#include "core/os/interrupt.hpp"

#include <csignal>

namespace kilotwin {
namespace {
volatile std::sig_atomic_t received_signal = 0;
}  // namespace

void catch_interrupts() {
  struct sigaction action {};
  action.sa_handler = [](int signal) { received_signal = signal; };
  sigemptyset(&action.sa_mask);
  sigaction(SIGTERM, &action, nullptr);
  action.sa_flags = static_cast<int>(SA_RESETHAND);  // a second Ctrl-C ends the process, whatever it does
  sigaction(SIGINT, &action, nullptr);
}

int interrupted() { return received_signal; }

}  // namespace kilotwin
