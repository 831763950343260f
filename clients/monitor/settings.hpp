/// Settings of the monitor that users may change.
#pragma once

#include "clients/monitor/station_commands.hpp"

namespace kilotwin::monitor {

struct MonitorSettings {
  /// Upper bound of the mean rate of false alarms of the whole experiment.
  double false_alarms_per_hour = 0.1;
  /// Motor-on time in which a robot's bias is learned before its tests begin.
  double warm_up_s = 30;
  /// Standard deviation of the time at which a robot follows a change of its command.
  double command_jitter_s = 0.05;
  /// Commands in the station's messages to robots that have neither a shadow program nor declared commands; empty: nothing.
  StationCommands station_commands{};
};

/// Bounds of the settings, for whoever reads them.
inline constexpr double kLeastFalseAlarms_per_hour = 1e-9, kMostFalseAlarms_per_hour = 1e3;
inline constexpr double kLeastWarmUp_s = 2, kMostWarmUp_s = 3600;

}  // namespace kilotwin::monitor
