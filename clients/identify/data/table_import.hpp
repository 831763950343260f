/// Tables of any tracker as rows of trajectories.csv.
#pragma once

#include <filesystem>
#include <string>

namespace kilotwin::identify {

/// Names of a table's columns, its units and its axes.
struct TableFormat {
  std::string time = "time_s", robot = "robot", x = "x_mm", y = "y_mm";
  std::string heading;   ///< empty: none is read
  std::string run;       ///< empty: a run per file, named after it
  double unit_mm = 1;    ///< length of one unit of x and y
  double unit_s = 1;     ///< duration of one unit of time
  bool degrees = false;  ///< headings; else rad
  bool image = false;    ///< y points down and headings count clockwise, as in pictures
};

/// Sets the names by "time=t,robot=ID,x=px,y=py,heading=theta,run=trial"; names that are left out stay. Throws UserError.
void set_columns(TableFormat&, const std::string& text);

/// Writes to/trajectories.csv from all *.csv[.gz] in a directory but commands.csv, which it copies. Throws UserError.
void import_tables(const std::filesystem::path& from, const std::filesystem::path& to, const TableFormat&);

/// Whether some table of a directory has the column heading_rad.
[[nodiscard]] bool has_headings(const std::filesystem::path& directory);

/// Whether a file is a table of `kilotwin track`.
[[nodiscard]] bool is_track_table(const std::filesystem::path& file);
/// `run,robot,time_s,x_mm,y_mm` rows of such a table, without a header. Headings are left out: the tracker filters them
/// from the positions by a model without drift, so they follow the direction of motion, and are no second measurement.
/// Without a calibration the scale follows from the radius of the discs, 16.5 mm, and the origin is the middle of what
/// the robots visited. Robots without a number of their own are numbered by their tracks.
[[nodiscard]] std::string rows_of_track_table(const std::filesystem::path& file);

}  // namespace kilotwin::identify
