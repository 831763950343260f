#include "core/federation/checkpoint.hpp"

#include <fmt/format.h>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>

#include <algorithm>
#include <charconv>
#include <system_error>

#include "core/base/error.hpp"
#include "core/base/state_hash.hpp"
#include "core/os/checksummed_file.hpp"
#include "idl/manifest.pb.h"

namespace kilotwin {
namespace {

namespace fs = std::filesystem;

constexpr std::uint32_t kFormat = 3;
constexpr FileKind kPartFile{"KTWNCHKP", kFormat, "a part of a checkpoint", "resume from another checkpoint"};

std::string deterministic_bytes(const google::protobuf::Message& message) {
  std::string bytes;
  {
    google::protobuf::io::StringOutputStream stream(&bytes);
    google::protobuf::io::CodedOutputStream coded(&stream);
    coded.SetSerializationDeterministic(true);
    message.SerializeToCodedStream(&coded);
  }
  return bytes;
}

template <class State>
std::vector<const State*> pick(const Checkpoint& checkpoint, bool (proto::CheckpointPart::*has)() const,
                               const State& (proto::CheckpointPart::*get)() const) {
  std::vector<const State*> result;
  for (const proto::CheckpointPart& part : checkpoint.parts) {
    if ((part.*has)()) result.push_back(&(part.*get)());
  }
  return result;
}

std::vector<fs::path> part_files(const fs::path& directory) {
  std::vector<fs::path> files;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(directory, ignored)) {
    if (entry.path().extension() == ".part") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

proto::CheckpointPart read_part(const fs::path& file) {
  proto::CheckpointPart part;
  if (!part.ParseFromString(read_checksummed(file, kPartFile)) || part.header().format() != kFormat) {
    throw UserError(
        fmt::format("{}: is not {} that this program wrote; {}", file.string(), kPartFile.name, kPartFile.remedy));
  }
  return part;
}

}  // namespace

std::uint64_t Checkpoint::hash_chain() const {
  for (const proto::StationState* state : station()) return state->hash_chain();
  return 0;
}

std::vector<const proto::PhysicsState*> Checkpoint::physics() const {
  return pick(*this, &proto::CheckpointPart::has_physics, &proto::CheckpointPart::physics);
}
std::vector<const proto::RadioState*> Checkpoint::radio() const {
  return pick(*this, &proto::CheckpointPart::has_radio, &proto::CheckpointPart::radio);
}
std::vector<const proto::StationState*> Checkpoint::station() const {
  return pick(*this, &proto::CheckpointPart::has_station, &proto::CheckpointPart::station);
}
std::vector<const proto::BehavioursState*> Checkpoint::behaviours() const {
  return pick(*this, &proto::CheckpointPart::has_behaviours, &proto::CheckpointPart::behaviours);
}

fs::path checkpoint_directory(const fs::path& run_directory, Tick tick) {
  return run_directory / "checkpoints" / fmt::format("{:010}", tick.count());
}

std::uint64_t resumable_hash(const proto::Manifest& manifest) {
  proto::Manifest core;
  *core.mutable_experiment() = manifest.experiment();
  core.mutable_experiment()->clear_name();
  core.mutable_experiment()->clear_duration_s();
  core.mutable_experiment()->clear_recording();
  core.mutable_experiment()->clear_deployment();
  for (proto::RobotGroup& group : *core.mutable_experiment()->mutable_robots()) group.clear_behaviour();
  *core.mutable_program() = manifest.program();
  for (proto::Program& program : *core.mutable_program()) program.clear_path();
  *core.mutable_group_program() = manifest.group_program();
  return hash_bytes(deterministic_bytes(core));
}

void write_checkpoint_part(const fs::path& run_directory, const RunPlan& plan, Tick tick, FederateId id,
                           proto::CheckpointPart& part) {
  proto::CheckpointHeader& header = *part.mutable_header();
  header.set_format(kFormat);
  header.set_run(plan.run());
  header.set_tick(tick.count());
  header.set_federate(plan.name(id));
  header.set_parts(plan.federates());
  header.set_experiment_hash(resumable_hash(plan.manifest()));

  const fs::path directory = checkpoint_directory(run_directory, tick);
  std::error_code ignored;
  fs::create_directories(directory, ignored);
  write_checksummed(directory / fmt::format("{:04}.part", id.value()), kPartFile, part.SerializeAsString());
}

std::vector<CheckpointDirectory> checkpoint_directories(const fs::path& run_directory) {
  std::vector<CheckpointDirectory> found;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(run_directory / "checkpoints", ignored)) {
    const std::string name = entry.path().filename().string();
    std::int64_t tick = 0;
    const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), tick);
    if (entry.is_directory() && error == std::errc() && end == name.data() + name.size())
      found.push_back({Tick{tick}, entry.path()});
  }
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.tick > b.tick; });
  return found;
}

bool is_complete(const fs::path& checkpoint) {
  const std::vector<fs::path> files = part_files(checkpoint);
  if (files.empty()) return false;
  const proto::CheckpointHeader first = read_part(files.front()).header();
  return first.parts() == files.size() && std::all_of(files.begin() + 1, files.end(), [&](const fs::path& file) {
           return read_part(file).header().run() == first.run();
         });
}

fs::path newest_checkpoint(const fs::path& run_directory) {
  for (const auto& [tick, directory] : checkpoint_directories(run_directory)) {
    if (is_complete(directory)) return directory;
  }
  throw UserError(
      fmt::format("{}: no complete checkpoint; run with --checkpoint-every S to get some", run_directory.string()));
}

Checkpoint read_checkpoint(const fs::path& directory, const proto::Manifest& manifest) {
  Checkpoint checkpoint;
  for (const fs::path& file : part_files(directory)) {
    proto::CheckpointPart part = read_part(file);
    const proto::CheckpointHeader& header = part.header();
    if (checkpoint.parts.empty()) checkpoint.tick = Tick{header.tick()};
    if (header.tick() != checkpoint.tick.count()) {
      throw UserError(fmt::format("{}: saved at tick {}, the other parts at {}", file.string(), header.tick(),
                                  checkpoint.tick.count()));
    }
    if (!checkpoint.parts.empty() && header.run() != checkpoint.parts.front().header().run()) {
      throw UserError(fmt::format("{}: saved by another run than the other parts; resume from another checkpoint",
                                  file.string()));
    }
    if (header.experiment_hash() != resumable_hash(manifest)) {
      throw UserError(fmt::format(
          "{}: saved by another experiment; only length, division, recording and checkpoints may differ",
          file.string()));
    }
    checkpoint.parts.push_back(std::move(part));
  }
  if (checkpoint.parts.empty() || checkpoint.parts.size() != checkpoint.parts.front().header().parts()) {
    throw UserError(fmt::format("{}: the checkpoint is incomplete; resume from another one", directory.string()));
  }
  return checkpoint;
}

}  // namespace kilotwin
