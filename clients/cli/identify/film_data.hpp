/// Films of robots as input of `kilotwin identify`: `kilotwin track` tracks them first.
#pragma once

#include <filesystem>
#include <vector>

#include "clients/identify/identify.hpp"

namespace kilotwin::cli {

/// Films of the directory (*.mp4, *.mkv, *.avi, *.mov, *.webm), sorted. Empty if it holds trajectories.csv[.gz].
[[nodiscard]] std::vector<std::filesystem::path> films_of(const std::filesystem::path& directory);

/// Writes a table of tracks per film into `to`, and copies commands.csv[.gz]. The calibration is camera.yaml or camera.xml beside the
/// films. Throws UserError on two films of one name, and RunError if `kilotwin track` fails, with its message.
void track_films(const std::filesystem::path& directory, const std::filesystem::path& to, const identify::Options&);

}  // namespace kilotwin::cli
