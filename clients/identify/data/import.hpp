/// Other files that hold trajectories, turned into a data directory: `kilotwin identify` takes directories of them as they are.
///   ARK logs     *.tsv, *.txt, *.log: tab-separated `t id colour x y orientation ...`, one file a run; a first line of names may
///                stand above. x, y are pixels of ARK's mosaic, 2000 px over 2 m from the top left corner, so mm. The
///                orientation is left out: ARK takes it from the motion of the last half second, so it says nothing that
///                the positions do not, and lags behind a robot that turns.
///   recordings   *.csv with the columns of `kilotwin export --trajectories`, one file a run
/// A run has its file's name without the ending; a commands.csv beside them uses these names.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "clients/identify/data/measured_set.hpp"

namespace kilotwin::identify {

/// Side of ARK's mosaic, px and mm.
inline constexpr double kArkMosaic_mm = 2000;

/// The directory's files that can be turned, by name; empty where there are none or it holds trajectories.csv[.gz] already.
[[nodiscard]] std::vector<std::filesystem::path> importable(const std::filesystem::path& directory);

/// `run,robot,time_s,x_mm,y_mm` rows of one file, without a header. A last line that was cut off is passed over, as a log
/// that is being written ends with one. Throws UserError with file, line and column.
[[nodiscard]] std::string rows_of_ark_log(const std::filesystem::path& file);
/// `run,robot,time_s,x_mm,y_mm,heading_rad` rows.
[[nodiscard]] std::string rows_of_recording(const std::filesystem::path& file);

/// Writes to/trajectories.csv, and copies commands.csv[.gz] where there is one. Throws UserError, also where ARK logs and
/// recordings are mixed or two runs have the same name.
void import_set(const std::filesystem::path& from, const std::filesystem::path& to);

/// A data directory as it is, or files that can be turned into one, which is then `converted`.
[[nodiscard]] MeasuredSet load_or_import(const std::filesystem::path& directory,
                                         const std::filesystem::path& converted);

}  // namespace kilotwin::identify
