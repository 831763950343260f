#include "clients/cli/tune/measurement.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "clients/cli/observable_choice.hpp"
#include "clients/cli/sweep_runs.hpp"
#include "clients/recorder/summary.hpp"

namespace kilotwin::cli {

namespace fs = std::filesystem;

Measurement::Measurement(RunArguments run, std::vector<tune::Parameter> parameters, Goal goal, fs::path scratch,
                         std::size_t at_a_time, std::function<void(std::size_t)> ran)
    : run_(std::move(run)),
      parameters_(std::move(parameters)),
      goal_(std::move(goal)),
      scratch_(std::move(scratch)),
      at_a_time_(at_a_time),
      ran_(std::move(ran)) {}

RunArguments Measurement::arguments_at(const tune::Point& point) const {
  RunArguments arguments = run_;
  for (std::size_t i = 0; i < parameters_.size(); ++i)
    (parameters_[i].macro ? arguments.define : arguments.set).push_back(setting_at(parameters_[i], point[i]));
  return arguments;
}

std::vector<double> Measurement::of(const tune::Point& point, std::uint64_t first_seed, std::size_t count) {
  return measure(arguments_at(point), first_seed, count);
}

std::vector<double> Measurement::of_present(std::uint64_t first_seed, std::size_t count) {
  return measure(run_, first_seed, count);
}

void Measurement::note_failed_robots(const fs::path& run) {
  const fs::path summary = run / "summary.json";
  if (fs::exists(summary) && recorder::read_summary(summary).robots_failed > 0) ++runs_with_failed_robots_;
}

std::vector<double> Measurement::measure(const RunArguments& arguments, std::uint64_t first_seed,
                                         std::size_t count) {
  const std::size_t models = std::max<std::size_t>(1, goal_.models.size());
  std::vector<SweepRun> runs(count * models);
  for (std::size_t i = 0; i < runs.size(); ++i) {
    runs[i].point = i;
    runs[i].seed = first_seed + i / models;
    runs[i].directory = scratch_ / fmt::format("{:06}", runs_++);
    RunArguments one = arguments;
    if (!goal_.models.empty()) one.model = goal_.models[i % models];
    runs[i].words = run_words(one, one.set, runs[i].seed, runs[i].directory);
  }
  std::vector<double> of_runs(runs.size(), std::nan(""));
  const auto ended = [&](const SweepRun& run) {
    note_failed_robots(run.directory);
    if (run.well) {
      const double value = observable_at_end(run.directory, goal_.observable);
      of_runs[run.point] = goal_.largest ? value : -value;
      if (!std::isfinite(value)) last_failure_ = goal_.observable + " has no value at the end of the run";
    } else {
      last_failure_ = run.last_line.empty() ? "the run printed nothing; is the disk full?" : run.last_line;
    }
    std::error_code ignored;
    fs::remove_all(run.directory, ignored);
    fs::remove(run.directory.string() + ".log", ignored);
    ran_(1);
  };
  interrupted_ = !run_all(runs, at_a_time_, ended, false);
  std::vector<double> values(count);
  for (std::size_t i = 0; i < count; ++i) {
    const auto first = of_runs.begin() + static_cast<std::ptrdiff_t>(i * models);
    const std::vector<double> with_models(first, first + static_cast<std::ptrdiff_t>(models));
    const bool all = std::all_of(with_models.begin(), with_models.end(), [](double v) { return std::isfinite(v); });
    values[i] = !all ? std::nan("")
                : goal_.over_models == OverModels::kMean
                    ? tune::estimate(with_models).mean
                    : *std::min_element(with_models.begin(), with_models.end());
  }
  return values;
}

}  // namespace kilotwin::cli
