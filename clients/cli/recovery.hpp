/// Recovery from a robot's program that crashes its behaviours host. The run continues from its last checkpoint, or from its
/// beginning, and the robot fails at the tick of the crash. The result equals that of a run in which the robot failed at that
/// tick. The recording up to the checkpoint and the external inputs for later ticks are kept.
///
/// RUN/recovered holds the start of the next attempt: the recording, and the checkpoint's parts if there is one.
#pragma once

#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "clients/recorder/run_directory.hpp"
#include "core/federation/checkpoint.hpp"
#include "core/federation/schedule.hpp"
#include "core/frames/tracker_sample.hpp"
#include "core/plan/plan.hpp"
#include "services/behaviours/running_note.hpp"

namespace kilotwin::cli {

/// Changes the run directory and the manifest to those of the next attempt, and prints a line. `running`: the robots whose programs
/// were running when the attempt ended. A single one fails in the next attempt. If there are several, the one that crashed is
/// unknown and none fails: the next attempt runs on one thread. Throws RunError if a robot that has already failed is among them.
void recover(const recorder::RunDirectory& directory, proto::Manifest& manifest,
             std::span<const behaviours::Culprit> running);

/// The start of an attempt at a run.
struct Beginning {
  std::optional<Checkpoint> resumed;  ///< absent: the attempt starts at tick 0
  std::vector<Directive> inputs;      ///< directives of an earlier attempt for later ticks, numbered from 0
  /// Of trackers, stamped in an earlier attempt for later ticks, by ascending tick.
  std::vector<std::pair<Tick, TrackerSample>> tracker_samples;
};
[[nodiscard]] Beginning beginning_of(const RunPlan& plan, const recorder::RunDirectory& directory);

/// The path of the previous attempt's recording; empty if there was no previous attempt.
[[nodiscard]] std::filesystem::path earlier_recording(const recorder::RunDirectory& directory);

/// Removes the files that only recovery needs. Call it after the end of the run.
void forget_attempts(const recorder::RunDirectory& directory);

}  // namespace kilotwin::cli
