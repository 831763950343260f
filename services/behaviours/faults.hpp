/// Robots' code runs inside this process. What faults there costs the robot, not the process.
#pragma once

#include <csignal>
#include <cstdint>
#include <vector>

#include "services/behaviours/runtime/image_abi.h"

namespace kilotwin::behaviours {

struct Fault {
  /// Besides the signals SIGSEGV, SIGBUS, SIGFPE and SIGILL:
  enum Other : int { kNone = 0, kEndlessLoop = -1, kCallbackOverrun = -2, kStackLost = -3 };
  int signal = kNone;
  std::uint64_t address = 0;  ///< that could not be accessed
  std::uint64_t code = 0;     ///< address of the instruction
};

/// What a thread and the robot that it runs have in common. %gs points to it.
struct RobotThread : KtThread {
  std::uint64_t leave = 0;    ///< where execution goes on after a fault; 0: no robot runs
  std::uint64_t divided = 0;  ///< address of the latest division by zero; 0: none
  Fault fault;
};

/// While one exists on a thread, that thread may run robots' code. Installs the handlers of the process once (handlers that
/// were there before keep every fault that is not a robot's) and gives the thread a stack for them.
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
