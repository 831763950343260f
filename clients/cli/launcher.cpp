#include "clients/cli/launcher.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <mutex>
#include <optional>
#include <thread>

#include "clients/cli/progress.hpp"
#include "clients/cli/recovery.hpp"
#include "core/base/error.hpp"
#include "core/base/say.hpp"
#include "core/federation/session.hpp"
#include "core/os/interrupt.hpp"
#include "services/behaviours/running_note.hpp"

namespace kilotwin::cli {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

/// For how long services may take to leave after a signal.
constexpr auto kGrace = std::chrono::milliseconds(3000);
constexpr auto kPoll = std::chrono::milliseconds(5);

struct Child {
  std::string name;
  pid_t process = -1;
  int log = -1;  ///< what it says on stderr
  bool running = false;
  int status = 0;
  std::optional<HostId> host;  ///< of behaviours
};

/// The last line of a service's log, without time stamp, name, level and the prefix "kilotwin: ". By descriptor: the file may have been removed.
std::string last_line(int log) {
  char tail[4096];
  struct stat status {};
  if (log < 0 || fstat(log, &status) != 0) return {};
  const ssize_t octets =
      pread(log, tail, sizeof tail, std::max<off_t>(0, status.st_size - static_cast<off_t>(sizeof tail)));
  std::string_view text(tail, static_cast<std::size_t>(std::max<ssize_t>(0, octets)));
  text = text.substr(0, text.find_last_not_of('\n') + 1);
  if (const std::size_t before = text.rfind('\n'); before != std::string_view::npos) text.remove_prefix(before + 1);
  text = error_text(text);
  constexpr std::string_view kPrefix = "kilotwin: ";
  if (text.starts_with(kPrefix)) text.remove_prefix(kPrefix.size());
  return std::string(text);
}

class Launcher {
 public:
  Launcher(const RunPlan& plan, const recorder::RunDirectory& directory, const LaunchOptions& options)
      : plan_(plan), directory_(directory), options_(options), progress_(plan, options.show_progress) {}

  ~Launcher() {
    end_all();
    for (const Child& child : children_) {
      if (child.log >= 0) close(child.log);
    }
  }

  int run() {
    std::error_code ignored;
    fs::create_directories(directory_.path() / "logs", ignored);
    start(plan_.station(), {"station"});
    start(plan_.radio(), {"comm"});
    for (std::uint32_t p = 0; p < plan_.grid.size(); ++p) {
      start(plan_.physics(PartitionId{p}),
            {"physics", "--partition", fmt::format("{},{}", p % plan_.grid.columns(), p / plan_.grid.columns())});
    }
    for (std::uint32_t h = 0; h < plan_.hosts; ++h) {
      start(plan_.behaviours(HostId{h}), {"behaviours", "--share", fmt::format("{}/{}", h + 1, plan_.hosts)});
      children_.back().host = HostId{h};
    }
    // The launcher watches as any observer may.
    const dds::Participant participant({options_.domain, {}});
    const dds::Reader<PublicRunStatus> status(participant, topics::run_status(),
                                              [this](const PublicRunStatus& sample, dds::SampleState state) {
                                                if (state.valid && sample.run == plan_.run()) on_status(sample);
                                              });
    const dds::Reader<WireMember> members(participant, topics::members(),
                                          [this](const WireMember& sample, dds::SampleState state) {
                                            if (state.valid && sample.run == plan_.run()) on_member(sample);
                                          });
    return watch();
  }

  /// Whose program has brought down its host, where that is what ended the run.
  [[nodiscard]] const std::optional<behaviours::Culprit>& corrupted_by() const { return corrupted_by_; }

 private:
  void start(FederateId id, std::vector<std::string> words) {
    Child child;
    child.name = plan_.name(id);
    std::string file = child.name;
    std::replace_if(
        file.begin(), file.end(), [](char c) { return c == ' ' || c == ',' || c == '/'; }, '-');
    words.insert(words.begin(), {"kilotwin", "service"});
    words.insert(words.end(), {"--run", directory_.path().string(), "--domain", std::to_string(options_.domain),
                               "--start-monotonic", fmt::format("{:.6f}", options_.start_monotonic_s),
                               "--give-up-after", fmt::format("{}", options_.give_up_after_s)});
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    const fs::path log = directory_.path() / "logs" / (file + ".log");
    child.log = open(log.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_APPEND | O_CLOEXEC, 0644);
    const pid_t parent = getpid();
    child.process = fork();
    if (child.process < 0)
      throw RunError(fmt::format("{} cannot be started: the system has no room for another process", child.name));
    if (child.process == 0) {
      // Only calls that are safe between fork and exec. A group of its own keeps the terminal's Ctrl-C from it: the
      // launcher decides how the run ends. The signal at its parent's death outlives exec.
      setpgid(0, 0);
      prctl(PR_SET_PDEATHSIG, SIGTERM);
      if (getppid() != parent) _exit(1);
      if (child.log >= 0) dup2(child.log, STDERR_FILENO);
      if (const int nothing = open("/dev/null", O_RDWR); nothing >= 0) {
        dup2(nothing, STDIN_FILENO);
        dup2(nothing, STDOUT_FILENO);
      }
      execv("/proc/self/exe", argv.data());
      _exit(127);
    }
    child.running = true;
    children_.push_back(std::move(child));
  }

  void on_status(const PublicRunStatus& sample) {
    const std::lock_guard lock(mutex_);
    latest_.now = Tick{sample.tick};
    latest_.wall_s = sample.wall_s;
    latest_.sent = sample.sent;
    latest_.received = sample.received;
    latest_.robots_failed = sample.robots_failed;
    latest_.paused = sample.phase == kilotwin_open_PAUSED;
    const bool over = sample.phase == kilotwin_open_ENDED || sample.phase == kilotwin_open_BROKEN;
    latest_.waiting_for = over ? "" : sample.note;
    // While it starts there is something to show only if it waits for somebody.
    started_ = started_ || sample.phase != kilotwin_open_STARTING || sample.note[0] != '\0';
  }

  void on_member(const WireMember& sample) {
    // Whoever left because of another says so; the first of the others is where it broke.
    const std::string_view failure = sample.failure;
    if (sample.phase != kilotwin_wire_FAILED || failure.starts_with(kLeft)) return;
    const std::lock_guard lock(mutex_);
    if (told_.empty()) told_ = fmt::format("{}: {}", sample.name, failure);
  }

  /// Collects children that have ended; true while any runs.
  bool reap() {
    bool any = false;
    for (Child& child : children_) {
      if (!child.running) continue;
      int status = 0;
      if (waitpid(child.process, &status, WNOHANG) != child.process) {
        any = true;
        continue;
      }
      child.running = false;
      child.status = status;
      const bool well = WIFEXITED(status) && WEXITSTATUS(status) == 0;
      if (!well && !ending_ && !interrupted_ && culprit_ == nullptr) {
        // The first to end is the culprit: services that only noticed its loss end later.
        culprit_ = &child;
        if (child.host && brought_itself_down(status))
          corrupted_by_ = behaviours::take_note(directory_.path(), *child.host);
        if (!corrupted_by_) name_culprit();
        deadline_ = Clock::now() + (corrupted_by_ ? std::chrono::milliseconds(0) : kGrace);
      }
    }
    return any;
  }

  int watch() {
    bool stop_sent = false;
    while (reap()) {
      if (interrupted() != 0 && !stop_sent) {
        stop_sent = true;
        interrupted_ = true;
        if (children_[0].running) kill(children_[0].process, SIGTERM);  // the station ends the run in order
        deadline_ = Clock::now() + kGrace;
      }
      if (deadline_ && Clock::now() > *deadline_) end_all();
      {
        const std::lock_guard lock(mutex_);
        if (started_ && !interrupted_ && culprit_ == nullptr) progress_.show(latest_);
      }
      std::this_thread::sleep_for(kPoll);
    }
    progress_.clear();
    if (culprit_ == nullptr && interrupted_) {
      say_error(
          fmt::format("kilotwin: interrupted; what was recorded so far is in {}", directory_.path().string()));
      return 1;
    }
    // Bad input is bad input, whichever service finds it first or leaves first because of it.
    const auto refused = [](const Child& child) {
      return WIFEXITED(child.status) && WEXITSTATUS(child.status) == 2;
    };
    if (culprit_ != nullptr && std::any_of(children_.begin(), children_.end(), refused)) return 2;
    return status_;
  }

  /// Says who broke the run, at once: what follows is only cleaning up.
  void name_culprit() {
    progress_.clear();
    const std::string so_far = "what was recorded so far is in " + directory_.path().string();
    status_ = 1;
    if (WIFSIGNALED(culprit_->status)) {
      say_error(fmt::format("kilotwin: {} (process {}) was killed by signal {}; {}", culprit_->name,
                            culprit_->process, WTERMSIG(culprit_->status), so_far));
      return;
    }
    const std::string line = last_line(culprit_->log);
    if (WEXITSTATUS(culprit_->status) == 2) {
      status_ = 2;
      return say_error(line);
    }
    const std::lock_guard lock(mutex_);
    const std::string why = !told_.empty()
                                ? told_
                                : fmt::format("{}: {}", culprit_->name,
                                              line.empty() ? "failed without a word; is the disk full?" : line);
    say_error(fmt::format("kilotwin: {}; {}", why, so_far));
  }

  /// Ends every child, by force if need be.
  void end_all() {
    ending_ = true;  // what ends from now on ends by our signal
    for (const int signal : {SIGTERM, SIGKILL}) {
      for (const Child& child : children_) {
        if (child.running) kill(child.process, signal);
      }
      const auto patience =
          Clock::now() + (signal == SIGTERM ? std::chrono::milliseconds(1000) : std::chrono::milliseconds(5000));
      while (reap() && Clock::now() < patience) std::this_thread::sleep_for(kPoll);
    }
  }

  const RunPlan& plan_;
  const recorder::RunDirectory& directory_;
  const LaunchOptions& options_;
  ProgressBar progress_;
  std::vector<Child> children_;
  const Child* culprit_ = nullptr;
  std::optional<behaviours::Culprit> corrupted_by_;
  int status_ = 0;
  std::optional<Clock::time_point> deadline_;
  bool interrupted_ = false, ending_ = false;
  std::mutex mutex_;  // guards what follows
  RunProgress latest_;
  bool started_ = false;
  std::string told_;  // what the first federate that failed on its own said
};

}  // namespace

int launch(const RunPlan& plan, const recorder::RunDirectory& directory, const LaunchOptions& options) {
  proto::Manifest manifest = plan.manifest();
  for (;;) {
    const RunPlan attempt(manifest);
    std::optional<behaviours::Culprit> culprit;
    {
      Launcher launcher(attempt, directory, options);
      const int status = launcher.run();
      culprit = launcher.corrupted_by();
      if (!culprit) {
        if (status == 0) forget_attempts(directory);
        return status;
      }
    }
    recover(directory, manifest, {&*culprit, 1});
  }
}

}  // namespace kilotwin::cli
