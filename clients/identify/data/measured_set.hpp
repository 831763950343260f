/// Measured trajectories and the commands that were given: what `kilotwin identify` reads (trajectories.csv[.gz],
/// commands.csv[.gz]). Lengths mm, times s since the start of the run, angles rad anticlockwise from x.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace kilotwin::identify {

/// What a robot is told to do; numbered as idl/effects.proto's Command.
enum class Motion : std::uint8_t { kStop = 0, kStraight = 1, kLeft = 2, kRight = 3 };
[[nodiscard]] const char* name_of(Motion);

struct Sample {
  double time_s, x_mm, y_mm;
  double heading_rad;  ///< NaN where it was not measured
};

/// Valid from time_s until the next.
struct CommandChange {
  double time_s;
  Motion motion;
};

/// One robot in one run.
struct Track {
  std::uint32_t robot = 0;
  std::vector<Sample> samples;          ///< ascending times; equal times are possible (a faulty set)
  std::vector<CommandChange> commands;  ///< ascending times, each differs from the one before; never empty
  /// Not to be fitted to; it is still seen by its neighbours.
  bool held_out = false;
};

struct Run {
  std::string name;
  std::vector<Track> tracks;  ///< ascending robots, each once
};

struct MeasuredSet {
  std::vector<Run> runs;  ///< in the order of their first rows
  bool has_commands = false;
  bool has_headings = false;

  [[nodiscard]] std::size_t samples() const;
  [[nodiscard]] std::size_t tracks() const;
  /// Ascending, each once.
  [[nodiscard]] std::vector<std::uint32_t> robots() const;
};

/// Whether the directory holds trajectories.
[[nodiscard]] bool has_trajectories(const std::filesystem::path& directory);

/// Reads DIR/trajectories.csv or .csv.gz and DIR/commands.csv or .csv.gz. Columns are found by their names, in any order;
/// further columns are passed over. Rows may come in any order. Where there are no commands at all, robots are taken to go
/// straight all the time; with commands, a robot rests before its first one. Throws UserError with file, line and column.
[[nodiscard]] MeasuredSet load_measured_set(const std::filesystem::path& directory);

/// Writes both files, uncompressed, in the contract's form.
void save_measured_set(const MeasuredSet&, const std::filesystem::path& directory);

}  // namespace kilotwin::identify
