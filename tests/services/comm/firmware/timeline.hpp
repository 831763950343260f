/// Changes of robots' outputs over a run, to compare runs of the same source as native program and as firmware.
#pragma once

#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "clients/cli/prepare.hpp"
#include "clients/local/local_run.hpp"
#include "services/behaviours/program_set.hpp"

namespace kilotwin::firmware {

/// A change of a robot's motor duties or LED colour, at its tick.
struct Change {
  std::int64_t tick;
  std::uint32_t value;
  bool operator==(const Change&) const = default;
};

struct Timeline {
  std::vector<std::vector<Change>> motors, led;  ///< per robot
  std::vector<double> path_mm;                   ///< per robot
  RunTotals totals;
};

class TimelineObserver : public RunObserver {
 public:
  explicit TimelineObserver(std::uint32_t robots) {
    timeline.motors.resize(robots);
    timeline.led.resize(robots);
    timeline.path_mm.resize(robots);
  }
  void state(Tick tick, const SwarmView& swarm, bool) override {
    for (std::uint32_t robot = 0; robot < swarm.robots(); ++robot) {
      // A kick is shorter than a tick, so the duty at the tick's end may or may not include it.
      const bool kick = swarm.motor_left[robot] == 255 && swarm.motor_right[robot] == 255;
      if (!kick)
        note(timeline.motors[robot], tick, std::uint32_t{swarm.motor_left[robot]} << 8 | swarm.motor_right[robot]);
      note(timeline.led[robot], tick, swarm.led[robot]);
      if (!x_mm_.empty())
        timeline.path_mm[robot] += std::hypot(swarm.x_mm[robot] - x_mm_[robot], swarm.y_mm[robot] - y_mm_[robot]);
    }
    x_mm_ = swarm.x_mm;
    y_mm_ = swarm.y_mm;
  }
  void hash(Tick, std::uint64_t) override {}
  void input(const Directive&) override {}

  Timeline timeline;

 private:
  static void note(std::vector<Change>& changes, Tick tick, std::uint32_t value) {
    if (value != (changes.empty() ? 0 : changes.back().value)) changes.push_back({tick.count(), value});
  }

  std::vector<double> x_mm_, y_mm_;  // of the last tick
};

/// Runs an experiment locally. `folder`: directory for the experiment and its run; `inputs`: external ones; `before`: called with
/// the run directory before the run.
inline Timeline run_timeline(const std::string& experiment, const std::filesystem::path& folder,
                             std::uint32_t threads = 1, const std::vector<std::string>& set = {},
                             const std::vector<Directive>& inputs = {},
                             const std::function<void(const std::filesystem::path&)>& before = {}) {
  std::filesystem::create_directories(folder);
  const std::filesystem::path file = folder / "experiment.txtpb";
  std::ofstream(file) << experiment;
  cli::RunArguments arguments;
  arguments.experiment = file;
  arguments.mode = "local";
  arguments.output.out = folder / "run";
  arguments.set = set;
  const cli::Prepared prepared = cli::prepare(arguments);
  const RunPlan plan(prepared.manifest);
  local::LocalOptions options;
  options.threads = threads;
  options.run_directory = prepared.directory.path();
  options.inputs = inputs;
  if (before) before(options.run_directory);
  TimelineObserver observer(plan.robots());
  const auto programs = behaviours::ProgramSet::load(plan, options.run_directory);
  observer.timeline.totals = local::run(plan, programs, options, observer);
  return observer.timeline;
}

/// Number of changes in two histories, and number of changes that agree in order within a tick.
struct Agreement {
  std::size_t first = 0, second = 0, same = 0;
  [[nodiscard]] bool whole() const { return same == first && same == second; }
  Agreement& operator+=(const Agreement& other) {
    first += other.first;
    second += other.second;
    same += other.same;
    return *this;
  }
};

/// Omits changes in the last tick: the other history may have them one tick later.
inline Agreement agreement(const std::vector<Change>& first, const std::vector<Change>& second, std::int64_t end) {
  const auto length = [end](const std::vector<Change>& changes) {
    std::size_t n = changes.size();
    while (n > 0 && changes[n - 1].tick >= end - 1) --n;
    return n;
  };
  Agreement result{length(first), length(second), 0};
  for (std::size_t i = 0, j = 0; i < result.first && j < result.second;) {
    const std::int64_t late = second[j].tick - first[i].tick;
    if (first[i].value == second[j].value && late >= -1 && late <= 1) {
      ++result.same, ++i, ++j;
    } else if (first[i].tick <= second[j].tick) {
      ++i;
    } else {
      ++j;
    }
  }
  return result;
}

inline Agreement agreement(const std::vector<std::vector<Change>>& first,
                           const std::vector<std::vector<Change>>& second, std::int64_t end) {
  Agreement sum;
  for (std::size_t i = 0; i < first.size(); ++i) sum += agreement(first[i], second[i], end);
  return sum;
}

}  // namespace kilotwin::firmware
