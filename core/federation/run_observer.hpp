/// What a run reports while it goes, and its totals: the interface between the federation and what
/// records, shows or summarises it.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/base/time.hpp"
#include "core/federation/schedule.hpp"
#include "core/frames/radio_counts.hpp"
#include "core/frames/swarm_view.hpp"

namespace kilotwin {

/// How far a run is.
struct RunProgress {
  Tick now;
  double wall_s = 0;                     ///< since the first tick, pauses excluded
  std::uint64_t sent = 0, received = 0;  ///< messages since the start
  std::uint32_t robots_failed = 0;
  bool paused = false;
  std::string waiting_for;  ///< one line; empty: for nobody
};

/// Called on one thread, with ascending ticks for each function.
class RunObserver {
 public:
  virtual ~RunObserver() = default;
  /// The whole swarm at a tick. `last`: the run ends here.
  virtual void state(Tick, const SwarmView&, bool last) = 0;
  /// H(tick).
  virtual void hash(Tick, std::uint64_t chain) = 0;
  /// A stamped input was announced.
  virtual void input(const Directive&) = 0;
  /// A checkpoint comes to be complete: what was recorded up to its tick must not be lost with this process.
  virtual void saved() {}
  /// Called a few times a second, also while the run pauses or waits.
  virtual void idle(const RunProgress& progress) { static_cast<void>(progress); }
};

/// Where the time of a run goes.
enum class Work : std::uint8_t { kBehaviours, kPhysics, kRadio, kStation, kExchange, kRecording, kCount };

/// What a run adds up to.
struct RunTotals {
  Tick first, last;  ///< last: where it ended, which may be before the experiment's end
  std::uint64_t state_hash = 0;
  double wall_s = 0;           ///< from the first to the last tick, pauses excluded
  double cpu_s = 0;            ///< of all processes
  double peak_memory_mib = 0;  ///< of all processes together
  std::uint64_t attempted = 0, sent = 0, received = 0, collided = 0;
  std::uint32_t robots_failed = 0;
  std::array<std::uint64_t, static_cast<std::size_t>(Work::kCount)> work_ns{};
  std::vector<PairCount> pairs;    ///< where the recording wants messages
  std::vector<RadioCount> radios;  ///< per robot; empty where the run broke before the radio reported
  bool stopped_early = false;      ///< by a directive
  std::string failure;             ///< one line, where the run broke
};

}  // namespace kilotwin
