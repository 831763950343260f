/// Reports a robot whose program does not return. The engine cannot report it, because it waits for the program.
#pragma once

#include <condition_variable>
#include <mutex>
#include <thread>
#include <vector>

#include "services/behaviours/engine.hpp"

namespace kilotwin::behaviours {

/// A thread that watches the engines of this process. It prints the robot whose program has not returned for more than 1 s. If the
/// process was interrupted meanwhile, it ends the process with status 1. After 30 s it aborts the process.
class Watchdog {
 public:
  explicit Watchdog(std::vector<const BehavioursEngine*> engines);
  ~Watchdog();
  Watchdog(const Watchdog&) = delete;

 private:
  void watch();

  const std::vector<const BehavioursEngine*> engines_;
  std::mutex mutex_;
  std::condition_variable wake_;
  bool done_ = false;
  std::thread thread_;
};

}  // namespace kilotwin::behaviours
