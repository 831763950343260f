/// Robots' code runs inside this process. What faults there costs the robot, not the process.
#pragma once

#include <atomic>
#include <csignal>
#include <cstdint>
#include <vector>

#include "services/behaviours/runtime/image_abi.h"

namespace kilotwin::behaviours {

struct Fault {
  /// Besides the signals SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGTRAP and SIGSYS:
  enum Other : int {
    kNone = 0,
    kEndlessLoop = -1,
    kCallbackOverrun = -2,
    kStackLost = -3,
    kBeforeVariables = -4  ///< it has written before its first variable
  };
  int signal = kNone;
  std::uint64_t address = 0;  ///< that could not be accessed; of SIGSYS the number of the system call
  std::uint64_t code = 0;     ///< address of the instruction
};

/// What a thread and the robot that it runs have in common. %gs points to it.
struct RobotThread : KtThread {
  std::uint64_t leave = 0;    ///< where execution goes on after a fault; 0: no robot runs
  std::uint64_t divided = 0;  ///< address of the latest division by zero; 0: none
  Fault fault;
};

/// What is called, in a signal handler, before a signal that another process has sent ends this one: which robot runs at that
/// moment is chance. One for all of this process.
inline std::atomic<void (*)()> before_sent_signal{nullptr};

/// While one exists on a thread, that thread may run robots' code. Installs the handlers of the process once (handlers that
/// were there before keep every fault that is not a robot's) and gives the thread a stack for them. From then on the system
/// refuses every call that an instruction at the addresses of robots' programs makes, in this process and what it starts:
/// such an instruction faults. A system without seccomp filters does not; a program may then end the process.
class FaultGuard {
 public:
  FaultGuard();
  ~FaultGuard();
  FaultGuard(const FaultGuard&) = delete;
  FaultGuard& operator=(const FaultGuard&) = delete;

  /// Of the thread that made this guard.
  [[nodiscard]] RobotThread& thread() const { return thread_; }

 private:
  RobotThread& thread_;
  stack_t previous_{};
};

}  // namespace kilotwin::behaviours
