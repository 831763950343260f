/// When a robot's program crashes its behaviours host, the run continues from its last checkpoint, or from its beginning, with
/// that robot failed in the tick of the crash: the result is that of a run in which the robot failed there. The recording up to
/// the checkpoint, and the external inputs that were stamped for later ticks, are kept.
///
/// RUN/recovered holds the start of the next attempt: the parts of the checkpoint, if there is one, and the recording.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "clients/recorder/run_directory.hpp"
#include "core/federation/checkpoint.hpp"
#include "core/federation/schedule.hpp"
#include "core/plan/plan.hpp"
#include "services/behaviours/running_note.hpp"

namespace kilotwin::cli {

/// Turns the run directory and the manifest into those of the next attempt, and says so. `running`: the robots whose programs
/// ran when the attempt ended. If it is one robot, that robot fails. If there are several, it is not known which of them
/// crashed, and none fails: the next attempt runs them one after another. Throws RunError if a robot that has failed already
/// is among them.
void recover(const recorder::RunDirectory& directory, proto::Manifest& manifest,
             std::span<const behaviours::Culprit> running);

/// The start of an attempt at a run.
struct Beginning {
  std::optional<Checkpoint> resumed;  ///< nothing: at tick 0
  std::vector<Directive> inputs;      ///< stamped in an earlier attempt for later ticks; numbered from 0
};
[[nodiscard]] Beginning beginning_of(const RunPlan& plan, const recorder::RunDirectory& directory);

/// The recording of the previous attempt; empty if there was none.
[[nodiscard]] std::filesystem::path earlier_recording(const recorder::RunDirectory& directory);

/// Removes the files that only recovery needs, once the run has ended.
void forget_attempts(const recorder::RunDirectory& directory);

}  // namespace kilotwin::cli
