#include "clients/cli/sweep_state.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "clients/cli/prepare.hpp"
#include "clients/recorder/reader.hpp"
#include "clients/recorder/summary.hpp"
#include "core/base/build_identity.hpp"
#include "core/base/error.hpp"
#include "core/os/files.hpp"
#include "services/behaviours/sha256.hpp"

namespace kilotwin::cli {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

fs::path plan_of(const fs::path& directory) { return directory / "sweep.json"; }

ordered_json in_json(const SweepPlan& plan) {
  return {{"experiment", plan.experiment.string()},
          {"points", plan.points},
          {"words", plan.words},
          {"content",
           {{"build", std::string(build_identity())},
            {"experiment", plan.content.experiment()},
            {"files", plan.content.files()}}}};
}

/// The plan as its file holds it. Names of files need not be UTF-8.
std::string text_of(const SweepPlan& plan) {
  return in_json(plan).dump(2, ' ', false, ordered_json::error_handler_t::replace) + "\n";
}

/// The name of a file whose content is not what it was; empty: all are alike.
std::string changed_file(const ordered_json& before, const ordered_json& now) {
  for (const auto& [name, hashes] : now.items()) {
    if (before.value(name, ordered_json()) != hashes) return name;
  }
  return {};
}

}  // namespace

void SweepContent::add(const Resolved& point) {
  proto::Manifest manifest = point.manifest;
  for (const proto::Program& program : manifest.program()) files_[program.path()].insert(program.sha256());
  for (int i = 0; i < manifest.station_plugin_size(); ++i) {
    if (!manifest.station_plugin(i).empty())
      files_[manifest.experiment().station().environment(i).plugin().source(0)].insert(manifest.station_plugin(i));
  }
  // Fields that differ between equal runs, and fields that the programs decide.
  manifest.clear_run();
  manifest.clear_build();
  manifest.clear_program();
  manifest.clear_station_plugin();
  manifest.clear_station_host();
  manifest.clear_variable();
  points_ += behaviours::sha256_hex(manifest.SerializeAsString());
}

void SweepContent::add_file(const fs::path& file) {
  const auto octets = os::read_if_there(file);
  if (!octets) throw UserError(file.string() + ": cannot be read");
  files_[file.string()].insert(behaviours::sha256_hex(*octets));
}

std::string SweepContent::experiment() const { return behaviours::sha256_hex(points_); }

void write_plan(const fs::path& directory, const SweepPlan& plan) {
  os::write_file(plan_of(directory), text_of(plan));
}

void check_plan(const fs::path& directory, const SweepPlan& plan) {
  const auto text = os::read_if_there(plan_of(directory));
  if (!text)
    throw UserError(fmt::format("--resume: {} holds no sweep; give the directory of one", directory.string()));
  const auto before = ordered_json::parse(*text, nullptr, false), now = ordered_json::parse(text_of(plan));
  for (const char* part : {"experiment", "points", "words"}) {
    if (before.is_object() && before.value(part, ordered_json()) == now[part]) continue;
    throw UserError(
        fmt::format("--resume: {} is a sweep of another experiment, other values or other options; its "
                    "sweep.json says which; only --seeds, --jobs and --plot may differ",
                    directory.string()));
  }
  const auto refuse = [&](const std::string& what) {
    throw UserError(
        fmt::format("--resume: {}: {} than when its runs were made, so one table would mix both; give --out for a "
                    "new sweep",
                    directory.string(), what));
  };
  const ordered_json then = before.value("content", ordered_json::object());
  if (then.value("build", "") != now["content"]["build"]) refuse("Kilotwin is another build");
  if (const std::string name = changed_file(then.value("files", ordered_json::object()), now["content"]["files"]);
      !name.empty())
    refuse(name + " has another content");
  if (then.value("experiment", "") != now["content"]["experiment"])
    refuse(plan.experiment.string() + ", or a file that it names, has another content");
}

bool is_complete(const SweepRun& run) {
  try {
    recorder::Reader recording(run.directory / "recording.ktrec");
    if (recording.header().seed() != run.seed || !fs::exists(run.directory / "summary.json")) return false;
    bool well = false;
    while (const proto::Record* record = recording.next()) {
      if (record->has_end()) well = record->end().failure().empty();
    }
    if (run.strict && recorder::read_summary(run.directory / "summary.json").robots_failed > 0) return false;
    return well && recording.ended() && recording.warning().empty();
  } catch (const std::exception&) {
    return false;
  }
}

void remove_unfinished(const SweepRun& run) {
  std::error_code ignored;
  fs::remove_all(run.directory, ignored);
}

}  // namespace kilotwin::cli
