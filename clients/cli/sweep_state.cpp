#include "clients/cli/sweep_state.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "clients/recorder/reader.hpp"
#include "core/base/error.hpp"
#include "core/os/files.hpp"

namespace kilotwin::cli {
namespace {

namespace fs = std::filesystem;

fs::path plan_of(const fs::path& directory) { return directory / "sweep.json"; }

}  // namespace

std::string plan_text(const fs::path& experiment, const std::vector<SweepPoint>& points,
                      const std::vector<std::string>& words) {
  const nlohmann::ordered_json json{{"experiment", experiment.string()}, {"points", points}, {"words", words}};
  return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

void write_plan(const fs::path& directory, const std::string& plan) { os::write_file(plan_of(directory), plan); }

void check_plan(const fs::path& directory, const std::string& plan) {
  const auto text = os::read_if_there(plan_of(directory));
  if (!text)
    throw UserError(fmt::format("--resume: {} holds no sweep; give the directory of one", directory.string()));
  if (*text != plan) {
    throw UserError(
        fmt::format("--resume: {} is a sweep of another experiment, other values or other options; its "
                    "sweep.json says which; only --seeds, --jobs and --plot may differ",
                    directory.string()));
  }
}

bool is_complete(const SweepRun& run) {
  try {
    recorder::Reader recording(run.directory / "recording.ktrec");
    if (recording.header().seed() != run.seed || !fs::exists(run.directory / "summary.json")) return false;
    bool well = false;
    while (const proto::Record* record = recording.next()) {
      if (record->has_end()) well = record->end().failure().empty();
    }
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
