#include "clients/behaviours/watchdog.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cstdlib>

#include "core/base/say.hpp"
#include "core/federation/interrupt.hpp"

namespace kilotwin::behaviours {
namespace {

/// How long a program may run without returning before it is named.
constexpr auto kHangs = std::chrono::milliseconds(1000);

}  // namespace

Watchdog::Watchdog(std::vector<const BehavioursEngine*> engines) : engines_(std::move(engines)) {
  thread_ = std::thread([this] { watch(); });
}

Watchdog::~Watchdog() {
  {
    const std::lock_guard lock(mutex_);
    done_ = true;
  }
  wake_.notify_one();
  thread_.join();
}

void Watchdog::watch() {
  struct Watched {
    std::optional<BehavioursEngine::Running> before;
    std::uint64_t named = 0;
  };
  std::vector<Watched> watched(engines_.size());
  std::unique_lock lock(mutex_);
  while (!wake_.wait_for(lock, kHangs, [this] { return done_; })) {
    for (std::size_t i = 0; i < engines_.size(); ++i) {
      auto& [before, named] = watched[i];
      const auto running = engines_[i]->running();
      const bool hangs = running && before && running->entry == before->entry;
      before = running;
      if (!hangs) continue;
      if (running->entry != named) {
        named = running->entry;
        say(fmt::format("the program of robot {} has not returned for over 1 s; it may loop for ever",
                        running->robot));
      }
      if (interrupted() != 0) {
        say(fmt::format("kilotwin: interrupted while the program of robot {} did not return", running->robot));
        std::_Exit(1);
      }
    }
  }
}

}  // namespace kilotwin::behaviours
