#include "clients/cli/replay_command.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>
#include <optional>

#include "clients/cli/commands.hpp"
#include "clients/cli/prepare.hpp"
#include "clients/cli/progress.hpp"
#include "clients/cli/run_recorder.hpp"
#include "clients/local/local_run.hpp"
#include "clients/recorder/reader.hpp"
#include "clients/recorder/tracker_records.hpp"
#include "core/base/error.hpp"
#include "core/federation/frame_check.hpp"
#include "core/os/interrupt.hpp"
#include "services/behaviours/program_set.hpp"

namespace kilotwin::cli {
namespace {

/// The content of a recording besides its states.
struct Recorded {
  Tick first_hash;
  std::vector<std::uint64_t> chain;  ///< state hashes H of first_hash, first_hash + 1...
  std::vector<Directive> inputs;
  std::optional<proto::EndRecord> end;  ///< absent if the run was killed or is still active
  [[nodiscard]] Tick last() const { return first_hash + static_cast<std::int64_t>(chain.size()) - 1; }
};

Recorded read_recorded(recorder::Reader& reader) {
  Recorded recorded;
  while (const proto::Record* record = reader.next()) {
    if (record->has_hash()) {
      const Tick first{record->hash().first_tick()};
      if (recorded.chain.empty()) recorded.first_hash = first;
      if (!recorded.chain.empty() && first != recorded.last() + 1) {
        throw RunError(
            fmt::format("{}: after the state hash of tick {} follows that of tick {}; hashes are missing",
                        reader.path().string(), recorded.last().count(), first.count()));
      }
      recorded.chain.insert(recorded.chain.end(), record->hash().chain().begin(), record->hash().chain().end());
    }
    if (record->has_input()) recorded.inputs.push_back(from_record(record->input()));
    if (record->has_end()) recorded.end = record->end();
  }
  if (reader.damaged()) throw RunError(reader.warning());
  if (recorded.chain.empty()) {
    throw UserError(fmt::format("{}: no state hashes in it; there is nothing to verify", reader.path().string()));
  }
  return recorded;
}

/// Throws RunError if the recording is shorter than the run. Returns a note if the run may have been longer than the recording.
std::string check_length(const Recorded& recorded, const recorder::RunDirectory& directory,
                         const recorder::Reader& reader) {
  const std::string file = reader.path().string();
  const std::int64_t last = recorded.last().count();
  if (recorded.end) {
    const bool whole = recorded.end->tick() == last && recorded.end->state_hash() == recorded.chain.back();
    if (!whole && recorded.end->failure().empty()) {
      throw RunError(
          fmt::format("{}: its end mark is of tick {}, hash {:016x}; its last state hash is of tick {}, {:016x}",
                      file, recorded.end->tick(), recorded.end->state_hash(), last, recorded.chain.back()));
    }
  }
  if (!std::filesystem::exists(directory.summary())) {
    if (recorded.end) return {};
    return reader.warning().empty() ? "; the recording has no end mark, so the run was killed or still goes on"
                                    : "; the run was killed while it wrote the next record";
  }
  if (!recorded.end) {
    const std::string where = reader.warning().empty() ? "" : "; " + reader.warning();
    throw RunError(
        fmt::format("{}: it ends at tick {} without an end mark, but summary.json says that the run ended "
                    "at tick {}{}",
                    file, last, recorder::read_summary(directory.summary()).ticks, where));
  }
  const recorder::Summary summary = recorder::read_summary(directory.summary());
  if (summary.ticks != std::max<std::int64_t>(0, recorded.end->tick()) ||
      summary.state_hash != recorded.end->state_hash()) {
    throw RunError(
        fmt::format("{}: it ends at tick {} with hash {:016x}, but summary.json says tick {} and {:016x}", file,
                    recorded.end->tick(), recorded.end->state_hash(), summary.ticks, summary.state_hash));
  }
  return {};
}

class Verifier : public RunObserver {
 public:
  Verifier(const RunPlan& plan, const Recorded& recorded, const std::filesystem::path& recording,
           ProgressBar& progress)
      : recorded_(recorded),
        progress_(progress),
        reader_(recording),
        schedule_(plan.tick_length, reader_.header().every_s()),
        state_(plan),
        next_(reader_.next_state()) {}

  void state(Tick tick, const SwarmView& swarm, bool) override {
    if (monitor_ != nullptr) monitor_->state(swarm);
    const bool due = schedule_.due(tick) || states_ == 0;
    if (next_ == nullptr || tick < Tick{next_->tick()}) {
      const bool ended = recorded_.end && recorded_.end->failure().empty();
      if (due && (next_ != nullptr || ended))
        throw RunError(fmt::format("tick {}: the recording holds no state of it", tick.count()));
      return;
    }
    if (tick > Tick{next_->tick()})
      throw RunError(fmt::format("tick {}: the recording holds a state of it, the run has none", next_->tick()));
    if (const std::string difference = first_difference(state_.of(swarm), *next_); !difference.empty())
      throw RunError(fmt::format("tick {}: {}", tick.count(), difference));
    ++states_;
    next_ = reader_.next_state();
  }
  void input(const Directive&) override {}
  void tracker_sample(Tick, const TrackerSample& sample) override {
    if (monitor_ != nullptr) monitor_->tracker_sample(sample);
  }
  void observed(const proto::Observations& observations) override {
    if (monitor_ != nullptr) monitor_->observed(observations);
  }
  void watch_with(RunMonitor& monitor) { monitor_ = &monitor; }
  void idle(const RunProgress& now) override { progress_.show(now); }
  void hash(Tick tick, std::uint64_t chain) override {
    const std::int64_t index = tick - recorded_.first_hash;
    if (index < 0 || index >= static_cast<std::int64_t>(recorded_.chain.size())) return;
    const std::uint64_t expected = recorded_.chain[static_cast<std::size_t>(index)];
    if (chain != expected) {
      throw RunError(fmt::format(
          "tick {}: the state hash is {:016x}, recorded was {:016x}; this is the first tick that differs",
          tick.count(), chain, expected));
    }
    ++hashes_;
  }
  [[nodiscard]] std::size_t hashes() const { return hashes_; }
  [[nodiscard]] std::size_t states() const { return states_; }
  /// Whether some recorded states have not been compared.
  [[nodiscard]] bool states_remain() const { return next_ != nullptr; }

 private:
  const Recorded& recorded_;
  ProgressBar& progress_;
  recorder::Reader reader_;
  recorder::RecordingSchedule schedule_;
  RecordedState state_;
  const proto::StateRecord* next_;
  std::size_t hashes_ = 0, states_ = 0;
  RunMonitor* monitor_ = nullptr;
};

/// The recorded samples of trackers, tick by tick: one pass through the recording.
class RecordedSamples {
 public:
  explicit RecordedSamples(const std::filesystem::path& recording) : reader_(recording) { advance(); }

  std::vector<TrackerSample> of(Tick tick) {
    std::vector<TrackerSample> samples;
    for (; next_ != nullptr && Tick{next_->tick()} <= tick; advance())
      samples.push_back(recorder::from_record(*next_));
    return samples;
  }

 private:
  void advance() {
    const proto::Record* record = reader_.next();
    while (record != nullptr && !record->has_tracker()) record = reader_.next();
    next_ = record != nullptr ? &record->tracker() : nullptr;
  }

  recorder::Reader reader_;
  const proto::TrackerRecord* next_ = nullptr;
};

/// The recorded inputs that a replay repeats, and a stop at the end of the recording.
std::vector<Directive> inputs_of_replay(const Recorded& recorded) {
  std::vector<Directive> inputs = recorded.inputs;
  std::erase_if(inputs, [](const Directive& input) { return !changes_results(input); });
  Directive stop;
  stop.kind = DirectiveKind::kStop;
  stop.tick = recorded.last();
  inputs.push_back(stop);
  std::stable_sort(inputs.begin(), inputs.end(),
                   [](const Directive& a, const Directive& b) { return a.tick < b.tick; });
  for (std::size_t i = 0; i < inputs.size(); ++i) inputs[i].sequence_number = i;
  return inputs;
}

}  // namespace

std::string monitored_text(const RunMonitor& watching) {
  const std::size_t count = watching.alarms().size();
  return fmt::format("monitor: {}\n", count == 0   ? "no alarm"
                                      : count == 1 ? "1 alarm"
                                                   : fmt::format("{} alarms", count));
}

int replay_command(const std::filesystem::path& run, const std::string& partitions, bool quiet,
                   const MonitorOptions& monitor) {
  const auto directory = recorder::RunDirectory::open(run, recorder::RunDirectory::Needs::kManifest);
  recorder::Reader reader(directory.recording());
  const Recorded recorded = read_recorded(reader);
  proto::Manifest manifest = read_manifest(directory);
  if (!partitions.empty()) {
    const auto [columns, rows] = parse_partitions(partitions);
    manifest.mutable_experiment()->mutable_deployment()->set_partition_columns(columns);
    manifest.mutable_experiment()->mutable_deployment()->set_partition_rows(rows);
  }
  const RunPlan plan(std::move(manifest));
  if (reader.header().robots() != plan.robots() || reader.header().tick_cycles() != plan.tick_length.cycles() ||
      reader.header().movable_size() != static_cast<int>(plan.movables())) {
    throw RunError(
        fmt::format("{}: of another experiment than {}", reader.path().string(), directory.manifest().string()));
  }
  const std::string remark = check_length(recorded, directory, reader);
  for (const Directive& input : recorded.inputs) {
    if (const char* const wrong = defect(input, plan); wrong != nullptr) {
      throw UserError(fmt::format("{}: input {} does not fit this run: {}", reader.path().string(),
                                  input.sequence_number, wrong));
    }
  }

  local::LocalOptions options;
  if (plan.resumed) options.resumed = read_checkpoint(directory.path() / "resumed", plan.manifest());
  options.inputs = inputs_of_replay(recorded);
  const auto samples = std::make_shared<RecordedSamples>(directory.recording());
  options.tracker_samples = [samples](Tick tick) { return samples->of(tick); };
  options.save_checkpoints = false;
  options.run_directory = directory.path();

  catch_interrupts();
  const auto programs = behaviours::ProgramSet::load(plan, directory.path());
  ProgressBar progress(plan, !quiet);
  Verifier verifier(plan, recorded, directory.recording(), progress);
  std::optional<RunMonitor> watching;
  if (monitor.on) verifier.watch_with(watching.emplace(plan, monitor, directory.path() / "alarms-replayed.csv"));
  const RunTotals totals = local::run(plan, programs, options, verifier);
  progress.clear();
  if (!totals.failure.empty()) throw RunError(totals.failure);
  if (verifier.hashes() != recorded.chain.size())
    throw RunError(fmt::format("{} of {} recorded ticks were reached", verifier.hashes(), recorded.chain.size()));
  // The hashes of a federated run that was killed may lag behind its states.
  if (verifier.states_remain() && recorded.end && recorded.end->failure().empty())
    throw RunError(fmt::format("{}: it holds states after its last tick", directory.recording().string()));
  if (!quiet && watching) fmt::print("{}", monitored_text(*watching));
  if (!quiet) {
    fmt::print(
        "verified: {} ticks, up to tick {} at {:g} s; every state hash ({:016x} at the end) and {} recorded "
        "states agree{}\n",
        verifier.hashes(), recorded.last().count(), plan.tick_length.seconds_at(recorded.last()), totals.state_hash,
        verifier.states(), remark);
  }
  return 0;
}

Command add_replay(CLI::App& program) {
  struct Arguments {
    std::filesystem::path run;
    std::string partitions;
    bool verify = false, quiet = false;
    MonitorOptions monitor;
  };
  const auto arguments = std::make_shared<Arguments>();
  CLI::App& app = *program.add_subcommand("replay", "step a recorded run again and compare it with the recording");
  app.add_option("RUN", arguments->run, "run directory")->required()->type_name("");
  app.add_flag("--verify", arguments->verify, "compare every state hash and every recorded state");
  add_monitor_options(app, arguments->monitor);
  app.add_option("--partitions", arguments->partitions,
                 "columns and rows of physics partitions, such as 2x1 (default: as recorded)")
      ->type_name("CxR");
  app.add_flag("--quiet", arguments->quiet, "no progress and no result on the screen");
  return {&app, [arguments] {
            if (!arguments->verify && !arguments->monitor.on)
              throw UserError("replay: nothing to do; give --verify, --monitor or both");
            return replay_command(arguments->run, arguments->partitions, arguments->quiet, arguments->monitor);
          }};
}

}  // namespace kilotwin::cli
