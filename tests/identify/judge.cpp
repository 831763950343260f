// Evaluates `kilotwin identify` on the scenes of tests/identify/truth. Prints prediction errors before and after
// beside those of an oracle, correctly named effects, and false findings. Exit status 1 if a criterion fails.
// Usage: judge [--program KILOTWIN] [--seed N] [--keep DIR] [--small] [--robots N] [--runs N] [--seconds S]
//              [--nothing N] [--coverage N] [--rivals] [--jobs N] [--all | SCENE|nothing:SEED...]
// --all: all scenes, without sets that have no effect.
// --coverage N: how often the 95 % intervals of N sets hold the true values.
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
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/os/worker_pool.hpp"
#include "tests/identify/comparison.hpp"
#include "tests/identify/truth/dice.hpp"
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
  int coverage = 0;  ///< sets
  int jobs = 1;
  std::vector<std::string> scenes;
};

int usage() {
  fmt::print(
      stderr,
      "usage: judge [--program KILOTWIN] [--seed N] [--keep DIR] [--small] [--robots N] [--runs N] [--seconds S] "
      "[--nothing N] [--coverage N] [--rivals] [--jobs N] [--all | SCENE|nothing:SEED...]\n"
      "Without scenes and --nothing: all scenes, and 300 small sets without an effect. Scenes: {}\n",
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
  scene.robots = std::max(8, scene.robots / 2);
  scene.width_mm *= 0.75;
  scene.height_mm *= 0.75;
  scene.train_s *= 0.75;
  scene.test_runs = 1;
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

/// A scene by name; "nothing:N" is the small scene without effect for seed N.
Scene scene_of(const std::string& name) {
  return name.rfind("nothing:", 0) == 0 ? nothing_to_find(std::stoull(name.substr(8))) : scenario(name);
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
  Scene scene = scene_of(name);
  if (arguments.small) scene = smaller(std::move(scene));
  return resized(std::move(scene), arguments.robots, arguments.runs, arguments.seconds);
}

void print_header() {
  fmt::print("{:20} {:>8} {:>8} {:>8} {:>6} | {:>8} {:>8} {:>8} {:>6} | {:>6} {:>5} {:>5} {:>5}  {}\n", "scene",
             "before", "after", "oracle", "ratio", "from20s", "after", "oracle", "ratio", "named", "false", "s",
             "cores", "found");
}

void print_row(const Verdict& v) {
  if (!v.failure.empty()) {
    fmt::print("{:20} {}\n", v.scene, v.failure);
    return;
  }
  fmt::print(
      "{:20} {:8.2f} {:8.2f} {:8.2f} {:6.3f} | {:8.2f} {:8.2f} {:8.2f} {:6.3f} | {:>6} {:5} {:5.0f} {:5.2f}  "
      "{}{}{}{}\n",
      v.scene, v.before_mm, v.after_mm, v.oracle_mm, v.after_mm / v.oracle_mm, v.later_before_mm, v.later_after_mm,
      v.later_oracle_mm, v.later_after_mm / v.later_oracle_mm, fmt::format("{}/{}", v.named, v.causes),
      v.false_findings.size(), v.seconds, v.cpu_s / v.seconds, fmt::join(v.found, ", "),
      v.unnamed.empty() ? "" : fmt::format("; not named: {}", fmt::join(v.unnamed, ", ")),
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
        const Scene scene = scene_of(arguments, arguments.scenes[i]);
        const Verdict verdict =
            try_scene(arguments, scene, arguments.seed, arguments.small ? 30 : 100, folder / scene.name);
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

/// Returns the number of sets without effect that had a finding or failed.
int judge_nothing(const Arguments& arguments, const fs::path& folder) {
  int alarms = 0;
  std::mutex printing;
  std::vector<double> ratios;
  kilotwin::os::in_parallel(static_cast<std::size_t>(arguments.nothing), static_cast<std::uint32_t>(arguments.jobs),
                            [&](std::size_t i) {
                              const std::uint64_t seed = arguments.seed * 1000 + i;
                              const Scene scene = nothing_to_find(seed);
                              const Verdict verdict = try_scene(arguments, scene, seed, 20, folder / scene.name);
                              const std::lock_guard lock(printing);
                              if (verdict.failure.empty())
                                ratios.push_back(verdict.later_after_mm / verdict.later_oracle_mm);
                              if (verdict.failure.empty() && verdict.false_findings.empty()) return;
                              ++alarms;
                              print_row(verdict);
                            });
  std::sort(ratios.begin(), ratios.end());
  fmt::print("{} of {} sets without an effect with something found; error over the oracle's, median {:.3f}\n",
             alarms, arguments.nothing, ratios.empty() ? 0 : ratios[ratios.size() / 2]);
  return alarms;
}

/// Identify beside its rivals. Returns the number of scenes in which identify failed.
int judge_rivals(const Arguments& arguments, const fs::path& folder) {
  int failed = 0;
  Comparison comparison;
  comparison.print_header();
  for (const std::string& name : arguments.scenes) {
    const Scene scene = scene_of(arguments, name);
    const Play played = play(scene, arguments.seed);
    const std::vector<Prediction> oracle = oracle_of(scene, played, arguments.small ? 30 : 100);
    const Verdict verdict = try_set(arguments, scene, played, oracle, folder / scene.name);
    if (!verdict.failure.empty()) ++failed;
    comparison.add(scene, played, oracle, verdict);
  }
  comparison.print_summary();
  return failed;
}

/// Counts how many 95 % intervals hold the true value, by parameter.
class Coverage {
 public:
  void add(const std::string& set, const std::string& parameter, double truth, double value, double sd) {
    constexpr double kNormal95 = 1.96;
    add_interval(set, parameter, truth, value - kNormal95 * sd, value + kNormal95 * sd);
  }
  /// Prints an interval that lacks the truth.
  void add_interval(const std::string& set, const std::string& parameter, double truth, double low, double high) {
    auto& [held, all] = counts_[parameter];
    const bool holds = low <= truth && truth <= high;
    if (!holds) fmt::print("{}: {} is {:.6g}, not in {:.6g}..{:.6g}\n", set, parameter, truth, low, high);
    held += holds ? 1 : 0;
    ++all;
  }
  void print() const {
    for (const auto& [parameter, count] : counts_) {
      const auto [held, all] = count;
      const double share = static_cast<double>(held) / all;
      fmt::print("{:24} {:5} of {:5} intervals hold the truth: {:.1f} % +- {:.1f}\n", parameter, held, all,
                 100 * share, 100 * std::sqrt(0.95 * 0.05 / all));
    }
  }

 private:
  std::map<std::string, std::pair<int, int>> counts_;
};

/// Sets whose true parameters are drawn: do the intervals hold them? Returns the number of sets that failed.
int judge_coverage(const Arguments& arguments, const fs::path& folder) {
  int failed = 0;
  std::mutex mutex;
  Coverage coverage;
  kilotwin::os::in_parallel(
      static_cast<std::size_t>(arguments.coverage), static_cast<std::uint32_t>(arguments.jobs), [&](std::size_t i) {
        const std::uint64_t seed = arguments.seed * 1000 + i;
        Scene scene = nothing_to_find(seed);
        Dice dice(seed ^ 0x636f766572);
        // From the priors of the fit (fitter.hpp): an interval that contains what a prior leaves open holds the truth often enough
        // only if the truth varies as the prior says.
        scene.wheel_base_mm += 2 * dice.normal();
        scene.straight_mm_s += 1 * dice.normal();
        scene.turn_mm_s += 2 * dice.normal();
        scene.bias_mean_mm_s += scene.bias_sd_mm_s / 2 * dice.normal();
        const Verdict verdict = try_scene(arguments, scene, seed, 1, folder / scene.name);
        const std::lock_guard lock(mutex);
        if (!verdict.failure.empty()) {
          print_row(verdict);
          ++failed;
          return;
        }
        const Play played = play(scene, seed);
        std::ifstream in(folder / scene.name / "out" / "result.json");
        const nlohmann::json result = nlohmann::json::parse(in);
        const auto base = [&](const char* parameter, double truth) {
          coverage.add(scene.name, parameter, truth, result.at("base").at(parameter).get<double>(),
                       result.at("base_sd").at(parameter).get<double>());
        };
        base("straight_speed_mm_s", scene.straight_mm_s);
        base("turn_speed_mm_s", scene.turn_mm_s);
        base("wheel_base_mm", scene.wheel_base_mm);
        base("tracked_point_ahead_mm", scene.tracked_ahead_mm);
        base("tracked_point_left_mm", 0);
        const auto noise = [&](const char* parameter, double truth) {
          const nlohmann::json &low = result.at("noise_low").at(parameter),
                               &high = result.at("noise_high").at(parameter);
          // Null: a variance that may be as large as any.
          coverage.add_interval(scene.name, parameter, truth, low.get<double>(),
                                high.is_null() ? INFINITY : high.get<double>());
        };
        noise("tracker_position_sd_mm", scene.tracker_sd_mm);
        if (scene.heading) noise("tracker_heading_sd_rad", scene.heading_sd_rad);
        noise("factor_variance_s", scene.factor_sd * scene.factor_sd * scene.step_s);
        for (const nlohmann::json& robot : result.at("robots")) {
          const Wheels<double>& bias = played.individuals.at(robot.at("robot").get<std::size_t>()).bias_mm_s;
          coverage.add(scene.name, "bias_left_mm_s", bias.left, robot.at("bias_left_mm_s"),
                       robot.at("sd_left_mm_s"));
          coverage.add(scene.name, "bias_right_mm_s", bias.right, robot.at("bias_right_mm_s"),
                       robot.at("sd_right_mm_s"));
        }
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
        scene_of(word);
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
      } else if (word == "--coverage") {
        arguments.coverage = std::stoi(argv[++i]);
      } else if (word == "--jobs") {
        arguments.jobs = std::stoi(argv[++i]);
      } else {
        return usage();
      }
    }
    if (arguments.scenes.empty() && arguments.nothing == 0 && arguments.coverage == 0) {
      arguments.scenes = scenario_names();
      arguments.nothing = arguments.rivals ? 0 : 300;
    }
    const Folder folder(arguments.keep);
    bool good = true;
    if (!arguments.scenes.empty())
      good = (arguments.rivals ? judge_rivals : judge_scenes)(arguments, folder.path()) == 0;
    if (arguments.coverage > 0) good = judge_coverage(arguments, folder.path()) == 0 && good;
    // With few sets the bound is below one: then no finding is allowed.
    if (arguments.nothing > 0)
      good = judge_nothing(arguments, folder.path()) <= kFalseAlarms * arguments.nothing && good;
    return good ? 0 : 1;
  } catch (const std::invalid_argument&) {
    return usage();
  } catch (const std::exception& error) {
    fmt::print(stderr, "judge: {}\n", error.what());
    return 1;
  }
}
