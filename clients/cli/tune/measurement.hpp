/// The measure that `kilotwin tune` optimises: an observable at the end of runs.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "clients/cli/run_arguments.hpp"
#include "clients/cli/sweep_points.hpp"
#include "clients/tune/parameter.hpp"
#include "clients/tune/tuner.hpp"

namespace kilotwin::cli {

/// How the values of several models make one.
enum class OverModels { kMean, kWorst };

struct Goal {
  std::string observable;
  bool largest = true;                        ///< false: the smallest is best
  std::vector<std::filesystem::path> models;  ///< each point runs with all; empty: the experiment's model
  OverModels over_models = OverModels::kMean;
};

/// Runs of points. Each is a local run in a process of its own; its directory is removed once it is read.
class Measurement {
 public:
  Measurement(RunArguments run, std::vector<tune::Parameter> parameters, Goal goal, std::filesystem::path scratch,
              std::size_t at_a_time, std::function<void(std::size_t runs)> ran);

  /// tune::Measure. With several models a value is the mean, or the worst, of one run per model with the same seed.
  [[nodiscard]] std::vector<double> of(const tune::Point& point, std::uint64_t first_seed, std::size_t count);
  /// The same for the experiment as it stands.
  [[nodiscard]] std::vector<double> of_present(std::uint64_t first_seed, std::size_t count);
  /// --set of the parameters that are fields, --define of those that are macros.
  [[nodiscard]] RunArguments arguments_at(const tune::Point& point) const;

  /// Why the last run that failed did so; empty if none failed.
  [[nodiscard]] const std::string& last_failure() const { return last_failure_; }
  [[nodiscard]] bool interrupted() const { return interrupted_; }
  /// Number of runs until now in which robots failed.
  [[nodiscard]] std::size_t runs_with_failed_robots() const { return runs_with_failed_robots_; }

 private:
  void note_failed_robots(const std::filesystem::path& run);
  [[nodiscard]] std::vector<double> measure(const RunArguments& arguments, std::uint64_t first_seed,
                                            std::size_t count);

  const RunArguments run_;
  const std::vector<tune::Parameter> parameters_;
  const Goal goal_;
  const std::filesystem::path scratch_;
  const std::size_t at_a_time_;
  const std::function<void(std::size_t)> ran_;
  std::string last_failure_;
  std::size_t runs_ = 0, runs_with_failed_robots_ = 0;
  bool interrupted_ = false;
};

}  // namespace kilotwin::cli
