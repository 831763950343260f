// Runs programs natively and as firmware, and compares what the robots do.
// Usage: compare_programs [OPTION]... [NAME]...
//   NAME           only programs whose path contains it
//   --folder DIR   the programs of a directory and its subdirectories, each distinct text once, in place of the repository's
//   --robots N     robots per run, 4
//   --duration S   simulated seconds per run, 12
//   --light TEXT   the experiment's field `light`, in protobuf text format
//   --results F    the results as a page; with --folder by repository, DIR/OWNER/NAME
//   --quick        8 s, of the set that was written for this comparison
// Ends with status 1 where a program differs or does not run and causes.csv does not say why.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdlib>
#include <mutex>
#include <set>

#include "core/base/error.hpp"
#include "core/base/say.hpp"
#include "core/os/files.hpp"
#include "core/os/worker_pool.hpp"
#include "tests/validation/programs/pair.hpp"
#include "tests/validation/programs/result_pages.hpp"

namespace {

using namespace kilotwin;
using namespace kilotwin::validation;
namespace fs = std::filesystem;

struct Arguments {
  bool quick = false;
  std::string folder, results;
  PairSettings settings;
  std::vector<std::string> names;
};

/// The text without the path of the folder that is compared.
std::string without(std::string text, const fs::path& root) {
  const std::string prefix = fs::absolute(root).lexically_normal().string() + "/";
  for (std::size_t at; (at = text.find(prefix)) != std::string::npos;) text.erase(at, prefix.size());
  return text;
}

/// Files that hold a main(), in the order of their names. Of files that differ in white space alone the first.
std::vector<fs::path> programs_in(const fs::path& folder) {
  std::vector<fs::path> all, found;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
    const std::string ending = entry.path().extension();
    if (!entry.is_regular_file() || (ending != ".c" && ending != ".cpp")) continue;
    const std::string text = os::read_file(entry.path());
    if (text.find("main(") != std::string::npos && text.find("kilo_start") != std::string::npos)
      all.push_back(entry.path());
  }
  std::sort(all.begin(), all.end());
  std::set<std::string> texts;
  for (const fs::path& file : all) {
    std::string text = os::read_file(file);
    std::erase_if(text, [](unsigned char c) { return std::isspace(c) != 0; });
    if (texts.insert(std::move(text)).second) found.push_back(file);
  }
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
    return std::none_of(arguments.names.begin(), arguments.names.end(),
                        [&](const std::string& name) { return file.string().find(name) != std::string::npos; });
  });
  return all;
}

Row row_of(const PairSettings& settings, const fs::path& program, const fs::path& root, const Causes& causes) {
  Row row;
  row.name = program.lexically_relative(root).string();
  std::array<Outcome, 2> outcomes;
  Comparison result;
  for (const int seeds : {1, kMoreSeeds, kMostSeeds}) {
    for (const bool avr : {false, true}) {
      Outcome& outcome = outcomes[avr ? 1 : 0];
      run_program(settings, program, avr, row.seeds + 1, seeds, outcome);
      if (outcome.refusal.empty()) continue;
      row.verdict = fmt::format("{} does not run", avr ? "firmware" : "native");
      row.note = without(outcome.refusal, root);
      row.cause = causes.of("refusal", row.name);
      row.known = !row.cause.empty();
      return row;
    }
    row.seeds = seeds;
    result = compare(outcomes[0], outcomes[1]);
    if (result.event_exact || result.agrees) break;
  }
  row.note = outcomes[0].warning;
  row.ran = true;
  row.agrees = result.agrees || result.event_exact;
  if (!row.agrees) row.cause = causes.of("difference", row.name);
  row.known = !row.cause.empty();
  row.changes = fmt::format("{} of {}, {}", result.same_changes, result.native_changes, result.firmware_changes);
  row.verdict = result.event_exact    ? "event for event"
                : result.within_tenth ? "alike"
                : result.agrees       ? "not distinguishable"
                : row.known           ? "differs, known"
                                      : "DIFFERS";
  if (result.event_exact || result.part <= 0) return row;
  row.detail = fmt::format("{}: {:.4g}, {:.4g}", result.measure, result.native, result.firmware);
  if (!result.within_tenth)
    row.detail += fmt::format("; p {} {:.2g}", result.p * (kDivisions + 1) < 1.5 ? "<=" : "=", result.p);
  return row;
}

int compare_all(const Arguments& arguments) {
  std::string scratch = (fs::temp_directory_path() / "kilotwin-programs-XXXXXX").string();
  if (mkdtemp(scratch.data()) == nullptr) throw RunError("no scratch directory can be made");
  const std::vector<fs::path> programs = chosen(arguments);
  const fs::path root = arguments.folder.empty() ? fs::path(KILOTWIN_SOURCES) : fs::path(arguments.folder);
  const Causes causes(fs::path(KILOTWIN_SOURCES) / "tests/validation/programs/causes.csv");
  std::vector<Row> rows(programs.size());
  std::mutex printing;
  os::WorkerPool(os::cores()).for_each(programs.size(), [&](std::size_t i) {
    PairSettings own = arguments.settings;
    own.kilotwin = KILOTWIN_PROGRAM;
    own.scratch = fs::path(scratch) / std::to_string(i);
    fs::create_directories(own.scratch);
    rows[i] = row_of(own, programs[i], root, causes);
    fs::remove_all(own.scratch);
    const std::lock_guard lock(printing);
    fmt::print("{:<46} {:<20} {:>2} {:<20} {}\n", rows[i].name, rows[i].verdict, rows[i].seeds, rows[i].changes,
               rows[i].agrees ? rows[i].detail : rows[i].detail + "  " + rows[i].note);
    std::fflush(stdout);
  });
  fs::remove_all(scratch);
  fmt::print("\n{}", totals(rows));
  if (!arguments.results.empty()) {
    const PairSettings& used = arguments.settings;
    os::write_file(arguments.results, arguments.folder.empty() ? own_page(rows, used) : public_page(rows, used));
  }
  return std::all_of(rows.begin(), rows.end(), [](const Row& row) { return row.agrees || row.known; }) ? 0 : 1;
}

int usage() {
  say("usage: compare_programs [--quick] [--folder DIR] [--robots N] [--duration S] [--light TEXT] [--results "
      "FILE.md] "
      "[NAME]...");
  return 2;
}

/// False where the words are not as the usage says.
bool parse(int argc, char** argv, Arguments& arguments) {
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (!word.starts_with("-")) {
      arguments.names.push_back(word);
      continue;
    }
    if (word == "--quick") {
      arguments.quick = true;
      arguments.settings.duration_s = 8;
      continue;
    }
    if (i + 1 == argc) return false;
    const std::string value = argv[++i];
    if (word == "--folder")
      arguments.folder = value;
    else if (word == "--results")
      arguments.results = value;
    else if (word == "--light")
      arguments.settings.light = value;
    else if (word == "--robots")
      arguments.settings.robots = std::atoi(value.c_str());
    else if (word == "--duration")
      arguments.settings.duration_s = std::atof(value.c_str());
    else
      return false;
  }
  return arguments.settings.robots > 0 && arguments.settings.duration_s > 0;
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  if (!parse(argc, argv, arguments)) return usage();
  try {
    return compare_all(arguments);
  } catch (const std::exception& error) {
    say(fmt::format("compare_programs: {}", error.what()));
    return 1;
  }
}
