#include "clients/behaviours/faults.hpp"

#include <ucontext.h>

#include <array>
#include <atomic>
#include <mutex>

#include "core/base/error.hpp"

namespace kilotwin::behaviours {
namespace {

constexpr std::array<int, 4> kSignals{SIGSEGV, SIGBUS, SIGFPE, SIGILL};
std::array<struct sigaction, kSignals.size()> previous_actions;

struct Watch {
  std::uint64_t leave = 0;  // 0: no robot runs
  Fault fault;
};
thread_local Watch watch;

constexpr std::size_t kHandlerStackOctets = 64 * 1024;
thread_local std::vector<std::uint8_t> handler_stack;

void handle(int signal, siginfo_t* info, void* context) {
  if (watch.leave == 0) {
    // Not a robot's: as it was before, the instruction faults again and goes to whoever was here first.
    for (std::size_t i = 0; i < kSignals.size(); ++i) {
      if (kSignals[i] == signal) sigaction(signal, &previous_actions[i], nullptr);
    }
    return;
  }
  auto& registers = static_cast<ucontext_t*>(context)->uc_mcontext.gregs;
  watch.fault = {signal, reinterpret_cast<std::uint64_t>(info->si_addr),
                 static_cast<std::uint64_t>(registers[REG_RIP])};
  constexpr greg_t kDirectionFlag = 0x400;
  registers[REG_EFL] &= ~kDirectionFlag;
  registers[REG_RIP] = static_cast<greg_t>(watch.leave);
  watch.leave = 0;
}

void install_handlers() {
  for (std::size_t i = 0; i < kSignals.size(); ++i) {
    struct sigaction action {};
    action.sa_sigaction = handle;
    action.sa_flags = SA_SIGINFO | SA_ONSTACK;
    KILOTWIN_DEMAND(sigaction(kSignals[i], &action, &previous_actions[i]) == 0);
  }
}

}  // namespace

FaultGuard::FaultGuard() {
  static std::once_flag once;
  std::call_once(once, install_handlers);
  handler_stack.resize(kHandlerStackOctets);
  stack_t stack{};
  stack.ss_sp = handler_stack.data();
  stack.ss_size = handler_stack.size();
  KILOTWIN_DEMAND(sigaltstack(&stack, &previous_) == 0);
}

FaultGuard::~FaultGuard() {
  if (previous_.ss_flags & SS_DISABLE) previous_.ss_size = kHandlerStackOctets;
  sigaltstack(&previous_, nullptr);
}

void FaultGuard::begin(std::uint64_t leave) {
  watch.fault.signal = 0;
  watch.leave = leave;
  std::atomic_signal_fence(std::memory_order_seq_cst);
}

Fault FaultGuard::end() {
  std::atomic_signal_fence(std::memory_order_seq_cst);
  watch.leave = 0;
  return watch.fault;
}

}  // namespace kilotwin::behaviours
