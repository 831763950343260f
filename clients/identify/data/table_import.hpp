/// Tables of any tracker as a measured set.
#pragma once

#include <filesystem>
#include <string>

#include "clients/identify/data/set_builder.hpp"

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

/// Reads all tables in a directory (*.csv[.gz], *.tsv[.gz]) and its commands.csv[.gz]. Throws UserError.
[[nodiscard]] MeasuredSet read_tables(const std::filesystem::path& directory, const TableFormat&);

/// Whether some table of a directory has the column heading_rad.
[[nodiscard]] bool has_headings(const std::filesystem::path& directory);

/// Whether a file is a table of `kilotwin track`.
[[nodiscard]] bool is_track_table(const std::filesystem::path& file);
/// Adds the rows of such a table, as those of the run that is named after the file. Headings are left out: the tracker filters them
/// from the positions by a model without drift, so they follow the direction of motion, and are no second measurement.
/// Without a calibration the scale follows from the radius of the discs, 16.5 mm, and the origin is the middle of what
/// the robots visited. Robots without a number of their own are numbered by their tracks. Throws UserError.
void add_track_table(const std::filesystem::path& file, SetBuilder&);

}  // namespace kilotwin::identify
