/// Reads trajectory files of other programs. `kilotwin identify` accepts a directory of either kind:
///   ARK logs     *.tsv, *.txt, *.log: tab-separated `t id colour x y orientation ...`, one file per run, with or without
///                a line of names. x, y are pixels of ARK's mosaic: 2000 px over 2 m from the top left corner, hence mm.
///                The orientation is ignored: ARK derives it from the motion of the last half second, so it lags in turns.
///   recordings   *.csv with the columns of `kilotwin export --trajectories`, one file per run
///   tables of a tracker   *.csv of `kilotwin track`, one file per run (table_import.hpp)
/// A run is named after its file, without the extension. A commands.csv in the same directory uses these names.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "clients/identify/data/measured_set.hpp"
#include "clients/identify/data/set_builder.hpp"

namespace kilotwin::identify {

/// Side of ARK's mosaic, px and mm.
inline constexpr double kArkMosaic_mm = 2000;

/// Files of the directory that can be read, sorted. Empty if there are none, or if trajectories.csv[.gz] exists.
[[nodiscard]] std::vector<std::filesystem::path> importable(const std::filesystem::path& directory);

/// Adds the rows of an ARK log, as those of the run that is named after the file. Ignores a truncated last line (a log still being
/// written). Throws UserError with file, line and column.
void add_ark_log(const std::filesystem::path& file, SetBuilder&);
/// The same of a file of `kilotwin export --trajectories`.
void add_recording(const std::filesystem::path& file, SetBuilder&);

/// The set of a directory, of either kind. Tracks of `kilotwin track` without numbers of robots begin anew in each film. Each of them
/// becomes a robot of its own, with numbers from `first_number` on, or above the largest known one. Commands name such a robot by its
/// track. Throws UserError on invalid files, on a mixture of kinds, and on two runs of one name.
[[nodiscard]] MeasuredSet load_or_import(const std::filesystem::path& directory, std::uint32_t first_number = 0);

/// `first_number` of `directory`, if the set `other` is judged by a model of it: a number above those of all robots that `other`
/// numbers; 0 if all tracks of `directory` have numbers.
[[nodiscard]] std::uint32_t first_number_beside(const std::filesystem::path& directory,
                                                const std::filesystem::path& other);

}  // namespace kilotwin::identify
