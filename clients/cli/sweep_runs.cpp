#include "clients/cli/sweep_runs.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <fstream>
#include <map>
#include <optional>
#include <thread>

#include "clients/cli/progress.hpp"
#include "core/base/error.hpp"
#include "core/os/interrupt.hpp"

namespace kilotwin::cli {
namespace {

using Clock = std::chrono::steady_clock;

constexpr auto kPoll = std::chrono::milliseconds(2);
/// For how long runs may take to end once they were asked to.
constexpr auto kGrace = std::chrono::milliseconds(3000);

pid_t start(std::vector<std::string> words, const std::filesystem::path& log_file) {
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
  return process;
}

/// "N of M runs done", and the time left.
std::string progress_text(std::size_t done, std::size_t runs, Clock::time_point begun) {
  std::string text = fmt::format("{} of {} runs done", done, runs);
  const double wall_s = std::chrono::duration<double>(Clock::now() - begun).count();
  if (done > 0)
    text += fmt::format(", {:.0f} s left", wall_s / static_cast<double>(done) * static_cast<double>(runs - done));
  return text;
}

}  // namespace

bool run_all(std::vector<SweepRun>& runs, std::size_t at_a_time,
             const std::function<void(const SweepRun&)>& ended) {
  std::map<pid_t, SweepRun*> running;
  std::size_t next = 0, done = 0;
  Progress progress(true);
  const auto begun = Clock::now();
  std::optional<Clock::time_point> patience;  // with runs that were told to end
  const auto tell = [&running](int signal) {
    for (const auto& [process, run] : running) kill(process, signal);
  };
  for (;;) {
    while (running.size() < at_a_time && next < runs.size() && interrupted() == 0) {
      SweepRun& run = runs[next];
      const pid_t process = start(run.words, run.directory.string() + ".log");
      // Where the system has no room for a process it may have some once another one has ended.
      if (process < 0 && running.empty())
        throw RunError("a run cannot be started: the system has no room for another process");
      if (process < 0) break;
      running[process] = &run;
      ++next;
    }
    if (running.empty()) return done == runs.size();
    if (progress.due()) {
      progress.show(static_cast<double>(done) / static_cast<double>(runs.size()),
                    progress_text(done, runs.size(), begun));
    }
    int status = 0;
    const auto found = running.find(waitpid(-1, &status, WNOHANG));
    if (found == running.end()) {
      if (interrupted() != 0 && !patience) {
        patience = Clock::now() + kGrace;
        tell(SIGTERM);
      }
      if (patience && Clock::now() > *patience) tell(SIGKILL);
      std::this_thread::sleep_for(kPoll);
      continue;
    }
    SweepRun& run = *found->second;
    running.erase(found);
    if (interrupted() != 0) continue;  // how a run ends that was told to says nothing of it
    run.well = WIFEXITED(status) && WEXITSTATUS(status) == 0;
    progress.clear();
    ended(run);
    ++done;
  }
}

std::string last_words(const SweepRun& run) {
  std::ifstream stream(run.directory.string() + ".log");
  std::string line, last;
  while (std::getline(stream, line)) {
    if (!line.empty()) last = line;
  }
  return last.empty() ? "it said nothing; is the disk full?" : last;
}

}  // namespace kilotwin::cli
