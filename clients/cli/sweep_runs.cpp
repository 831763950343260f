#include "clients/cli/sweep_runs.hpp"

#include <fmt/format.h>

#include <chrono>
#include <thread>

#include "clients/cli/progress.hpp"
#include "core/base/error.hpp"
#include "core/os/children.hpp"
#include "core/os/interrupt.hpp"

namespace kilotwin::cli {
namespace {

using Clock = os::Children::Clock;

constexpr auto kPoll = std::chrono::milliseconds(2);
/// Time for runs to end after SIGTERM.
constexpr auto kGrace = std::chrono::milliseconds(3000);

/// Starts run `index`. Returns false if the system currently has no room for another process.
bool start(os::Children& children, const SweepRun& run, std::size_t index) {
  os::ChildOptions options;
  options.log = run.directory.string() + ".log";
  options.output_to_log = true;
  options.tag = index;
  try {
    children.start("a run", run.words, options);
    return true;
  } catch (const RunError&) {
    if (children.running() == 0) throw;
    return false;
  }
}

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
  os::Children children;
  Progress progress(true);
  const auto begun = Clock::now();
  std::size_t next = 0, done = 0;
  for (;;) {
    while (children.running() < at_a_time && next < runs.size() && interrupted() == 0) {
      if (!start(children, runs[next], next)) break;
      ++next;
    }
    if (children.running() == 0) return done == runs.size();
    if (interrupted() != 0) children.allow_until(Clock::now(), kGrace);
    for (os::Child& child : children.reap()) {
      if (interrupted() != 0) continue;  // the run was ended on request, so its status means nothing
      SweepRun& run = runs[child.tag()];
      run.well = child.process().poll()->well();
      run.last_line = child.last_line();
      progress.clear();
      ended(run);
      ++done;
    }
    if (progress.due())
      progress.show(static_cast<double>(done) / static_cast<double>(runs.size()),
                    progress_text(done, runs.size(), begun));
    std::this_thread::sleep_for(kPoll);
  }
}

}  // namespace kilotwin::cli
