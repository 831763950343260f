// Runs `kilotwin identify` on small sets with random oddities. Each run must end within its time and memory: with status
// 0, complete files of finite numbers and a model that `kilotwin run --model` takes, or with status 2, one line for people, and no files.
// Usage: identify_fuzz [--program KILOTWIN] [--seed N] [--sets N] [--keep DIR] [--jobs N] [--seconds S]
// The sets have the seeds N, N + 1, ... The default of 12 sets is the quick mode; `--sets 1000` is the long one.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <nlohmann/json.hpp>
#include <sstream>

#include "core/experiment/load.hpp"
#include "core/experiment/validate.hpp"
#include "core/os/worker_pool.hpp"
#include "tests/identify/fuzz/odd_set.hpp"
#include "tests/identify/truth/dice.hpp"

namespace {

namespace fs = std::filesystem;
using namespace kilotwin::truth;

struct Arguments {
  std::string program = KILOTWIN_PROGRAM;
  std::uint64_t seed = 1;
  int sets = 12;
  int jobs = 1;
  int seconds = 120;  ///< most time of one set: a bound against hanging
  fs::path keep;
};

std::string text_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

/// The error line of `kilotwin run --model` for the model; empty: it takes the model.
std::string refusal_of_model(const fs::path& out) {
  std::ofstream(out / "program.c") << "int main(void) { return 0; }\n";
  std::ofstream(out / "experiment.txtpb") << "robots { count: 1 behaviour: 'program.c' }\n";
  try {
    kilotwin::LoadedExperiment loaded = kilotwin::load_experiment(out / "experiment.txtpb");
    kilotwin::apply_model(loaded, out / "model.txtpb");
    kilotwin::validate(loaded);
  } catch (const std::exception& error) {
    return error.what();
  }
  return {};
}

/// The fault of the files of a run that succeeded; empty: none.
std::string fault_of_files(const fs::path& out) {
  for (const char* name : {"report.html", "model.txtpb", "result.json", "predictions.csv"})
    if (!fs::exists(out / name)) return fmt::format("{} is missing", name);
  for (const char* name : {"model.txtpb", "predictions.csv"}) {
    const std::string text = text_of(out / name);
    for (const char* word : {"nan", "inf"})
      if (text.find(fmt::format(" {}\n", word)) != std::string::npos ||
          text.find(fmt::format(",{}", word)) != std::string::npos)
        return fmt::format("{} has the number {}", name, word);
  }
  try {
    const nlohmann::json result = nlohmann::json::parse(text_of(out / "result.json"));
    for (const char* when : {"before", "after"}) {
      // Without held-out predictions there is no error.
      const bool any = result.at(when).at("rows").get<int>() > 0;
      if (any != result.at(when).at("rmse_mm").is_number()) return fmt::format("{}: {}", when, result[when].dump());
    }
  } catch (const std::exception& error) {
    return fmt::format("result.json: {}", error.what());
  }
  return refusal_of_model(out);
}

/// The fault of a run; empty: none.
std::string fault_of(int wait_status, const fs::path& out, const std::string& errors) {
  const int status = WIFEXITED(wait_status) ? WEXITSTATUS(wait_status) : 128 + WTERMSIG(wait_status);
  if (status == 124 || status == 137) return "does not end";
  if (status == 0) return errors.empty() ? fault_of_files(out) : "status 0 with a line on stderr: " + errors;
  if (status != 2) return fmt::format("status {}: {}", status, errors);
  if (std::count(errors.begin(), errors.end(), '\n') != 1) return "status 2 without exactly one line: " + errors;
  if (errors.size() < 20) return "no error for people: " + errors;
  return fs::exists(out) ? "status 2, but files are left" : "";
}

/// Identifies one set. Returns what is wrong.
std::string try_set(const Arguments& arguments, std::uint64_t seed, const fs::path& folder, std::string& about) {
  Dice dice(seed);
  const OddSet train = odd_set(seed);
  write_odd_set(train, folder / "train");
  std::string test;
  about = fmt::format("{}", fmt::join(train.oddities, "; "));
  if (dice.uniform() < 0.3) {
    const OddSet other = odd_set(seed + (1ULL << 40));
    write_odd_set(other, folder / "test");
    about += fmt::format("; test: {}", fmt::join(other.oddities, "; "));
    test = fmt::format("--test '{}'", (folder / "test").string());
  }
  const fs::path out = folder / "out", errors = folder / "errors";
  fs::remove_all(out);
  constexpr int kMost_kB = 4'000'000;
  const std::string command = fmt::format(
      "ulimit -v {}; timeout -k 5 {} '{}' identify --quiet --horizon {} --train '{}' {} --out '{}' > /dev/null 2> "
      "'{}'",
      kMost_kB, arguments.seconds, arguments.program, dice.uniform() < 0.5 ? 10 : 2, (folder / "train").string(),
      test, out.string(), errors.string());
  const int status = std::system(command.c_str());  // NOLINT(concurrency-mt-unsafe): no handler is changed
  return fault_of(status, out, text_of(errors));
}

int fuzz(const Arguments& arguments) {
  std::string pattern = (fs::temp_directory_path() / "kilotwin-fuzz-XXXXXX").string();
  if (arguments.keep.empty() && mkdtemp(pattern.data()) == nullptr)
    throw std::runtime_error("no scratch directory");
  const fs::path scratch = arguments.keep.empty() ? fs::path(pattern) : arguments.keep;
  std::mutex printing;
  int faults = 0;
  kilotwin::os::in_parallel(static_cast<std::size_t>(arguments.sets), static_cast<std::uint32_t>(arguments.jobs),
                            [&](std::size_t i) {
                              const std::uint64_t seed = arguments.seed + i;
                              const fs::path folder = scratch / std::to_string(seed);
                              std::string about;
                              const std::string fault = try_set(arguments, seed, folder, about);
                              if (arguments.keep.empty()) fs::remove_all(folder);
                              const std::lock_guard lock(printing);
                              if (fault.empty()) return;
                              ++faults;
                              fmt::print("seed {}: {}\n  {}\n", seed, fault, about);
                              std::fflush(stdout);
                            });
  if (arguments.keep.empty()) fs::remove_all(scratch);
  fmt::print("{} of {} sets end as they must\n", arguments.sets - faults, arguments.sets);
  return faults == 0 ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  try {
    for (int i = 1; i + 1 < argc; i += 2) {
      const std::string word = argv[i], value = argv[i + 1];
      if (word == "--program")
        arguments.program = value;
      else if (word == "--seed")
        arguments.seed = std::stoull(value);
      else if (word == "--sets")
        arguments.sets = std::stoi(value);
      else if (word == "--jobs")
        arguments.jobs = std::stoi(value);
      else if (word == "--seconds")
        arguments.seconds = std::stoi(value);
      else if (word == "--keep")
        arguments.keep = value;
      else
        throw std::invalid_argument(word);
    }
    return fuzz(arguments);
  } catch (const std::exception& error) {
    fmt::print(stderr, "identify_fuzz: {}\n", error.what());
    return 2;
  }
}
