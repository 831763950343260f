/// Scenes of runs: of a live run from an observer's states, of a recorded run at any time.
#pragma once

#include <filesystem>
#include <optional>

#include "clients/cameras/renderer.hpp"
#include "clients/observe/observer.hpp"
#include "clients/recorder/timed_states.hpp"

namespace kilotwin::cameras {

/// The scene of a live run. `earlier`, if given, is the state before: motion is taken from the difference.
[[nodiscard]] Scene scene_of(const observe::SwarmAt& now, const observe::SwarmAt* earlier);

/// The recorded states of a run, in order of time; between two states as recorder::TimedStates interpolates.
class RecordedScenes {
 public:
  /// Throws UserError where the recording has no state.
  explicit RecordedScenes(const std::filesystem::path& recording) : states_(recording) {}

  [[nodiscard]] double first_s() const { return states_.first_s(); }
  /// The scene at a time, which must not be less than that of the call before; nothing after the last state.
  [[nodiscard]] std::optional<Scene> at(double time_s);
  /// The tick of the last recorded state at or before that time.
  [[nodiscard]] std::int64_t tick() const { return states_.tick(); }

 private:
  recorder::TimedStates states_;
};

}  // namespace kilotwin::cameras
