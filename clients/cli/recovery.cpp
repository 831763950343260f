#include "clients/cli/recovery.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "clients/cli/run_recorder.hpp"
#include "clients/recorder/reader.hpp"
#include "clients/recorder/tracker_records.hpp"
#include "core/base/error.hpp"
#include "core/base/say.hpp"
#include "core/federation/frame_check.hpp"
#include "core/os/files.hpp"

namespace kilotwin::cli {
namespace {

namespace fs = std::filesystem;

fs::path place_of(const recorder::RunDirectory& directory) { return directory.path() / "recovered"; }

/// The last tick with a recorded state hash; -1 if there is none.
Tick last_recorded(const fs::path& recording) {
  Tick last{-1};
  try {
    recorder::Reader reader(recording);
    while (const proto::Record* record = reader.next()) {
      if (record->has_hash()) last = Tick{record->hash().first_tick() + record->hash().chain_size() - 1};
    }
  } catch (const UserError&) {
    // The attempt ended before the first record.
  }
  return last;
}

/// Removes incomplete checkpoints and those after `latest`. Returns the newest of the others, if any.
std::optional<CheckpointDirectory> newest_until(const recorder::RunDirectory& directory, Tick latest) {
  std::optional<CheckpointDirectory> found;
  std::error_code ignored;
  for (const CheckpointDirectory& checkpoint : checkpoint_directories(directory.path())) {
    if (checkpoint.tick > latest || !is_complete(checkpoint.path))
      fs::remove_all(checkpoint.path, ignored);
    else if (!found)
      found = checkpoint;
  }
  return found;
}

/// Moves checkpoint and recording to RUN/recovered. Returns a description of the start of the next attempt.
std::string keep(const recorder::RunDirectory& directory, const proto::Manifest& manifest, Tick latest,
                 TickLength tick_length) {
  const fs::path place = place_of(directory);
  const auto checkpoint = newest_until(directory, std::min(latest, last_recorded(directory.recording())));
  // A newer checkpoint replaces the one from which the last attempt started.
  if (checkpoint) {
    fs::remove_all(place);
    fs::copy(checkpoint->path, place);
  }
  fs::create_directories(place);
  if (fs::exists(directory.recording())) fs::rename(directory.recording(), place / "recording.ktrec");
  if (checkpoint) return fmt::format("its checkpoint at {:.3f} s", tick_length.seconds_at(checkpoint->tick));
  if (is_complete(place)) return "the same checkpoint";
  return manifest.resumed() ? "the checkpoint that it was resumed from" : "its beginning";
}

}  // namespace

void recover(const recorder::RunDirectory& directory, proto::Manifest& manifest,
             std::span<const behaviours::Culprit> running) {
  KILOTWIN_DEMAND(!running.empty());
  for (const proto::ProgramFailure& known : manifest.program_failure()) {
    for (const behaviours::Culprit& culprit : running) {
      if (known.robot() == culprit.robot && known.tick() <= culprit.tick.count())
        throw RunError(fmt::format("a host was lost while robot {}, which had failed, was running", known.robot()));
    }
  }
  const TickLength tick_length{manifest.experiment().tick_cycles()};
  Tick latest = running.front().tick;
  for (const behaviours::Culprit& culprit : running) latest = std::min(latest, culprit.tick);
  std::string from;
  try {
    from = keep(directory, manifest, latest, tick_length);
  } catch (const fs::filesystem_error& error) {
    throw RunError(fmt::format("{}: {}", error.path1().string(), error.code().message()));
  }
  if (running.size() == 1) {
    const behaviours::Culprit& culprit = running.front();
    say(
        fmt::format("the program of robot {} crashed its behaviours host at {:.3f} s; the run continues from {} "
                    "with that robot "
                    "failed",
                    culprit.robot, tick_length.seconds_at(culprit.tick), from));
    proto::ProgramFailure& failure = *manifest.add_program_failure();
    failure.set_robot(culprit.robot);
    failure.set_tick(culprit.tick.count());
  } else {
    say(fmt::format("one of {} programs that ran at {:.3f} s crashed the run; it continues from {} on one thread",
                    running.size(), tick_length.seconds_at(latest), from));
  }
  manifest.set_run(manifest.run() + 1 == 0 ? 1 : manifest.run() + 1);
  directory.write_manifest(manifest);
}

fs::path earlier_recording(const recorder::RunDirectory& directory) {
  fs::path recording = place_of(directory) / "recording.ktrec";
  return fs::exists(recording) ? recording : fs::path();
}

Beginning beginning_of(const RunPlan& plan, const recorder::RunDirectory& directory) {
  Beginning beginning;
  const fs::path place = place_of(directory);
  if (is_complete(place))
    beginning.resumed = read_checkpoint(place, plan.manifest());
  else if (plan.resumed)
    beginning.resumed = read_checkpoint(directory.path() / "resumed", plan.manifest());
  const fs::path recording = earlier_recording(directory);
  if (recording.empty()) return beginning;
  const Tick first = beginning.resumed ? beginning.resumed->tick : Tick{0};
  recorder::Reader reader(recording);
  while (const proto::Record* record = reader.next()) {
    if (record->has_tracker() && Tick{record->tracker().tick()} >= first)
      beginning.tracker_samples.emplace_back(Tick{record->tracker().tick()},
                                             recorder::from_record(record->tracker()));
    if (!record->has_input()) continue;
    Directive input = from_record(record->input());
    if (!changes_results(input) || input.tick < first || defect(input, plan) != nullptr) continue;
    input.sequence_number = beginning.inputs.size();
    beginning.inputs.push_back(input);
  }
  return beginning;
}

void forget_attempts(const recorder::RunDirectory& directory) {
  std::error_code ignored;
  fs::remove_all(place_of(directory), ignored);
}

}  // namespace kilotwin::cli
