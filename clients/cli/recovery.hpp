/// When a robot's program has brought down its host, the run goes on from its last checkpoint, or from its beginning, with
/// that robot failed in the step in which it happened: the result is that of a run in which it failed there. What was
/// recorded up to the checkpoint, and the external inputs that had been stamped for later ticks, are kept.
///
/// RUN/recovered holds what the next attempt goes on from: the parts of the checkpoint, if there is one, and the recording.
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

/// Whether a process has ended by what its own code did, not by a signal of another process. `status` as of waitpid().
[[nodiscard]] bool brought_itself_down(int status);

/// Makes the run directory and the manifest those of the next attempt, and says so. `running`: whose programs ran when the
/// attempt ended. Where that is one robot, it fails; of several, nobody knows which it was, and none does: run them one after
/// another. Throws RunError where a program that has failed already is named.
void recover(const recorder::RunDirectory& directory, proto::Manifest& manifest,
             std::span<const behaviours::Culprit> running);

/// Where an attempt at a run starts.
struct Beginning {
  std::optional<Checkpoint> resumed;  ///< nothing: at tick 0
  std::vector<Directive> inputs;      ///< stamped in an earlier attempt, for ticks to come; numbered from 0
};
[[nodiscard]] Beginning beginning_of(const RunPlan& plan, const recorder::RunDirectory& directory);

/// The recording of the attempt before, where there was one; else empty.
[[nodiscard]] std::filesystem::path earlier_recording(const recorder::RunDirectory& directory);

/// The run has come to its end: removes what only recovery needs.
void forget_attempts(const recorder::RunDirectory& directory);

}  // namespace kilotwin::cli
