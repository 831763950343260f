/// Checkpoints on disk: RUN/checkpoints/TICK/ holds one file per part, each written whole. A checkpoint is complete when
/// all its parts are there.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/plan/plan.hpp"
#include "idl/checkpoint.pb.h"

namespace kilotwin {

struct Checkpoint {
  Tick tick;
  std::vector<proto::CheckpointPart> parts;
  /// H at `tick`.
  [[nodiscard]] std::uint64_t hash_chain() const;
  /// The states of one kind from all parts, for the load() of engines.
  [[nodiscard]] std::vector<const proto::PhysicsState*> physics() const;
  [[nodiscard]] std::vector<const proto::RadioState*> radio() const;
  [[nodiscard]] std::vector<const proto::StationState*> station() const;
  [[nodiscard]] std::vector<const proto::BehavioursState*> behaviours() const;
};

/// The directory of the checkpoint of a tick.
[[nodiscard]] std::filesystem::path checkpoint_directory(const std::filesystem::path& run_directory, Tick tick);

/// A hash of the experiment without the fields in which a resuming run may differ (length, division, recording).
[[nodiscard]] std::uint64_t resumable_hash(const proto::Manifest& manifest);

/// Writes `part` (its header is filled in here) of the checkpoint of `tick`, saved by federate `id` of the plan.
/// Throws RunError.
void write_checkpoint_part(const std::filesystem::path& run_directory, const RunPlan& plan, Tick tick,
                           FederateId id, proto::CheckpointPart& part);

/// Directory of the newest complete checkpoint of a run. Throws UserError where there is none.
[[nodiscard]] std::filesystem::path newest_checkpoint(const std::filesystem::path& run_directory);

/// A checkpoint's directory and the tick in its name; complete or not.
struct CheckpointDirectory {
  Tick tick;
  std::filesystem::path path;
};
/// Those of a run, the newest first.
[[nodiscard]] std::vector<CheckpointDirectory> checkpoint_directories(const std::filesystem::path& run_directory);
/// Whether all parts are there, of one and the same run.
[[nodiscard]] bool is_complete(const std::filesystem::path& checkpoint);

/// Throws UserError where it is incomplete, damaged, or of another experiment than the manifest's.
[[nodiscard]] Checkpoint read_checkpoint(const std::filesystem::path& directory, const proto::Manifest& manifest);

}  // namespace kilotwin
