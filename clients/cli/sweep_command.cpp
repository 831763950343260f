#include "clients/cli/sweep_command.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <charconv>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <map>
#include <optional>
#include <thread>

#include "clients/cli/prepare.hpp"
#include "clients/recorder/file.hpp"
#include "clients/recorder/plot.hpp"
#include "clients/recorder/reader.hpp"
#include "clients/recorder/statistics.hpp"
#include "clients/recorder/summary.hpp"
#include "core/base/error.hpp"
#include "core/base/say.hpp"
#include "core/experiment/validate.hpp"
#include "core/federation/interrupt.hpp"

namespace kilotwin::cli {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostRuns = 100'000;
constexpr auto kPoll = std::chrono::milliseconds(5);
/// For how long runs may take to end once they were asked to.
constexpr auto kGrace = std::chrono::milliseconds(3000);

std::vector<std::uint64_t> parse_seeds(const std::string& text) {
  std::uint64_t first = 0, last = 0;
  const char* const end = text.data() + text.size();
  auto [position, error] = std::from_chars(text.data(), end, first);
  last = first;
  const bool range = error == std::errc() && end - position > 2 && position[0] == '.' && position[1] == '.';
  if (range) std::tie(position, error) = std::pair(std::from_chars(position + 2, end, last).ptr, error);
  if (error != std::errc() || position != end || last < first || last - first >= kMostRuns) {
    throw UserError(fmt::format("--seeds: \"{}\" is no range; give FIRST..LAST such as 1..20", text));
  }
  std::vector<std::uint64_t> seeds;
  for (std::uint64_t i = 0; i <= last - first; ++i) seeds.push_back(first + i);
  return seeds;
}

/// One combination of swept values: "FIELD=V" per swept field.
using Point = std::vector<std::string>;

std::vector<Point> combinations(const std::vector<std::string>& sets) {
  std::vector<Point> points{{}};
  for (const std::string& set : sets) {
    const std::size_t equals = set.find('=');
    if (equals == std::string::npos)
      throw UserError(fmt::format("--set: \"{}\" has no value; give FIELD=V1,V2", set));
    std::vector<Point> more;
    for (const Point& point : points) {
      for (std::size_t from = equals + 1; from <= set.size();) {
        const std::size_t to = std::min(set.find(',', from), set.size());
        more.push_back(point);
        more.back().push_back(set.substr(0, equals + 1) + set.substr(from, to - from));
        from = to + 1;
      }
    }
    points = std::move(more);
    if (points.size() > kMostRuns) throw UserError(fmt::format("--set: more than {} combinations", kMostRuns));
  }
  return points;
}

std::string label(const Point& point) {
  std::string text;
  for (const std::string& set : point) text += (text.empty() ? "" : ", ") + set;
  return text;
}

struct Job {
  std::size_t point;
  std::uint64_t seed;
  fs::path directory;
  pid_t process = -1;
  bool well = false;
};

std::vector<std::string> words_of(const SweepArguments& arguments, const Point& point, const Job& job) {
  std::vector<std::string> words{"kilotwin",
                                 "run",
                                 arguments.run.experiment.string(),
                                 "--mode",
                                 "local",
                                 "--quiet",
                                 "--out",
                                 job.directory.string()};
  if (!arguments.seeds.empty()) words.insert(words.end(), {"--seed", std::to_string(job.seed)});
  for (const std::string& set : point) words.insert(words.end(), {"--set", set});
  for (const std::string& define : arguments.run.define) words.insert(words.end(), {"--define", define});
  if (arguments.run.duration_s)
    words.insert(words.end(), {"--duration", fmt::format("{}", *arguments.run.duration_s)});
  if (arguments.run.robots) words.insert(words.end(), {"--robots", std::to_string(*arguments.run.robots)});
  if (!arguments.run.behaviour.empty())
    words.insert(words.end(), {"--behaviour", arguments.run.behaviour.string()});
  if (!arguments.run.model.empty()) words.insert(words.end(), {"--model", arguments.run.model.string()});
  return words;
}

/// Each run is a process of its own: programs are loaded at fixed addresses, one set per process.
pid_t start(std::vector<std::string> words, const fs::path& log_file) {
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  const int log = open(log_file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  const pid_t parent = getpid();
  const pid_t process = fork();
  if (process == 0) {
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (getppid() != parent) _exit(1);
    if (log >= 0) {
      dup2(log, STDOUT_FILENO);
      dup2(log, STDERR_FILENO);
    }
    execv("/proc/self/exe", argv.data());
    _exit(127);
  }
  if (log >= 0) close(log);
  if (process < 0) throw RunError("a run cannot be started: the system has no room for another process");
  return process;
}

std::string read_log(const fs::path& file) {
  std::ifstream stream(file);
  std::string line, last;
  while (std::getline(stream, line)) {
    if (!line.empty()) last = line;
  }
  return last.empty() ? "it said nothing; is the disk full?" : last;
}

void run_all(std::vector<Job>& jobs, const SweepArguments& arguments, const std::vector<Point>& points) {
  const std::uint32_t cores = std::max(1u, std::thread::hardware_concurrency());
  const std::size_t at_a_time = arguments.jobs > 0 ? arguments.jobs : cores;
  std::map<pid_t, Job*> running;
  std::size_t next = 0, done = 0;
  const bool terminal = isatty(STDERR_FILENO) == 1;
  std::optional<std::chrono::steady_clock::time_point> patience;  // of runs that were told to end
  const auto tell = [&running](int signal) {
    for (const auto& [process, job] : running) kill(process, signal);
  };
  while (done < jobs.size()) {
    while (running.size() < at_a_time && next < jobs.size() && interrupted() == 0) {
      Job& job = jobs[next++];
      job.process = start(words_of(arguments, points[job.point], job), job.directory.string() + ".log");
      running[job.process] = &job;
    }
    if (running.empty()) {
      if (terminal) std::fputs("\r\x1b[K", stderr);
      throw RunError("interrupted; the runs that were done are there, a table is not");
    }
    int status = 0;
    const pid_t ended = waitpid(-1, &status, WNOHANG);
    if (ended <= 0) {
      if (interrupted() != 0 && !patience) {
        patience = std::chrono::steady_clock::now() + kGrace;
        tell(SIGTERM);
      }
      if (patience && std::chrono::steady_clock::now() > *patience) tell(SIGKILL);
      std::this_thread::sleep_for(kPoll);
      continue;
    }
    if (const auto found = running.find(ended); found != running.end()) {
      found->second->well = WIFEXITED(status) && WEXITSTATUS(status) == 0;
      running.erase(found);
      ++done;
      if (terminal) std::fputs(fmt::format("\r\x1b[K{} of {} runs done", done, jobs.size()).c_str(), stderr);
    }
  }
  if (terminal) std::fputs("\r\x1b[K", stderr);
}

/// The observables of the runs at one point.
struct Observed {
  recorder::Sample moved_mm, msd_mm2, sent, received, collided, realtime;
  std::vector<recorder::Sample> msd_at;  // per recorded state
  std::vector<double> time_s;
};

void observe(const Job& job, Observed& observed) {
  const recorder::Summary summary = recorder::read_summary(job.directory / "summary.json");
  observed.moved_mm.add(summary.moved_mm.mean);
  observed.sent.add(static_cast<double>(summary.messages.sent));
  observed.received.add(static_cast<double>(summary.messages.received));
  observed.collided.add(static_cast<double>(summary.messages.collided));
  observed.realtime.add(summary.realtime_factor());
  recorder::Reader reader(job.directory / "recording.ktrec");
  const recorder::MeanSquareDisplacement msd = recorder::mean_square_displacement(reader);
  if (msd.time_s.size() > observed.time_s.size()) observed.time_s = msd.time_s;
  if (observed.msd_at.size() < msd.msd_mm2.size()) observed.msd_at.resize(msd.msd_mm2.size());
  for (std::size_t i = 0; i < msd.msd_mm2.size(); ++i) observed.msd_at[i].add(msd.msd_mm2[i]);
  if (!msd.msd_mm2.empty()) observed.msd_mm2.add(msd.msd_mm2.back());
}

std::string with_error(const recorder::Sample& sample) {
  if (sample.count() == 0) return "-";
  if (sample.count() == 1) return fmt::format("{:.5g}", sample.mean());
  return fmt::format("{:.5g} +- {:.2g}", sample.mean(), sample.standard_error());
}

}  // namespace

int sweep_command(const SweepArguments& arguments) {
  const std::vector<Point> points = combinations(arguments.set);
  // Every point is checked before the first run, so that a wrong value costs nothing.
  std::string name;
  std::vector<std::uint64_t> own_seeds;
  for (const Point& point : points) {
    RunArguments one = arguments.run;
    one.set = point;
    const LoadedExperiment loaded = load_with_overrides(one);
    validate(loaded);
    name = loaded.experiment.name();
    own_seeds.push_back(loaded.experiment.seed());
  }
  std::vector<std::uint64_t> seeds;
  if (!arguments.seeds.empty()) seeds = parse_seeds(arguments.seeds);
  const auto directory =
      recorder::RunDirectory::create(arguments.out.empty() ? fs::path("runs") / (name + "-sweep") : arguments.out);
  std::vector<Job> jobs;
  for (std::size_t point = 0; point < points.size(); ++point) {
    for (const std::uint64_t seed : arguments.seeds.empty() ? std::vector{own_seeds[point]} : seeds) {
      jobs.push_back({point, seed, directory.path() / fmt::format("{:04}-{}", point, seed)});
    }
  }
  catch_interrupts();
  run_all(jobs, arguments, points);

  std::vector<Observed> observed(points.size());
  std::size_t failed = 0;
  for (const Job& job : jobs) {
    if (job.well) {
      observe(job, observed[job.point]);
    } else {
      ++failed;
      const std::string at = points[job.point].empty() ? name : label(points[job.point]);
      say(fmt::format("kilotwin: {} with seed {} failed: {}", at, job.seed,
                      read_log(job.directory.string() + ".log")));
    }
  }

  std::string csv = "point,runs,msd_mm2,msd_se_mm2,moved_mm,moved_se_mm,sent,received,collided,realtime_factor\n";
  fmt::print("{:<40} {:>5} {:>22} {:>18} {:>20} {:>20} {:>10}\n", "at", "runs", "MSD at the end, mm^2", "moved, mm",
             "sent", "received", "x real t.");
  recorder::Plot plot;
  plot.title = name + ": mean square displacement";
  plot.subtitle = fmt::format("{} {} per curve; bars: standard error over {}",
                              std::max<std::size_t>(1, seeds.size()), seeds.size() <= 1 ? "run" : "runs", "runs");
  plot.x_name = "time";
  plot.x_unit = "s";
  plot.y_name = "MSD";
  plot.y_unit = "mm^2";
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Observed& at = observed[i];
    fmt::print("{:<40} {:>5} {:>22} {:>18} {:>20} {:>20} {:>10.1f}\n", points[i].empty() ? name : label(points[i]),
               at.msd_mm2.count(), with_error(at.msd_mm2), with_error(at.moved_mm), with_error(at.sent),
               with_error(at.received), at.realtime.mean());
    csv += fmt::format("\"{}\",{},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:.6g}\n",
                       label(points[i]), at.msd_mm2.count(), at.msd_mm2.mean(), at.msd_mm2.standard_error(),
                       at.moved_mm.mean(), at.moved_mm.standard_error(), at.sent.mean(), at.received.mean(),
                       at.collided.mean(), at.realtime.mean());
    recorder::PlotSeries series;
    series.name = label(points[i]);
    series.x = at.time_s;
    for (const recorder::Sample& sample : at.msd_at) {
      series.y.push_back(sample.mean());
      series.error.push_back(sample.standard_error());
    }
    series.points = series.x.size() <= 40;
    plot.series.push_back(std::move(series));
  }
  recorder::write_file(directory.path() / "sweep.csv", csv);
  recorder::write_plot(plot, directory.path() / "sweep.svg");
  fmt::print("table {}, plot {}\n", (directory.path() / "sweep.csv").string(),
             (directory.path() / "sweep.svg").string());
  return failed == 0 ? 0 : 1;
}

}  // namespace kilotwin::cli
