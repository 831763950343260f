/// The checks of an experiment that need no poses of robots: ranges (fields.hpp), and what fields demand of each other. All
/// throw UserError "WHERE: what is wrong; what would be right".
#pragma once

#include <cstdint>

#include "core/experiment/load.hpp"

namespace kilotwin {

/// All of them.
void check_fields(const LoadedExperiment& loaded);
/// Those that read no other file: also for an experiment out of a manifest.
void check_values(const LoadedExperiment& loaded);
/// Those of `effect` and `field`, whose numbers are in their ranges.
void check_effects(const LoadedExperiment& loaded);
/// Those of the infrared channel that the table of ranges cannot express.
void check_radio(const LoadedExperiment& loaded);

/// How many robots the group has, by its count or, where that is absent, by its rings. 0: only its CSV file knows.
[[nodiscard]] std::uint64_t stated_count(const proto::RobotGroup& group);

/// The total over all groups, which is known once the CSV files of layouts have been read, and what depends on it.
void check_total(const LoadedExperiment& loaded, std::uint64_t robots);

}  // namespace kilotwin
