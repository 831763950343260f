#include "services/behaviours/faults.hpp"

#include <asm/prctl.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <ucontext.h>
#include <unistd.h>

#include <array>
#include <cstddef>
#include <mutex>

#include "core/base/error.hpp"
#include "services/behaviours/division.hpp"
#include "services/behaviours/image.hpp"

namespace kilotwin::behaviours {
namespace {

constexpr std::array<int, 7> kSignals{SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGTRAP, SIGSYS, SIGABRT};
std::array<struct sigaction, kSignals.size()> previous_actions;

thread_local RobotThread robot_thread{};

constexpr std::size_t kHandlerStackOctets = 64 * 1024;
thread_local std::vector<std::uint8_t> handler_stack;

/// Restores the earlier handler and returns: the instruction then faults again, or the signal is raised again.
void pass_on(int signal, bool was_sent) {
  for (std::size_t i = 0; i < kSignals.size(); ++i) {
    if (kSignals[i] == signal) sigaction(signal, &previous_actions[i], nullptr);
  }
  if (was_sent) raise(signal);  // arrives when the handler has returned
}

void handle(int signal, siginfo_t* info, void* context) {
  RobotThread& thread = robot_thread;
  const bool was_sent = info->si_code <= 0;  // a process sent it; the kernel's faults have positive codes
  if (was_sent && info->si_pid != getpid()) {
    if (auto* const before = before_sent_signal.load()) before();
  }
  if (was_sent || thread.leave == 0) return pass_on(signal, was_sent);
  ucontext_t& interrupted = *static_cast<ucontext_t*>(context);
  auto& registers = interrupted.uc_mcontext.gregs;
  const auto code = static_cast<std::uint64_t>(registers[REG_RIP]);
  if (signal == SIGFPE && info->si_code == FPE_INTDIV && divide_as_robot(registers)) {
    thread.divided = code;
    return;
  }
  thread.fault = {signal, reinterpret_cast<std::uint64_t>(info->si_addr), code};
  // For SIGSYS and SIGTRAP the saved address is that of the next instruction.
  if (signal == SIGSYS) thread.fault = {signal, static_cast<std::uint32_t>(info->si_syscall), code - 1};
  if (signal == SIGTRAP) thread.fault = {signal, 0, code - 1};
  thread.fault.stack = static_cast<std::uint64_t>(registers[REG_RSP]);
  // Restore the processor state of the host: no single-stepping, ascending string operations, no alignment checks, rounding to
  // nearest, floating-point exceptions masked.
  constexpr greg_t kTrapFlag = 0x100, kDirectionFlag = 0x400, kAlignmentCheck = 0x40000;
  registers[REG_EFL] &= ~(kTrapFlag | kDirectionFlag | kAlignmentCheck);
  interrupted.uc_mcontext.fpregs->mxcsr = 0x1f80;
  interrupted.uc_mcontext.fpregs->cwd = 0x37f;
  interrupted.uc_mcontext.fpregs->ftw = 0;
  registers[REG_RIP] = static_cast<greg_t>(thread.leave);
  thread.leave = 0;
}

/// Points %gs of this thread to its RobotThread. Nothing else uses that register on x86-64 Linux.
RobotThread& own_thread() {
  thread_local const bool set = [] {
    return syscall(SYS_arch_prctl, ARCH_SET_GS, static_cast<KtThread*>(&robot_thread)) == 0;
  }();
  KILOTWIN_DEMAND(set);
  return robot_thread;
}

/// Installs the seccomp filter that turns system calls from robots' addresses into SIGSYS.
void refuse_system_calls() {
  constexpr std::uint32_t kLow = offsetof(seccomp_data, instruction_pointer), kHigh = kLow + 4;
  std::array<sock_filter, 7> filter{
      {BPF_STMT(BPF_LD | BPF_W | BPF_ABS, kHigh), BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, 0, 0, 3),
       BPF_STMT(BPF_LD | BPF_W | BPF_ABS, kLow), BPF_JUMP(BPF_JMP | BPF_JGE | BPF_K, kFirstAddress, 0, 1),
       BPF_JUMP(BPF_JMP | BPF_JGE | BPF_K, kLastAddress, 0, 1), BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
       BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_TRAP)}};
  const sock_fprog program{filter.size(), filter.data()};
  // Without SPEC_ALLOW, kernels before 5.16 switch on speculation mitigations for a filtered process, which slow it down.
  if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0) {
    syscall(SYS_seccomp, SECCOMP_SET_MODE_FILTER, SECCOMP_FILTER_FLAG_TSYNC | SECCOMP_FILTER_FLAG_SPEC_ALLOW,
            &program);
  }
}

void install_handlers() {
  for (std::size_t i = 0; i < kSignals.size(); ++i) {
    struct sigaction action {};
    action.sa_sigaction = handle;
    action.sa_flags = SA_SIGINFO | SA_ONSTACK;
    KILOTWIN_DEMAND(sigaction(kSignals[i], &action, &previous_actions[i]) == 0);
  }
  refuse_system_calls();
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
