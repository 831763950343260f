// Runs programs natively and as firmware, and compares what the robots do.
// Usage: compare_programs [--quick] [--folder DIR] [--results FILE.md] [NAME]...
//   NAME      only programs whose file name contains it
//   --folder  the programs of a directory and its subdirectories, in place of the repository's
//   --quick   8 s, of the set that was written for this comparison
// Ends with status 1 where a program differs that is not known to.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstring>
#include <fstream>
#include <mutex>

#include "core/base/error.hpp"
#include "core/base/say.hpp"
#include "core/os/files.hpp"
#include "core/os/worker_pool.hpp"
#include "tests/validation/programs/pair.hpp"

namespace {

using namespace kilotwin;
using namespace kilotwin::validation;
namespace fs = std::filesystem;

struct Arguments {
  bool quick = false;
  std::string folder, results;
  std::vector<std::string> names;
};

struct Row {
  std::string name, verdict, detail, changes, note;
  int seeds = 0;
  bool ran = false, agrees = false, known = false;
};

/// Seeds of a program that does not agree with one: four robots do not show how a random program is distributed.
constexpr int kMoreSeeds = 6;

/// Programs of the repository that are known to differ: docs/explanation/validation.md says why.
constexpr std::array kKnown{"counts_loops.c", "overflowing_sum.c", "waits_in_callback.c", "disperse.c"};

bool is_known(const fs::path& program) {
  return std::find(kKnown.begin(), kKnown.end(), program.filename().string()) != kKnown.end();
}

/// Files that hold a main(), in the order of their names.
std::vector<fs::path> programs_in(const fs::path& folder) {
  std::vector<fs::path> found;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
    const std::string ending = entry.path().extension();
    if (!entry.is_regular_file() || (ending != ".c" && ending != ".cpp")) continue;
    const std::string text = os::read_file(entry.path());
    if (text.find("main(") != std::string::npos && text.find("kilo_start") != std::string::npos)
      found.push_back(entry.path());
  }
  std::sort(found.begin(), found.end());
  return found;
}

std::vector<fs::path> chosen(const Arguments& arguments) {
  const fs::path sources = KILOTWIN_SOURCES;
  std::vector<fs::path> all;
  const auto add = [&](const fs::path& folder) {
    const auto found = programs_in(folder);
    all.insert(all.end(), found.begin(), found.end());
  };
  if (!arguments.folder.empty()) {
    add(arguments.folder);
  } else {
    if (!arguments.quick) add(sources / "behaviours");
    add(sources / "tests/validation/programs/set");
  }
  if (arguments.names.empty()) return all;
  std::erase_if(all, [&](const fs::path& file) {
    return std::none_of(arguments.names.begin(), arguments.names.end(), [&](const std::string& name) {
      return file.filename().string().find(name) != std::string::npos;
    });
  });
  return all;
}

Row row_of(PairSettings settings, const fs::path& program, const fs::path& root) {
  Row row;
  row.name = program.lexically_relative(root).string();
  const Outcome native = run_program(settings, program, false);
  const Outcome firmware = native.refusal.empty() ? run_program(settings, program, true) : Outcome{};
  row.note = native.warning;
  for (const auto& [kind, outcome] : {std::pair{"native", &native}, std::pair{"firmware", &firmware}}) {
    if (outcome->refusal.empty()) continue;
    row.verdict = fmt::format("{} does not run", kind);
    row.note = outcome->refusal;
    return row;
  }
  Comparison result = compare(native, firmware);
  if (!result.agrees && !result.event_exact && settings.seeds < settings.more_seeds) {
    settings.seeds = settings.more_seeds;
    return row_of(settings, program, root);
  }
  row.ran = true;
  row.seeds = settings.seeds;
  row.agrees = result.agrees || result.event_exact;
  row.known = !row.agrees && is_known(program);
  row.changes = fmt::format("{} of {}, {}", result.same_changes, result.native_changes, result.firmware_changes);
  row.verdict = result.event_exact ? "event for event"
                : result.agrees    ? "alike"
                : row.known        ? "differs, known"
                                   : "DIFFERS";
  if (!result.event_exact && result.part > 0)
    row.detail = fmt::format("{}: {:.4g}, {:.4g}", result.measure, result.native, result.firmware);
  return row;
}

int compare_all(const Arguments& arguments) {
  std::string scratch = (fs::temp_directory_path() / "kilotwin-programs-XXXXXX").string();
  if (mkdtemp(scratch.data()) == nullptr) throw RunError("no scratch directory can be made");
  PairSettings settings;
  settings.kilotwin = KILOTWIN_PROGRAM;
  settings.scratch = scratch;
  settings.more_seeds = kMoreSeeds;
  if (arguments.quick) settings.duration_s = 8;
  const std::vector<fs::path> programs = chosen(arguments);
  const fs::path root = arguments.folder.empty() ? fs::path(KILOTWIN_SOURCES) : fs::path(arguments.folder);
  std::vector<Row> rows(programs.size());
  std::mutex printing;
  os::WorkerPool(os::cores()).for_each(programs.size(), [&](std::size_t i) {
    PairSettings own = settings;
    own.scratch = settings.scratch / std::to_string(i);
    fs::create_directories(own.scratch);
    rows[i] = row_of(own, programs[i], root);
    fs::remove_all(own.scratch);
    const std::lock_guard lock(printing);
    fmt::print("{:<46} {:<20} {:>2} {:<20} {}\n", rows[i].name, rows[i].verdict, rows[i].seeds, rows[i].changes,
               rows[i].agrees ? rows[i].detail : rows[i].detail + "  " + rows[i].note);
    std::fflush(stdout);
  });
  fs::remove_all(scratch);
  std::size_t ran = 0, agree = 0, known = 0;
  std::string table =
      "| program | verdict | seeds | changes alike, of native, of firmware | largest difference: native, firmware "
      "|\n"
      "|---|---|---|---|---|\n";
  for (const Row& row : rows) {
    ran += row.ran ? 1 : 0;
    agree += row.agrees ? 1 : 0;
    known += row.known ? 1 : 0;
    table +=
        fmt::format("| `{}` | {} | {} | {} | {} |\n", row.name, row.verdict, row.seeds, row.changes, row.detail);
  }
  const std::string end =
      fmt::format("{} of {} programs that run both ways agree; {} do not run\n", agree, ran, rows.size() - ran);
  fmt::print("\n{}", end);
  if (!arguments.results.empty()) {
    std::ofstream(arguments.results) << fmt::format(
                                            "\n{} robots, {} s, seed 1, the default `loop_rate`, no noise of "
                                            "motion. A program that does not agree "
                                            "runs with seeds 1 to {}. *Event for event*: every change of\n"
                                            "motors and LED comes within one tick, and the counts of messages are "
                                            "equal. *Alike*: means over robots and\n"
                                            "seeds of path, distance, LED and messages differ by less than 10 %, "
                                            "or by less than two standard errors.\n\n",
                                            settings.robots, settings.duration_s, settings.more_seeds)
                                     << table << "\n"
                                     << end;
  }
  return agree + known == ran ? 0 : 1;
}

int usage() {
  say("usage: compare_programs [--quick] [--folder DIR] [--results FILE.md] [NAME]...");
  return 2;
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--quick")
      arguments.quick = true;
    else if ((word == "--folder" || word == "--results") && i + 1 < argc)
      (word == "--folder" ? arguments.folder : arguments.results) = argv[++i];
    else if (word.starts_with("-"))
      return usage();
    else
      arguments.names.push_back(word);
  }
  try {
    return compare_all(arguments);
  } catch (const std::exception& error) {
    say(fmt::format("compare_programs: {}", error.what()));
    return 1;
  }
}
