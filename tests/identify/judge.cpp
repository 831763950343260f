// Evaluates `kilotwin identify` on the scenes of tests/identify/truth. Prints prediction errors before and after
// beside those of an oracle, correctly named effects, and false findings. Exit status 1 if a criterion fails.
// Usage: judge [--program KILOTWIN] [--seed N] [--keep DIR] [--small] [--robots N] [--runs N] [--seconds S]
//              [--nothing N] [--random N] [--coverage N] [--rivals] [--jobs N] [--all | SCENE|nothing:SEED|random:SEED...]
// --all: all scenes, without sets that have no effect.
// --random N: N sets with random effects, of the seeds 1000 S and so on.
// --coverage N: how often the 95 % intervals of N sets hold the true values. With scenes: of N sets of each, and their bands.
// --rivals: other methods on the same scenes, beside it.
// --robots, --runs and --seconds override a scene's number of robots, number of training runs and their duration.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <string>
#include <vector>

#include "core/os/worker_pool.hpp"
#include "core/stats/distributions.hpp"
#include "core/stats/quantiles.hpp"
#include "tests/identify/comparison.hpp"
#include "tests/identify/coverage.hpp"
#include "tests/identify/truth/files.hpp"
#include "tests/identify/truth/oracle.hpp"
#include "tests/identify/truth/play.hpp"
#include "tests/identify/truth/scenarios.hpp"
#include "tests/identify/verdict.hpp"

namespace {

namespace fs = std::filesystem;
using namespace kilotwin::truth;

constexpr double kHorizon_s = 10;
// Largest share of data sets without an effect that may have a finding.
constexpr double kFalseAlarms = 0.01;

struct Arguments {
  std::string program = KILOTWIN_PROGRAM;
  std::uint64_t seed = 1;
  fs::path keep;
  bool small = false;
  bool rivals = false;
  int robots = 0;      ///< 0: the scene's
  int runs = 0;        ///< training runs; 0: the scene's
  double seconds = 0;  ///< of training runs; 0: the scene's
  int nothing = 0;
  int random = 0;    ///< sets
  int coverage = 0;  ///< sets
  int jobs = 1;
  std::vector<std::string> scenes;
};

int usage() {
  fmt::print(
      stderr,
      "usage: judge [--program KILOTWIN] [--seed N] [--keep DIR] [--small] [--robots N] [--runs N] [--seconds S] "
      "[--nothing N] [--random N] [--coverage N] [--rivals] [--jobs N] [--all | "
      "SCENE|nothing:SEED|random:SEED...]\n"
      "With none of scenes, --nothing, --random and --coverage: all scenes, and 300 small sets without an effect. "
      "Scenes: {}\n",
      fmt::join(scenario_names(), " "));
  return 2;
}

/// A directory that is removed with the object, unless kept.
class Folder {
 public:
  explicit Folder(const fs::path& keep) : path_(keep), kept_(!keep.empty()) {
    if (kept_) return;
    std::string pattern = (fs::temp_directory_path() / "kilotwin-judge-XXXXXX").string();
    if (mkdtemp(pattern.data()) == nullptr) throw std::runtime_error("no scratch directory can be made");
    path_ = pattern;
  }
  ~Folder() {
    std::error_code ignored;
    if (!kept_) fs::remove_all(path_, ignored);
  }
  Folder(const Folder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
  bool kept_;
};

/// Half of the robots and three quarters of the time: a quick check.
Scene smaller(Scene scene) {
  scene.robots = std::max(std::min(8, scene.robots), scene.robots / 2);
  scene.width_mm *= 0.75;
  scene.height_mm *= 0.75;
  scene.train_s *= 0.75;
  scene.test_runs = 1;
  // Swapped robots must be there.
  for (Fault& fault : scene.faults)
    if (fault.kind == Fault::Kind::kSwapped) fault.other %= scene.robots;
  return scene;
}

/// Overrides robots (at equal density), runs and duration.
Scene resized(Scene scene, int robots, int runs, double seconds) {
  if (robots > 0) {
    const double wider = std::sqrt(robots / static_cast<double>(scene.robots));
    scene.robots = robots;
    scene.width_mm *= wider;
    scene.height_mm *= wider;
  }
  if (runs > 0) scene.train_runs = runs;
  if (seconds > 0) scene.train_s = seconds;
  return scene;
}

std::string in_quotes(const fs::path& path) { return "'" + path.string() + "'"; }

std::vector<Prediction> oracle_of(const Scene& scene, const Play& played, int samples) {
  std::vector<Prediction> oracle;
  for (const auto& run : played.test) {
    const std::vector<Prediction> of_run =
        predict(scene, played.individuals, run, kHorizon_s, samples, played.seed + 1);
    oracle.insert(oracle.end(), of_run.begin(), of_run.end());
  }
  return oracle;
}

/// A command that has ended.
struct Ended {
  int status = -1;
  double seconds = 0, cpu_s = 0;
};

Ended run_in_shell(std::string command) {
  std::string shell = "sh", option = "-c";
  char* const words[] = {shell.data(), option.data(), command.data(), nullptr};
  const auto start = std::chrono::steady_clock::now();
  pid_t child = 0;
  Ended out;
  rusage used{};
  if (posix_spawn(&child, "/bin/sh", nullptr, nullptr, words, environ) != 0 ||
      wait4(child, &out.status, 0, &used) != child)
    throw std::runtime_error("no shell can be started");
  out.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  for (const timeval& of : {used.ru_utime, used.ru_stime})
    out.cpu_s += static_cast<double>(of.tv_sec) + 1e-6 * static_cast<double>(of.tv_usec);
  return out;
}

Verdict try_set(const Arguments& arguments, const Scene& scene, const Play& played,
                const std::vector<Prediction>& oracle, const fs::path& folder) {
  write_data(scene, played.train, folder / "train");
  write_data(scene, played.test, folder / "test");
  if (!arguments.keep.empty()) write_predictions(oracle, folder / "oracle.csv");
  const fs::path out = folder / "out";
  fs::remove_all(out);
  const std::string command = fmt::format("{} identify --train {} --test {} --out {} > {} 2>&1",
                                          in_quotes(arguments.program), in_quotes(folder / "train"),
                                          in_quotes(folder / "test"), in_quotes(out), in_quotes(folder / "log"));
  const Ended ended = run_in_shell(command);
  Verdict verdict;
  if (ended.status == 0) {
    verdict = judge(scene, oracle, out);
  } else {
    std::ifstream log(folder / "log");
    std::string line, last;
    while (std::getline(log, line)) last = line;
    verdict.scene = scene.name;
    verdict.failure = fmt::format("status {}: {}", ended.status, last);
  }
  verdict.seconds = ended.seconds;
  verdict.cpu_s = ended.cpu_s;
  return verdict;
}

Verdict try_scene(const Arguments& arguments, const Scene& scene, std::uint64_t seed, int samples,
                  const fs::path& folder) {
  const Play played = play(scene, seed);
  return try_set(arguments, scene, played, oracle_of(scene, played, samples), folder);
}

/// A scene by name, with the size that the arguments give it.
Scene scene_of(const Arguments& arguments, const std::string& name) {
  Scene scene = scenario(name);
  if (arguments.small) scene = smaller(std::move(scene));
  return resized(std::move(scene), arguments.robots, arguments.runs, arguments.seconds);
}

/// The seed of a scene's play: that of its name, as in "random:7", or that of the arguments.
std::uint64_t seed_of(const Arguments& arguments, const std::string& name) {
  const std::size_t colon = name.find(':');
  return colon == std::string::npos ? arguments.seed : std::stoull(name.substr(colon + 1));
}

void print_header() {
  fmt::print("{:20} {:>8} {:>8} {:>8} {:>6} | {:>8} {:>8} {:>8} {:>6} {:>6} | {:>6} {:>5} {:>5} {:>5} {:>7}  {}\n",
             "scene", "before", "after", "oracle", "ratio", "from20s", "after", "oracle", "ratio", "median",
             "named", "false", "s", "cores", "told", "found");
}

void print_row(const Verdict& v) {
  if (!v.failure.empty()) {
    fmt::print("{:20} {}\n", v.scene, v.failure);
    return;
  }
  fmt::print(
      "{:20} {:8.2f} {:8.2f} {:8.2f} {:6.3f} | {:8.2f} {:8.2f} {:8.2f} {:6.3f} {:6.3f} | {:>6} {:5} {:5.0f} "
      "{:5.2f} {:>7}  "
      "{}{}{}{}\n",
      v.scene, v.before_mm, v.after_mm, v.oracle_mm, v.after_mm / v.oracle_mm, v.later_before_mm, v.later_after_mm,
      v.later_oracle_mm, v.later_after_mm / v.later_oracle_mm, v.median_after_mm / v.median_oracle_mm,
      fmt::format("{}/{}", v.named, v.causes), v.false_findings.size(), v.seconds, v.cpu_s / v.seconds,
      !v.unexplained.empty() ? "yes"
      : v.perhaps            ? "perhaps"
                             : "no",
      fmt::join(v.found, ", "), v.unnamed.empty() ? "" : fmt::format("; not named: {}", fmt::join(v.unnamed, ", ")),
      v.missing_rows == 0 ? "" : fmt::format("; {} rows missing", v.missing_rows), v.good() ? "" : "  <-");
  std::fflush(stdout);
}

/// Returns the number of failed scenes.
int judge_scenes(const Arguments& arguments, const fs::path& folder) {
  int misses = 0;
  std::mutex printing;
  print_header();
  kilotwin::os::in_parallel(
      arguments.scenes.size(), static_cast<std::uint32_t>(arguments.jobs), [&](std::size_t i) {
        const std::string& name = arguments.scenes[i];
        const Scene scene = scene_of(arguments, name);
        const Verdict verdict =
            try_scene(arguments, scene, seed_of(arguments, name), arguments.small ? 30 : 100, folder / scene.name);
        const std::lock_guard lock(printing);
        print_row(verdict);
        if (!verdict.good()) ++misses;
      });
  fmt::print(
      "{} of {} scenes as good as they must be: error at or below {:.2f} of the oracle's, every cause named, "
      "nothing else\n",
      static_cast<int>(arguments.scenes.size()) - misses, arguments.scenes.size(), Verdict::kRatio);
  return misses;
}

/// How many of some sets, with the 95 % interval of the probability.
std::string share_in_words(int some, int all) {
  const auto [low, high] = kilotwin::stats::wilson_interval(some, all);
  return fmt::format("{} of {} sets ({:.1f} %, 95 % interval {:.1f} to {:.1f})", some, all, 100.0 * some / all,
                     100 * low, 100 * high);
}

/// Returns the number of sets without effect that had a finding or failed.
int judge_nothing(const Arguments& arguments, const fs::path& folder) {
  int failed = 0, findings = 0, sentences = 0;
  std::mutex printing;
  std::vector<double> ratios;
  kilotwin::os::in_parallel(
      static_cast<std::size_t>(arguments.nothing), static_cast<std::uint32_t>(arguments.jobs), [&](std::size_t i) {
        const std::uint64_t seed = arguments.seed * 1000 + i;
        const Scene scene = nothing_to_find(seed);
        const Verdict verdict = try_scene(arguments, scene, seed, 20, folder / scene.name);
        const std::lock_guard lock(printing);
        if (!verdict.failure.empty()) {
          ++failed;
          return print_row(verdict);
        }
        ratios.push_back(verdict.later_after_mm / verdict.later_oracle_mm);
        if (!verdict.unexplained.empty()) {
          ++sentences;
          fmt::print("{}: {:.3f} of the oracle's error. {}\n", scene.name, ratios.back(), verdict.unexplained);
        }
        if (verdict.false_findings.empty()) return;
        ++findings;
        print_row(verdict);
      });
  const auto sets = static_cast<int>(ratios.size());
  if (failed > 0) fmt::print("failed: {} of {} sets\n", failed, arguments.nothing);
  if (sets == 0) return failed;
  const auto quantile = [&](double share) { return kilotwin::stats::nearest_quantile(ratios, share); };
  fmt::print("an effect was found: {}\n", share_in_words(findings, sets));
  fmt::print("a systematic error was reported: {}\n", share_in_words(sentences, sets));
  fmt::print("error over the oracle's: median {:.3f}, 90 % of sets below {:.3f}, largest {:.3f}\n", quantile(0.5),
             quantile(0.9), quantile(1));
  return failed + findings;
}

/// Sets with random effects. Returns the number of sets that failed.
int judge_random(const Arguments& arguments, const fs::path& folder) {
  struct Sums {
    int failed = 0, near_oracle = 0, silent = 0, named = 0, causes = 0, right = 0, found = 0;
    std::vector<double> ratios, medians, improvements;
  } sums;
  std::mutex printing;
  print_header();
  kilotwin::os::in_parallel(
      static_cast<std::size_t>(arguments.random), static_cast<std::uint32_t>(arguments.jobs), [&](std::size_t i) {
        const std::uint64_t seed = arguments.seed * 1000 + i;
        const Scene scene = scene_of(arguments, fmt::format("random:{}", seed));
        const Verdict v = try_scene(arguments, scene, seed, arguments.small ? 30 : 100, folder / scene.name);
        const std::lock_guard lock(printing);
        print_row(v);
        fmt::print("  {}\n", scene.about);
        std::fflush(stdout);
        if (!v.failure.empty()) {
          ++sums.failed;
          return;
        }
        sums.ratios.push_back(v.ratio());
        sums.medians.push_back(v.median_after_mm / v.median_oracle_mm);
        sums.improvements.push_back(v.before_mm / v.after_mm);
        if (v.ratio() <= Verdict::kRatio)
          ++sums.near_oracle;
        else if (v.unexplained.empty() && !v.perhaps)
          ++sums.silent;
        sums.named += v.named;
        sums.causes += v.causes;
        sums.found += static_cast<int>(v.found.size());
        sums.right += static_cast<int>(v.found.size() - v.false_findings.size());
      });
  const auto sets = static_cast<int>(sums.ratios.size());
  if (sums.failed > 0) fmt::print("failed: {} of {} sets\n", sums.failed, arguments.random);
  if (sets == 0) return sums.failed;
  const double recall = static_cast<double>(sums.named) / sums.causes,
               precision = static_cast<double>(sums.right) / std::max(sums.found, 1);
  fmt::print("error at or below {:.2f} of the oracle's: {}\n", Verdict::kRatio,
             share_in_words(sums.near_oracle, sets));
  fmt::print("error above it, and nothing said: {}\n", share_in_words(sums.silent, sets));
  const auto quantile = [](std::vector<double>& of, double share) {
    return kilotwin::stats::nearest_quantile(of, share);
  };
  fmt::print("error over the oracle's: median {:.3f}, 90 % of sets below {:.3f}, largest {:.3f}\n",
             quantile(sums.ratios, 0.5), quantile(sums.ratios, 0.9), quantile(sums.ratios, 1));
  const auto near =
      std::count_if(sums.medians.begin(), sums.medians.end(), [](double of) { return of <= Verdict::kRatio; });
  fmt::print("median error at or below {:.2f} of the oracle's: {}\n", Verdict::kRatio,
             share_in_words(static_cast<int>(near), sets));
  fmt::print("error of the base model over the identified one's: median {:.2f}\n",
             quantile(sums.improvements, 0.5));
  fmt::print("causes: recall {:.2f} ({} of {}), precision {:.2f} ({} of {}), F1 {:.2f}\n", recall, sums.named,
             sums.causes, precision, sums.right, sums.found,
             recall + precision > 0 ? 2 * recall * precision / (recall + precision) : 0);
  return sums.failed;
}

/// Identify beside its rivals. Returns the number of scenes in which identify failed.
int judge_rivals(const Arguments& arguments, const fs::path& folder) {
  int failed = 0;
  Comparison comparison;
  comparison.print_header();
  for (const std::string& name : arguments.scenes) {
    const Scene scene = scene_of(arguments, name);
    const Play played = play(scene, seed_of(arguments, name));
    const std::vector<Prediction> oracle = oracle_of(scene, played, arguments.small ? 30 : 100);
    const Verdict verdict = try_set(arguments, scene, played, oracle, folder / scene.name);
    if (!verdict.failure.empty()) ++failed;
    comparison.add(scene, played, oracle, verdict, folder / scene.name / "out");
  }
  comparison.print_summary();
  return failed;
}

/// Sets whose true parameters are drawn, without an effect or of the scenes: do the intervals hold them? Returns the number of sets
/// that failed.
int judge_coverage(const Arguments& arguments, const fs::path& folder) {
  const std::vector<std::string> kinds = arguments.scenes.empty() ? std::vector<std::string>{""} : arguments.scenes;
  const auto of_kind = static_cast<std::size_t>(arguments.coverage);
  int failed = 0;
  std::mutex mutex;
  Coverage coverage;
  kilotwin::os::in_parallel(of_kind * kinds.size(), static_cast<std::uint32_t>(arguments.jobs), [&](std::size_t i) {
    const std::string& kind = kinds[i / of_kind];
    const std::uint64_t seed = arguments.seed * 1000 + i;
    Scene scene = with_drawn_parameters(kind.empty() ? nothing_to_find(seed) : scene_of(arguments, kind), seed);
    if (!kind.empty()) scene.name += fmt::format("-{}", seed);
    const Verdict verdict = try_scene(arguments, scene, seed, 1, folder / scene.name);
    const std::lock_guard lock(mutex);
    if (!verdict.failure.empty()) {
      print_row(verdict);
      ++failed;
      return;
    }
    coverage.add(kind, scene, play(scene, seed), folder / scene.name / "out");
  });
  coverage.print();
  return failed;
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  try {
    for (int i = 1; i < argc; ++i) {
      const std::string word = argv[i];
      if (word == "--small") {
        arguments.small = true;
      } else if (word == "--rivals") {
        arguments.rivals = true;
      } else if (word == "--all") {
        arguments.scenes = scenario_names();
      } else if (word.rfind("--", 0) != 0) {
        scenario(word);
        arguments.scenes.push_back(word);
      } else if (i + 1 == argc) {  // NOLINT(bugprone-branch-clone): before the options that take a value
        return usage();
      } else if (word == "--program") {
        arguments.program = argv[++i];
      } else if (word == "--seed") {
        arguments.seed = std::stoull(argv[++i]);
      } else if (word == "--keep") {
        arguments.keep = argv[++i];
      } else if (word == "--robots") {
        arguments.robots = std::stoi(argv[++i]);
      } else if (word == "--runs") {
        arguments.runs = std::stoi(argv[++i]);
      } else if (word == "--seconds") {
        arguments.seconds = std::stod(argv[++i]);
      } else if (word == "--nothing") {
        arguments.nothing = std::stoi(argv[++i]);
      } else if (word == "--random") {
        arguments.random = std::stoi(argv[++i]);
      } else if (word == "--coverage") {
        arguments.coverage = std::stoi(argv[++i]);
      } else if (word == "--jobs") {
        arguments.jobs = std::stoi(argv[++i]);
      } else {
        return usage();
      }
    }
    if (arguments.scenes.empty() && arguments.nothing == 0 && arguments.random == 0 && arguments.coverage == 0) {
      arguments.scenes = scenario_names();
      arguments.nothing = arguments.rivals ? 0 : 300;
    }
    const Folder folder(arguments.keep);
    bool good = true;
    if (!arguments.scenes.empty() && arguments.coverage == 0)
      good = (arguments.rivals ? judge_rivals : judge_scenes)(arguments, folder.path()) == 0;
    if (arguments.coverage > 0) good = judge_coverage(arguments, folder.path()) == 0 && good;
    // With few sets the bound is below one: then no finding is allowed.
    if (arguments.nothing > 0)
      good = judge_nothing(arguments, folder.path()) <= kFalseAlarms * arguments.nothing && good;
    if (arguments.random > 0) good = judge_random(arguments, folder.path()) == 0 && good;
    return good ? 0 : 1;
  } catch (const std::invalid_argument&) {
    return usage();
  } catch (const std::exception& error) {
    fmt::print(stderr, "judge: {}\n", error.what());
    return 1;
  }
}
