/// Faults of robots' code, which runs inside this process. A fault ends the robot, not the process.
#pragma once

#include <atomic>
#include <csignal>
#include <cstdint>
#include <vector>

#include "services/behaviours/runtime/image_abi.h"

namespace kilotwin::behaviours {

struct Fault {
  /// Values of `signal` besides SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGTRAP and SIGSYS.
  enum Other : int {
    kNone = 0,
    kEndlessLoop = -1,
    kCallbackOverrun = -2,
    kStackLost = -3,
    kBeforeVariables = -4  ///< the program wrote before its first variable
  };
  int signal = kNone;
  std::uint64_t address = 0;  ///< the inaccessible address; for SIGSYS the number of the system call
  std::uint64_t code = 0;     ///< address of the faulting instruction
  std::uint64_t stack = 0;    ///< stack pointer at that instruction; 0: unknown
};

/// Data that a thread shares with the robot's code that it runs. %gs points to it.
struct RobotThread : KtThread {
  std::uint64_t leave = 0;    ///< address where execution continues after a fault; 0: no robot runs
  std::uint64_t divided = 0;  ///< address of the latest division by zero; 0: none
  Fault fault;
};

/// Called in the signal handler before a signal from another process ends this one. The robot that runs at that moment is not the
/// cause. One per process.
inline std::atomic<void (*)()> before_sent_signal{nullptr};

/// A thread may run robots' code while it has a FaultGuard. The first guard installs the process's signal handlers; faults outside
/// robots' code go to the handlers that were installed earlier. Each guard gives its thread an alternate signal stack.
/// The first guard also installs a seccomp filter, which child processes inherit: a system call by an instruction at an address
/// of robots' programs faults. Without seccomp filters in the kernel, a program's system call can end the process.
class FaultGuard {
 public:
  FaultGuard();
  ~FaultGuard();
  FaultGuard(const FaultGuard&) = delete;
  FaultGuard& operator=(const FaultGuard&) = delete;

  /// The data of the thread that made this guard.
  [[nodiscard]] RobotThread& thread() const { return thread_; }

 private:
  RobotThread& thread_;
  stack_t previous_{};
};

}  // namespace kilotwin::behaviours
