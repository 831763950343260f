/// Logs of trackers, of ARK's experiments and of LARS, as experiments with tracked robots and as tracks.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "clients/importers/imported.hpp"
#include "idl/door.pb.h"

namespace kilotwin::importers {

struct LogOptions {
  std::optional<proto::LogDoor::Format> format;  ///< nothing: the first line tells
  std::optional<double> unit_mm;                 ///< mm per pixel; LARS needs it; nothing: 1 for ARK
};

struct ImportedLog {
  Imported imported;   ///< the robots begin where the log first shows them
  std::string tracks;  ///< trajectories.csv, as `kilotwin identify` reads it; robots have the log's numbers
};

/// Reads the whole log. Throws UserError: "FILE:LINE:COLUMN: ..." for a line that is none of a log, or if there is no robot.
[[nodiscard]] ImportedLog from_tracker_log(const std::filesystem::path& file, const LogOptions& options);

}  // namespace kilotwin::importers
