/// The monitor's part of summary.json.
#pragma once

#include <span>
#include <string>

#include "clients/monitor/monitor.hpp"

namespace kilotwin::monitor {

/// A JSON object: settings, what was watched, how well the model fits, and the alarms.
[[nodiscard]] std::string report_json(const MonitorSettings& settings, const Totals& totals,
                                      std::span<const Alarm> alarms);

}  // namespace kilotwin::monitor
