#include "clients/cli/sweep_runs.hpp"

#include <fmt/format.h>

#include <chrono>
#include <thread>

#include "clients/cli/other_program.hpp"
#include "clients/cli/progress.hpp"
#include "clients/cli/sweep_designs.hpp"
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
  options.program = main_program();
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

std::vector<std::string> run_words(const RunArguments& arguments, const SweepPoint& point,
                                   std::optional<std::uint64_t> seed, const std::filesystem::path& directory) {
  std::vector<std::string> words{
      "kilotwin", "run", arguments.experiment.string(), "--mode", "local", "--quiet", "--out", directory.string()};
  if (seed) words.insert(words.end(), {"--seed", std::to_string(*seed)});
  for (const std::string& set : point) {
    if (is_model(set))
      words.insert(words.end(), {"--model", set.substr(set.find('=') + 1)});
    else
      words.insert(words.end(), {"--set", set});
  }
  for (const std::string& define : arguments.define) words.insert(words.end(), {"--define", define});
  if (!arguments.kilolib.empty()) words.insert(words.end(), {"--kilolib", arguments.kilolib});
  if (arguments.duration_s) words.insert(words.end(), {"--duration", fmt::format("{}", *arguments.duration_s)});
  if (arguments.robots) words.insert(words.end(), {"--robots", std::to_string(*arguments.robots)});
  if (!arguments.behaviour.empty()) words.insert(words.end(), {"--behaviour", arguments.behaviour.string()});
  if (!arguments.model.empty()) words.insert(words.end(), {"--model", arguments.model.string()});
  if (arguments.strict) words.emplace_back("--strict");
  return words;
}

bool run_all(std::vector<SweepRun>& runs, std::size_t at_a_time, const std::function<void(const SweepRun&)>& ended,
             bool shown) {
  os::Children children;
  Progress progress(shown);
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
