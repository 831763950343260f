/// Checks of an experiment that need no poses of robots: ranges (fields.hpp), and dependencies between fields. All functions throw
/// UserError "WHERE: what is wrong; what would be right".
#pragma once

#include <cstdint>

#include "core/experiment/load.hpp"

namespace kilotwin {

/// Makes all checks.
void check_fields(const LoadedExperiment& loaded);
/// Makes the checks that read no other file, so also for an experiment from a manifest.
void check_values(const LoadedExperiment& loaded);
/// Checks `effect` and `field`, whose numbers have been found in their ranges.
void check_effects(const LoadedExperiment& loaded);
/// Checks dependencies between fields of the infrared channel.
void check_radio(const LoadedExperiment& loaded);
/// Trackers, and what tracked robots say.
void check_tracking(const LoadedExperiment& loaded);

/// Number of robots in the group by its `count`, or by its rings if `count` is absent. 0: its CSV file gives the number.
[[nodiscard]] std::uint64_t stated_count(const proto::RobotGroup& group);

/// Checks the total number of robots, which is known after the layouts' CSV files have been read, and limits that depend on it.
void check_total(const LoadedExperiment& loaded, std::uint64_t robots);

}  // namespace kilotwin
