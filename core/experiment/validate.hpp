/// Whether an experiment makes sense: ranges (fields.hpp), what fields demand of each other, and the files it names.
#pragma once

#include <cstdint>
#include <vector>

#include "core/experiment/load.hpp"

namespace kilotwin {

/// Checks everything, the places of the robots included. Throws UserError "WHERE: what is wrong; what would be right".
void validate(const LoadedExperiment& loaded);

/// All that can be checked before robots are placed.
void validate_fields(const LoadedExperiment& loaded);
/// The part of it that reads no other file: also for an experiment out of a manifest.
void validate_values(const LoadedExperiment& loaded);
/// The part of it that is about `effect` and `field`, whose numbers are in their ranges.
void validate_effects(const LoadedExperiment& loaded);
/// The infrared channel: what the table of ranges cannot say.
void validate_radio(const LoadedExperiment& loaded);

/// How many robots the group has, by its count or, where that is absent, by its rings. 0: only its CSV file knows.
[[nodiscard]] std::uint64_t stated_count(const proto::RobotGroup& group);

/// Checks the total over all groups, known once the CSV files of layouts have been read, and what depends on it.
void validate_total(const LoadedExperiment& loaded, std::uint64_t robots);

}  // namespace kilotwin
