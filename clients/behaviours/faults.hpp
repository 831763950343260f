/// Robots' code runs inside this process. What faults there costs the robot, not the process.
#pragma once

#include <csignal>
#include <cstdint>
#include <vector>

namespace kilotwin::behaviours {

struct Fault {
  int signal = 0;             ///< SIGSEGV, SIGBUS, SIGFPE or SIGILL; 0: none
  std::uint64_t address = 0;  ///< that could not be accessed
  std::uint64_t code = 0;     ///< address of the instruction
};

/// While one exists on a thread, that thread may run robots' code. Installs the handlers of the process once (handlers that
/// were there before keep every fault that is not a robot's) and gives the thread a stack for them.
class FaultGuard {
 public:
  FaultGuard();
  ~FaultGuard();
  FaultGuard(const FaultGuard&) = delete;
  FaultGuard& operator=(const FaultGuard&) = delete;

  /// From here on a fault of this thread is a robot's: it is noted, and execution goes on at `leave`.
  static void begin(std::uint64_t leave);
  /// Ends that; what happened in between.
  [[nodiscard]] static Fault end();

 private:
  stack_t previous_{};
};

}  // namespace kilotwin::behaviours
