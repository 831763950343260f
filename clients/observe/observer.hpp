/// Observer: joins a domain and looks at its runs. It can neither slow a run nor change it. States are best effort: what
/// the observer misses is lost to it alone. The description of the run is one sample that its writer keeps anyway.
///
///   Observer observer({domain, {}});
///   while (...) {
///     switch (observer.wait(100ms)) {
///       case News::kRunBegan: ... observer.run() ...
///       case News::kState: ... observer.state() ...
///       case News::kRunEnded: ...
///       case News::kNothing: ...
///     }
///   }
///
/// An observer outlives the runs on its domain: after the end of one it waits for the next. All calls come from one thread.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "core/dds/dds.hpp"
#include "core/federation/topics.hpp"
#include "core/frames/swarm_view.hpp"

namespace kilotwin {
namespace proto {
class Experiment;
}

namespace observe {

/// Facts that stay the same during a run.
struct RunFacts {
  std::uint64_t run = 0;
  std::string name;
  std::uint64_t seed = 0;
  double tick_s = 0;
  std::int64_t last_tick = 0;
  std::uint32_t robots = 0, movables = 0;
  std::shared_ptr<const proto::Experiment> experiment;  ///< as run: arena, bodies, groups, trackers
};

/// The swarm at one tick.
struct SwarmAt {
  SwarmAt(std::uint32_t robots, std::uint32_t movables) : swarm(robots, movables, 0) {}

  SwarmView swarm;    ///< tick, poses, LEDs, life cycles, motors, movable bodies; its other columns are not set
  double time_s = 0;  ///< simulated
  std::int64_t wall_ns = 0;  ///< when this was the state, by the clock of the station's machine: UTC, since 1970
};

enum class News : std::uint8_t { kNothing, kRunBegan, kState, kRunEnded };

class Observer {
 public:
  explicit Observer(const dds::Transport& transport);
  Observer(const Observer&) = delete;
  ~Observer();

  /// Waits for something new, `patience` at most. A run begins before its states come, and ends after its last one. Of several
  /// states that came meanwhile, the newest counts. A wait of more than a second without a run says so on stderr, once per wait.
  [[nodiscard]] News wait(std::chrono::milliseconds patience);

  /// The run at hand; nullptr between runs. Valid until the next call of wait().
  [[nodiscard]] const RunFacts* run() const { return run_ ? &*run_ : nullptr; }
  /// Its newest state; nullptr before the first. Valid until the next call of wait().
  [[nodiscard]] const SwarmAt* state() const { return state_.get(); }
  /// The state before that; nullptr before the second.
  [[nodiscard]] const SwarmAt* earlier_state() const { return earlier_.get(); }

 private:
  void on_description(const PublicRunDescription& sample, dds::SampleState state);
  void on_state(const PublicSwarmState& sample);
  [[nodiscard]] std::optional<News> take_news();  // with the mutex held, like the next
  News take_state();
  void say_that_none_is_there();

  const dds::Transport transport_;

  // Shared with the receive threads.
  std::mutex mutex_;
  std::condition_variable arrived_;
  std::optional<RunFacts> begun_;       // a run that the caller does not know yet
  std::optional<std::uint64_t> ended_;  // a run that has ended
  std::unique_ptr<SwarmAt> newest_;     // a state that the caller does not know yet
  std::unique_ptr<SwarmAt> spare_;      // memory for the next state
  std::optional<RunFacts> current_;     // whose states are taken

  // The caller's own.
  std::optional<RunFacts> run_;
  std::unique_ptr<SwarmAt> state_, earlier_;
  std::chrono::steady_clock::time_point waiting_since_;
  bool said_ = false;

  dds::Participant participant_;
  std::unique_ptr<dds::Reader<PublicRunDescription>> descriptions_;
  std::unique_ptr<dds::Reader<PublicSwarmState>> states_;
};

}  // namespace observe
}  // namespace kilotwin
