#include "clients/cli/replay_command.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>

#include "clients/cli/commands.hpp"
#include "clients/cli/prepare.hpp"
#include "clients/cli/progress.hpp"
#include "clients/cli/run_recorder.hpp"
#include "clients/local/local_run.hpp"
#include "clients/recorder/reader.hpp"
#include "core/base/error.hpp"
#include "core/base/say.hpp"
#include "core/federation/frame_check.hpp"
#include "core/os/interrupt.hpp"
#include "services/behaviours/program_set.hpp"

namespace kilotwin::cli {
namespace {

/// What a recording says of a run that another one must repeat.
struct Recorded {
  Tick first_hash;
  std::vector<std::uint64_t> chain;  // H of first_hash, first_hash + 1...
  std::vector<Directive> inputs;
};

Recorded read_recorded(recorder::Reader& reader) {
  Recorded recorded;
  while (const proto::Record* record = reader.next()) {
    if (record->has_hash()) {
      if (recorded.chain.empty()) recorded.first_hash = Tick{record->hash().first_tick()};
      recorded.chain.insert(recorded.chain.end(), record->hash().chain().begin(), record->hash().chain().end());
    }
    if (record->has_input()) recorded.inputs.push_back(from_record(record->input()));
  }
  if (!reader.warning().empty()) say("kilotwin: " + reader.warning());
  if (recorded.chain.empty())
    throw UserError(fmt::format("{}: no state hashes in it; there is nothing to verify", reader.path().string()));
  return recorded;
}

class Verifier : public RunObserver {
 public:
  Verifier(const Recorded& recorded, ProgressBar& progress) : recorded_(recorded), progress_(progress) {}
  void state(Tick, std::span<const BodyFrame* const>, std::span<const ActuationFrame* const>, bool) override {}
  void input(const Directive&) override {}
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
    ++verified_;
  }
  [[nodiscard]] std::size_t verified() const { return verified_; }

 private:
  const Recorded& recorded_;
  ProgressBar& progress_;
  std::size_t verified_ = 0;
};

}  // namespace

int replay_command(const std::filesystem::path& run, bool quiet) {
  const auto directory = recorder::RunDirectory::open(run, recorder::RunDirectory::Needs::kManifest);
  recorder::Reader reader(directory.recording());
  Recorded recorded = read_recorded(reader);
  const RunPlan plan(read_manifest(directory));
  for (const Directive& input : recorded.inputs) {
    if (const char* const wrong = defect(input, plan); wrong != nullptr) {
      throw UserError(fmt::format("{}: input {} is none of this run: {}", reader.path().string(),
                                  input.sequence_number, wrong));
    }
  }

  local::LocalOptions options;
  if (plan.manifest.resumed()) options.resumed = read_checkpoint(directory.path() / "resumed", plan.manifest);
  // The run ends where the recording does.
  std::erase_if(recorded.inputs, [](const Directive& input) { return !changes_results(input); });
  Directive stop;
  stop.kind = DirectiveKind::kStop;
  stop.tick = recorded.first_hash + static_cast<std::int64_t>(recorded.chain.size()) - 1;
  options.inputs = recorded.inputs;
  options.inputs.push_back(stop);
  std::stable_sort(options.inputs.begin(), options.inputs.end(),
                   [](const Directive& a, const Directive& b) { return a.tick < b.tick; });
  for (std::size_t i = 0; i < options.inputs.size(); ++i) options.inputs[i].sequence_number = i;
  options.save_checkpoints = false;
  options.run_directory = directory.path();

  catch_interrupts();
  const auto programs = behaviours::ProgramSet::load(plan.manifest, directory.path());
  ProgressBar progress(plan, !quiet);
  Verifier verifier(recorded, progress);
  const RunTotals totals = local::run(plan, programs, options, verifier);
  progress.clear();
  if (!totals.failure.empty()) throw RunError(totals.failure);
  if (verifier.verified() != recorded.chain.size()) {
    throw RunError(fmt::format("{} of {} recorded ticks were reached", verifier.verified(), recorded.chain.size()));
  }
  if (!quiet)
    fmt::print("verified: {} ticks, every state hash agrees ({:016x})\n", verifier.verified(), totals.state_hash);
  return 0;
}

Command add_replay(CLI::App& program) {
  struct Arguments {
    std::filesystem::path run;
    bool verify = false, quiet = false;
  };
  const auto arguments = std::make_shared<Arguments>();
  CLI::App& app = *program.add_subcommand("replay", "step a recorded run again and compare it with the recording");
  app.add_option("RUN", arguments->run, "run directory")->required()->type_name("");
  app.add_flag("--verify", arguments->verify, "compare every tick's state hash")->required();
  app.add_flag("--quiet", arguments->quiet, "no progress and no result on the screen");
  return {&app, [arguments] { return replay_command(arguments->run, arguments->quiet); }};
}

}  // namespace kilotwin::cli
