/// Converts other trajectory files into a data directory. `kilotwin identify` accepts a directory of either kind:
///   ARK logs     *.tsv, *.txt, *.log: tab-separated `t id colour x y orientation ...`, one file per run, with or without
///                a line of names. x, y are pixels of ARK's mosaic: 2000 px over 2 m from the top left corner, hence mm.
///                The orientation is ignored: ARK derives it from the motion of the last half second, so it lags in turns.
///   recordings   *.csv with the columns of `kilotwin export --trajectories`, one file per run
///   tables of a tracker   *.csv of `kilotwin track`, one file per run (table_import.hpp)
/// A run is named after its file, without the extension. A commands.csv in the same directory uses these names.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "clients/identify/data/measured_set.hpp"

namespace kilotwin::identify {

/// Side of ARK's mosaic, px and mm.
inline constexpr double kArkMosaic_mm = 2000;

/// Files of the directory that can be converted, sorted. Empty if there are none, or if trajectories.csv[.gz]
/// exists.
[[nodiscard]] std::vector<std::filesystem::path> importable(const std::filesystem::path& directory);

/// `run,robot,time_s,x_mm,y_mm` rows of one file, without a header. Ignores a truncated last line (a log still
/// being written). Throws UserError with file, line and column.
[[nodiscard]] std::string rows_of_ark_log(const std::filesystem::path& file);
/// `run,robot,time_s,x_mm,y_mm,heading_rad` rows of one file, without a header.
[[nodiscard]] std::string rows_of_recording(const std::filesystem::path& file);

/// Writes to/trajectories.csv and copies commands.csv[.gz] if present. Throws UserError on invalid files, on a
/// mixture of ARK logs and recordings, and on two runs of one name.
void import_set(const std::filesystem::path& from, const std::filesystem::path& to);

/// Loads a data directory, or converts its files into `converted` first. Tracks of `kilotwin track` without numbers of robots begin
/// anew in each film. Each of them becomes a robot of its own, with numbers from `first_number` on, or above the largest known one.
/// Commands name such a robot by its track.
[[nodiscard]] MeasuredSet load_or_import(const std::filesystem::path& directory,
                                         const std::filesystem::path& converted, std::uint32_t first_number = 0);

/// `first_number` of `directory`, if the set `other` is judged by a model of it: a number above those of all robots that `other`
/// numbers; 0 if all tracks of `directory` have numbers. Converts the files of `other` into `converted`.
[[nodiscard]] std::uint32_t first_number_beside(const std::filesystem::path& directory,
                                                const std::filesystem::path& other,
                                                const std::filesystem::path& converted);

}  // namespace kilotwin::identify
