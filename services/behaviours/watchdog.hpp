/// Says which robot's program does not return: an engine cannot, as it waits for it.
#pragma once

#include <condition_variable>
#include <mutex>
#include <thread>
#include <vector>

#include "services/behaviours/engine.hpp"

namespace kilotwin::behaviours {

/// Watches engines of this process from a thread of its own. Names a robot whose program has not returned for over 1 s. Where
/// the process has been interrupted meanwhile, ends it with status 1, since nobody else can; after 30 s, aborts it.
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
