/// Checkpoints on disk. RUN/checkpoints/TICK/ holds one file per federate, each written atomically. A checkpoint is complete when
/// all files exist.
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
  /// The chained state hash H at `tick`.
  [[nodiscard]] std::uint64_t hash_chain() const;
  /// The states of one kind from all parts, for the load() of engines.
  [[nodiscard]] std::vector<const proto::PhysicsState*> physics() const;
  [[nodiscard]] std::vector<const proto::RadioState*> radio() const;
  [[nodiscard]] std::vector<const proto::StationState*> station() const;
  [[nodiscard]] std::vector<const proto::BehavioursState*> behaviours() const;
};

/// The directory of the checkpoint of a tick.
[[nodiscard]] std::filesystem::path checkpoint_directory(const std::filesystem::path& run_directory, Tick tick);

/// A hash of the experiment without the fields in which a resumed run may differ: duration, partitions, hosts, recording.
[[nodiscard]] std::uint64_t resumable_hash(const proto::Manifest& manifest);

/// Fills in the header of `part`, the state of federate `id` at `tick`, and writes it. Throws RunError.
void write_checkpoint_part(const std::filesystem::path& run_directory, const RunPlan& plan, Tick tick,
                           FederateId id, proto::CheckpointPart& part);

/// Directory of the newest complete checkpoint of a run. Throws UserError if there is none.
[[nodiscard]] std::filesystem::path newest_checkpoint(const std::filesystem::path& run_directory);

/// A checkpoint's directory and the tick in its name; complete or not.
struct CheckpointDirectory {
  Tick tick;
  std::filesystem::path path;
};
/// The checkpoint directories of a run, the newest first.
[[nodiscard]] std::vector<CheckpointDirectory> checkpoint_directories(const std::filesystem::path& run_directory);
/// Whether all parts exist and come from the same run.
[[nodiscard]] bool is_complete(const std::filesystem::path& checkpoint);

/// Reads a checkpoint. Throws UserError if it is incomplete, damaged, or from another experiment than the manifest's.
[[nodiscard]] Checkpoint read_checkpoint(const std::filesystem::path& directory, const proto::Manifest& manifest);

}  // namespace kilotwin
