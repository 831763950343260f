#include "clients/cli/launcher.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <mutex>
#include <optional>
#include <thread>

#include "clients/cli/commands.hpp"
#include "clients/cli/progress.hpp"
#include "clients/cli/recovery.hpp"
#include "clients/cli/run_monitor.hpp"
#include "core/base/error.hpp"
#include "core/base/say.hpp"
#include "core/federation/session.hpp"
#include "core/os/children.hpp"
#include "core/os/files.hpp"
#include "core/os/interrupt.hpp"
#include "services/behaviours/running_note.hpp"

namespace kilotwin::cli {
namespace {

namespace fs = std::filesystem;
using Clock = os::Children::Clock;

/// Time for services to leave by themselves after the run has failed or was interrupted.
constexpr auto kGrace = std::chrono::milliseconds(3000);
constexpr auto kPoll = std::chrono::milliseconds(5);

/// The last line of a service's log, without the prefix "kilotwin: ".
std::string last_message(const os::Child& service) {
  const std::string line = service.last_line();
  std::string_view text = error_text(line);
  constexpr std::string_view kPrefix = "kilotwin: ";
  if (text.starts_with(kPrefix)) text.remove_prefix(kPrefix.size());
  return std::string(text);
}

class Launcher {
 public:
  Launcher(const RunPlan& plan, const recorder::RunDirectory& directory, const LaunchOptions& options)
      : plan_(plan), directory_(directory), options_(options), progress_(plan, options.show_progress) {}

  int run() {
    std::error_code ignored;
    fs::create_directories(directory_.path() / "logs", ignored);
    std::vector<std::string> station{"station"};
    station.insert(station.end(), options_.monitor.begin(), options_.monitor.end());
    start(plan_.station(), station);
    start(plan_.radio(), {"comm"});
    for (std::uint32_t p = 0; p < plan_.grid.size(); ++p) {
      start(plan_.physics(PartitionId{p}),
            {"physics", "--partition", fmt::format("{},{}", p % plan_.grid.columns(), p / plan_.grid.columns())});
    }
    for (std::uint32_t h = 0; h < plan_.hosts; ++h) {
      start(plan_.behaviours(HostId{h}), {"behaviours", "--share", fmt::format("{}/{}", h + 1, plan_.hosts)});
    }
    // The launcher reads the public topics, like any other client.
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

  /// The robot whose program crashed its host, if that ended the run.
  [[nodiscard]] const std::optional<behaviours::Culprit>& corrupted_by() const { return corrupted_by_; }

 private:
  void start(FederateId id, std::vector<std::string> words) {
    const std::string name = plan_.name(id);
    std::string file = name;
    std::replace_if(
        file.begin(), file.end(), [](char c) { return c == ' ' || c == ',' || c == '/'; }, '-');
    words.insert(words.begin(), {"kilotwin", "service"});
    words.insert(words.end(), {"--run", directory_.path().string(), "--domain", std::to_string(options_.domain),
                               "--start-monotonic", fmt::format("{:.6f}", options_.start_monotonic_s),
                               "--give-up-after", fmt::format("{}", options_.give_up_after_s)});
    if (options_.realtime) words.emplace_back("--realtime");
    os::ChildOptions options;
    options.log = directory_.path() / "logs" / (file + ".log");
    options.own_group = true;  // the terminal's Ctrl-C must reach only the launcher, which ends the run in order
    options.tag = id.value();
    services_.start(name, std::move(words), options);
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
    // While the run is starting, show only waits.
    started_ = started_ || sample.phase != kilotwin_open_STARTING || sample.note[0] != '\0';
  }

  void on_member(const WireMember& sample) {
    // kLeft marks federates that left because another one failed. The first failure without it is the cause.
    const std::string_view failure = sample.failure;
    if (sample.phase != kilotwin_wire_FAILED || failure.starts_with(kLeft)) return;
    const std::lock_guard lock(mutex_);
    if (cause_.empty()) cause_ = fmt::format("{}: {}", sample.name, failure);
  }

  /// Collects services that have ended, and finds the first one whose failure ended the run.
  void reap() {
    for (os::Child& service : services_.reap()) {
      const os::ProcessEnd end = *service.process().poll();
      // Bad input gives status 2, whichever service reports it first.
      refused_ = refused_ || (end.signal == 0 && end.code == kBadInput);
      if (end.well() || interrupted_ || broken_) continue;
      broken_ = true;
      for (std::uint32_t h = 0; h < plan_.hosts && os::crashed(end); ++h) {
        if (plan_.behaviours(HostId{h}).value() == service.tag())
          corrupted_by_ = behaviours::take_note(directory_.path(), HostId{h});
      }
      if (!corrupted_by_) report_failure(service, end);
      services_.allow_until(Clock::now() + (corrupted_by_ ? std::chrono::milliseconds(0) : kGrace));
    }
  }

  /// Prints lines that the station's monitor has added to its file.
  void show_alarms() {
    const fs::path file = alarm_lines(directory_.alarms());
    std::error_code error;
    const std::uintmax_t size = fs::file_size(file, error);
    if (error || size == alarm_octets_) return;
    const std::string lines = os::read_file(file);
    if (lines.size() < alarm_octets_) alarm_octets_ = 0;  // a further attempt at the run
    progress_.clear();
    for (std::size_t end; (end = lines.find('\n', alarm_octets_)) != std::string::npos; alarm_octets_ = end + 1)
      say(lines.substr(alarm_octets_, end - alarm_octets_));
  }

  int watch() {
    while (services_.running() > 0) {
      reap();
      if (interrupted() != 0 && !interrupted_) {
        interrupted_ = true;
        services_.signal(plan_.station().value(), SIGTERM);  // the station ends the run by a directive
        services_.allow_until(Clock::now() + kGrace);
      }
      if (!options_.monitor.empty()) show_alarms();
      {
        const std::lock_guard lock(mutex_);
        if (started_ && !interrupted_ && !broken_) progress_.show(latest_);
      }
      std::this_thread::sleep_for(kPoll);
    }
    if (!options_.monitor.empty()) show_alarms();
    progress_.clear();
    if (broken_) return refused_ ? kBadInput : kFailed;
    if (interrupted_) {
      say_error(
          fmt::format("kilotwin: interrupted; what was recorded so far is in {}", directory_.path().string()));
      return kFailed;
    }
    return kDone;
  }

  /// Prints the failed service immediately, before the clean-up.
  void report_failure(os::Child& service, const os::ProcessEnd& end) {
    progress_.clear();
    const std::string so_far = "what was recorded so far is in " + directory_.path().string();
    if (end.signal != 0) {
      return say_error(fmt::format("kilotwin: {} (process {}) {}; {}", service.name(), service.process().id(),
                                   os::in_words(end), so_far));
    }
    const std::string line = last_message(service);
    if (end.code == kBadInput) return say_error(line);
    const std::lock_guard lock(mutex_);
    const std::string why =
        !cause_.empty()
            ? cause_
            : fmt::format("{}: {}", service.name(),
                          line.empty() ? os::in_words(end) + " and printed nothing; is the disk full?" : line);
    say_error(fmt::format("kilotwin: {}; {}", why, so_far));
  }

  const RunPlan& plan_;
  const recorder::RunDirectory& directory_;
  const LaunchOptions& options_;
  ProgressBar progress_;
  os::Children services_;
  std::optional<behaviours::Culprit> corrupted_by_;
  std::size_t alarm_octets_ = 0;  ///< of the lines of alarms that were printed
  bool interrupted_ = false, broken_ = false, refused_ = false;
  std::mutex mutex_;  // guards the members below
  RunProgress latest_;
  bool started_ = false;
  std::string cause_;  // failure text of the first federate that did not leave because of another
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
