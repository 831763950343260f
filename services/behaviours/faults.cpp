#include "services/behaviours/faults.hpp"

#include <asm/prctl.h>
#include <sys/syscall.h>
#include <ucontext.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <mutex>

#include "services/behaviours/division.hpp"
#include "core/base/error.hpp"

namespace kilotwin::behaviours {
namespace {

constexpr std::array<int, 4> kSignals{SIGSEGV, SIGBUS, SIGFPE, SIGILL};
std::array<struct sigaction, kSignals.size()> previous_actions;

thread_local RobotThread robot_thread{};

constexpr std::size_t kHandlerStackOctets = 64 * 1024;
thread_local std::vector<std::uint8_t> handler_stack;

void handle(int signal, siginfo_t* info, void* context) {
  RobotThread& thread = robot_thread;
  if (thread.leave == 0) {
    // Not a robot's: as it was before, the instruction faults again and goes to whoever was here first.
    for (std::size_t i = 0; i < kSignals.size(); ++i) {
      if (kSignals[i] == signal) sigaction(signal, &previous_actions[i], nullptr);
    }
    return;
  }
  ucontext_t& interrupted = *static_cast<ucontext_t*>(context);
  auto& registers = interrupted.uc_mcontext.gregs;
  const auto code = static_cast<std::uint64_t>(registers[REG_RIP]);
  if (signal == SIGFPE && info->si_code == FPE_INTDIV && divide_as_robot(registers)) {
    thread.divided = code;
    return;
  }
  thread.fault = {signal, reinterpret_cast<std::uint64_t>(info->si_addr), code};
  // As the host has them: upwards in strings, rounding to nearest, no exceptions of floating-point arithmetic.
  constexpr greg_t kDirectionFlag = 0x400;
  registers[REG_EFL] &= ~kDirectionFlag;
  interrupted.uc_mcontext.fpregs->mxcsr = 0x1f80;
  interrupted.uc_mcontext.fpregs->cwd = 0x37f;
  interrupted.uc_mcontext.fpregs->ftw = 0;
  registers[REG_RIP] = static_cast<greg_t>(thread.leave);
  thread.leave = 0;
}

/// Lets %gs of this thread point to what it has in common with robots; nothing else uses that register on Linux.
RobotThread& own_thread() {
  thread_local const bool set = [] {
    return syscall(SYS_arch_prctl, ARCH_SET_GS, static_cast<KtThread*>(&robot_thread)) == 0;
  }();
  KILOTWIN_DEMAND(set);
  return robot_thread;
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

FaultGuard::FaultGuard() : thread_(own_thread()) {
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

}  // namespace kilotwin::behaviours
