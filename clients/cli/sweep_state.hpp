/// The state of a sweep on disk, so that it can go on after an interruption.
#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "clients/cli/sweep_points.hpp"
#include "clients/cli/sweep_runs.hpp"

namespace kilotwin::cli {

struct Resolved;

/// Contents of the files on which the results of a sweep's runs depend. Names of files do not count.
class SweepContent {
 public:
  /// Adds a point as resolved.
  void add(const Resolved& point);
  /// Adds a file that the words name. Throws UserError where it cannot be read.
  void add_file(const std::filesystem::path& file);

  /// SHA-256 of all points: places of robots, model, images, EEPROMs, without programs.
  [[nodiscard]] std::string experiment() const;
  /// SHA-256 of programs and plugins as compiled, and of other files, by name. One source may be compiled in several ways.
  [[nodiscard]] const std::map<std::string, std::set<std::string>>& files() const { return files_; }

 private:
  std::string points_;  ///< a hash per point, one after the other
  std::map<std::string, std::set<std::string>> files_;
};

/// Properties that must be equal if a sweep goes on. Seeds may differ.
struct SweepPlan {
  std::filesystem::path experiment;
  std::vector<SweepPoint> points;
  std::vector<std::string> words;  ///< options of the runs
  SweepContent content;
};
/// Writes it to DIR/sweep.json. Throws RunError.
void write_plan(const std::filesystem::path& directory, const SweepPlan& plan);
/// Throws UserError where the directory holds no sweep, or another one, or the sweep of other contents or of another build of Kilotwin.
void check_plan(const std::filesystem::path& directory, const SweepPlan& plan);

/// Whether the run's directory holds a run of its seed that came to its end without failure.
[[nodiscard]] bool is_complete(const SweepRun& run);
/// Removes what an interrupted run left behind, if anything.
void remove_unfinished(const SweepRun& run);

}  // namespace kilotwin::cli
