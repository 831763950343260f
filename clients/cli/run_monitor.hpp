/// The residual monitor of a run or of its replay: its options, its alarms as lines and as a table, and its
/// residuals as a table.
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "clients/monitor/monitor.hpp"
#include "core/federation/run_observer.hpp"
#include "core/os/files.hpp"
#include "core/plan/plan.hpp"

namespace CLI {
class App;
}

namespace kilotwin::cli {

struct MonitorOptions {
  bool on = false;
  monitor::MonitorSettings settings;
  std::filesystem::path commands;  ///< declared commands; empty: none
  std::string station_commands;    ///< what the station's messages command; empty: nothing
};

/// Adds --monitor and the options that go with it.
void add_monitor_options(CLI::App& app, MonitorOptions& options);
/// Throws UserError for options without --monitor, and for a table of commands that cannot be read.
void check_monitor_options(const MonitorOptions& options);
/// The options again as words of a command line; empty without --monitor.
[[nodiscard]] std::vector<std::string> monitor_words(const MonitorOptions& options);

class RunMonitor {
 public:
  /// Writes the table and the lines of alarms to `table` (.csv) and beside it (.txt) as they come, and residuals to
  /// residual_table(table); an empty path: nowhere. Throws UserError if the monitor has nothing to watch.
  RunMonitor(const RunPlan& plan, const MonitorOptions& options, std::filesystem::path table);

  void tracker_sample(const TrackerSample& sample) { monitor_.take(sample); }
  void observed(const proto::Observations& observations);
  /// Prints alarms as they come. Throws RunError if a table cannot be written.
  void state(const SwarmView& swarm);
  [[nodiscard]] const std::vector<monitor::Alarm>& alarms() const { return alarms_; }
  /// For summary.json.
  [[nodiscard]] std::string report() const;

 private:
  void write_residuals();

  const monitor::MonitorSettings settings_;
  const std::filesystem::path table_;
  monitor::Monitor monitor_;
  std::vector<monitor::Alarm> alarms_;
  std::string rows_, lines_;  ///< of all alarms
  std::optional<os::OutputFile> residuals_;
};

/// The file of lines beside a table of alarms.
[[nodiscard]] std::filesystem::path alarm_lines(std::filesystem::path table);
/// The file of residuals beside it: residuals.csv beside alarms.csv, residuals-replayed.csv beside alarms-replayed.csv.
[[nodiscard]] std::filesystem::path residual_table(const std::filesystem::path& table);

}  // namespace kilotwin::cli
