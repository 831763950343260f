#include "services/behaviours/watchdog.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cstdlib>
#include <optional>
#include <string>
#include <string_view>

#include "core/base/say.hpp"
#include "core/os/files.hpp"
#include "core/os/interrupt.hpp"

namespace kilotwin::behaviours {
namespace {

constexpr auto kPeriod = std::chrono::milliseconds(1000);
/// Periods after which a call is reported, and after which the process is aborted. The cycle counters return control within
/// milliseconds, unless a program leaves the counted code, e.g. by a jump into the middle of an instruction.
constexpr int kReportAfter = 2, kAbortAfter = 30;

/// Whether a debugger holds this process: then a program that does not return may just have been stopped.
bool traced() {
  const std::optional<std::string> status = os::read_if_there("/proc/self/status");
  constexpr std::string_view kTracer = "TracerPid:\t";
  const std::size_t at = status ? status->find(kTracer) : std::string::npos;
  return at != std::string::npos && status->substr(at + kTracer.size(), 2) != "0\n";
}

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
    std::uint64_t entry = 0;
    int periods = 0;  // in which the same call was running
  };
  std::vector<Watched> watched(engines_.size());
  std::unique_lock lock(mutex_);
  while (!wake_.wait_for(lock, kPeriod, [this] { return done_; })) {
    for (std::size_t i = 0; i < engines_.size(); ++i) {
      const BehavioursEngine::Running& running = engines_[i]->running();
      const std::uint64_t entry = running.entry.load(std::memory_order_acquire);
      const std::uint32_t robot = running.robot.load(std::memory_order_relaxed);
      auto& [before, periods] = watched[i];
      periods = robot != BehavioursEngine::kNobody && entry == before ? periods + 1 : 0;
      before = entry;
      if (periods >= kReportAfter && traced()) periods = 0;
      if (periods < kReportAfter) continue;
      if (periods == kReportAfter) say(fmt::format("the program of robot {} has not returned for over 1 s", robot));
      if (interrupted() != 0) {
        say_error(fmt::format("kilotwin: interrupted while the program of robot {} did not return", robot));
        std::_Exit(1);
      }
      if (periods == kAbortAfter) {
        say_error(fmt::format("kilotwin: the program of robot {} does not return", robot));
        std::abort();
      }
    }
  }
}

}  // namespace kilotwin::behaviours
