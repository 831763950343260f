#include "clients/cli/run_monitor.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <utility>

#include "clients/monitor/report.hpp"
#include "core/base/error.hpp"
#include "core/base/say.hpp"
#include "core/observations/events.hpp"
#include "core/os/files.hpp"
#include "idl/recording.pb.h"

namespace kilotwin::cli {

void add_monitor_options(CLI::App& app, MonitorOptions& options) {
  using monitor::kLeastFalseAlarms_per_hour, monitor::kMostFalseAlarms_per_hour;
  CLI::Option* const on =
      app.add_flag("--monitor", options.on, "compare tracked robots with the model, and raise alarms");
  app.add_option("--false-alarms", options.settings.false_alarms_per_hour,
                 "with --monitor: bound of the mean rate of false alarms, per hour")
      ->check(CLI::Range(kLeastFalseAlarms_per_hour, kMostFalseAlarms_per_hour).description(""))
      ->capture_default_str()
      ->type_name("RATE")
      ->needs(on);
  app.add_option("--warm-up", options.settings.warm_up_s,
                 "with --monitor: motor-on time in which each robot's bias is learned")
      ->check(CLI::Range(monitor::kLeastWarmUp_s, monitor::kMostWarmUp_s).description(""))
      ->capture_default_str()
      ->type_name("SECONDS")
      ->needs(on);
  app.add_option("--commands", options.commands,
                 "with --monitor: declared commands of tracked robots, a table of robot,time_s,motion")
      ->type_name("FILE")
      ->needs(on);
  app.add_option("--station-commands", options.station_commands,
                 "with --monitor: types of the station's messages to robots that command motions, such as "
                 "1=left,2=right,3=stop,4=straight")
      ->type_name("TYPE=MOTION,...")
      ->needs(on);
}

void check_monitor_options(const MonitorOptions& options) {
  if (!options.commands.empty()) static_cast<void>(monitor::CommandTable(options.commands));
  if (!options.station_commands.empty()) static_cast<void>(monitor::station_commands_of(options.station_commands));
}

std::vector<std::string> monitor_words(const MonitorOptions& options) {
  if (!options.on) return {};
  std::vector<std::string> words{"--monitor", "--false-alarms",
                                 fmt::format("{}", options.settings.false_alarms_per_hour), "--warm-up",
                                 fmt::format("{}", options.settings.warm_up_s)};
  if (!options.commands.empty())
    words.insert(words.end(), {"--commands", std::filesystem::absolute(options.commands).string()});
  if (!options.station_commands.empty())
    words.insert(words.end(), {"--station-commands", options.station_commands});
  return words;
}

namespace {

monitor::MonitorSettings monitor_settings(const RunPlan& plan, const MonitorOptions& options) {
  monitor::MonitorSettings settings = options.settings;
  if (options.station_commands.empty()) return settings;
  if (!RecordedEvents(plan).station) {
    throw UserError(
        "--station-commands: the run does not record what the station sends; add event: STATION to the "
        "experiment's "
        "recording block");
  }
  settings.station_commands = monitor::station_commands_of(options.station_commands);
  return settings;
}

}  // namespace

RunMonitor::RunMonitor(const RunPlan& plan, const MonitorOptions& options, std::filesystem::path table)
    : settings_(monitor_settings(plan, options)),
      table_(std::move(table)),
      monitor_(plan, settings_,
               options.commands.empty() ? monitor::CommandTable() : monitor::CommandTable(options.commands)),
      rows_(monitor::table_header() + "\n") {
  if (table_.empty()) return;
  os::write_file(table_, rows_);
  os::write_file(alarm_lines(table_), lines_);
  residuals_.emplace(residual_table(table_), os::OutputFile::Existing::kReplace);
  residuals_->buffer() += monitor::residuals_header() + "\n";
  residuals_->flush();
}

/// Once per second of simulated time: whoever follows the file sees whole rows.
void RunMonitor::write_residuals() {
  const std::vector<monitor::Residual> fresh = monitor_.take_residuals();
  if (fresh.empty() || !residuals_) return;
  for (const monitor::Residual& residual : fresh) residuals_->buffer() += monitor::residuals_row(residual) + "\n";
  residuals_->flush();
}

void RunMonitor::observed(const proto::Observations& observations) {
  for (const proto::EventRecord& event : observations.event()) monitor_.take(event);
}

void RunMonitor::state(const SwarmView& swarm) {
  monitor_.advance(swarm);
  write_residuals();
  std::vector<monitor::Alarm> fresh = monitor_.take_alarms();
  if (fresh.empty()) return;
  for (monitor::Alarm& alarm : fresh) {
    const std::string line = monitor::line_of(alarm);
    say(line);
    lines_ += line + "\n";
    rows_ += monitor::table_row(alarm) + "\n";
    alarms_.push_back(std::move(alarm));
  }
  if (table_.empty()) return;
  // Alarms are rare: each time, the files are rewritten and replaced whole.
  os::write_file(table_, rows_);
  os::write_file(alarm_lines(table_), lines_);
}

std::string RunMonitor::report() const { return monitor::report_json(settings_, monitor_.totals(), alarms_); }

std::filesystem::path alarm_lines(std::filesystem::path table) { return table.replace_extension(".txt"); }

std::filesystem::path residual_table(const std::filesystem::path& table) {
  std::string name = table.filename().string();
  if (const std::size_t at = name.find("alarms"); at != std::string::npos) name.replace(at, 6, "residuals");
  return table.parent_path() / name;
}

}  // namespace kilotwin::cli
