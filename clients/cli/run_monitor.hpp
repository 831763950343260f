/// The residual monitor of a run or of its replay: its options, and its alarms as lines and as a table.
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "clients/monitor/monitor.hpp"
#include "core/federation/run_observer.hpp"
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
  /// Writes the table and the lines of alarms to `table` (.csv) and beside it (.txt) as they come; an empty path: nowhere. Throws
  /// UserError if the monitor has nothing to watch.
  RunMonitor(const RunPlan& plan, const MonitorOptions& options, std::filesystem::path table);

  void tracker_sample(const TrackerSample& sample) { monitor_.take(sample); }
  void observed(const proto::Observations& observations);
  /// Prints alarms as they come.
  void state(const SwarmView& swarm);
  [[nodiscard]] const std::vector<monitor::Alarm>& alarms() const { return alarms_; }
  /// For summary.json.
  [[nodiscard]] std::string report() const;

 private:
  const monitor::MonitorSettings settings_;
  const std::filesystem::path table_;
  monitor::Monitor monitor_;
  std::vector<monitor::Alarm> alarms_;
  std::string rows_, lines_;  ///< of all alarms
};

/// The file of lines beside a table of alarms.
[[nodiscard]] std::filesystem::path alarm_lines(std::filesystem::path table);

}  // namespace kilotwin::cli
