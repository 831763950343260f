/// Measured trajectories and motion commands: trajectories.csv[.gz] and commands.csv[.gz]. Lengths mm, times s
/// since the start of the run, angles rad anticlockwise from the x axis.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace kilotwin::identify {

/// Motion command, numbered as Command in idl/effects.proto.
enum class Motion : std::uint8_t { kStop = 0, kStraight = 1, kLeft = 2, kRight = 3 };
[[nodiscard]] const char* name_of(Motion);

struct Sample {
  double time_s, x_mm, y_mm;
  double heading_rad;  ///< NaN if not measured
};

/// Valid from time_s until the next change.
struct CommandChange {
  double time_s;
  Motion motion;
};

/// One robot in one run.
struct Track {
  std::uint32_t robot = 0;
  std::vector<Sample> samples;  ///< ascending times; equal times occur in faulty sets
  /// ascending times, each motion differs from the previous one; never empty
  std::vector<CommandChange> commands;
  /// Excluded from the fit. Neighbours still see the robot.
  bool held_out = false;
  /// Held out, and chooses among the models of the search. The other held-out tracks give the reported error.
  bool chooses = false;
};

/// The tracks of a set that count for something.
enum class Tracks : std::uint8_t { kAll, kFit, kHeldOut, kChoosing, kReporting };
[[nodiscard]] constexpr bool counts(const Track& track, Tracks which) {
  switch (which) {
    case Tracks::kAll: return true;
    case Tracks::kFit: return !track.held_out;
    case Tracks::kHeldOut: return track.held_out;
    case Tracks::kChoosing: return track.held_out && track.chooses;
    case Tracks::kReporting: return track.held_out && !track.chooses;
  }
  return false;
}

struct Run {
  std::string name;
  std::vector<Track> tracks;  ///< ascending robot numbers, each once
};

struct MeasuredSet {
  std::vector<Run> runs;  ///< in the order of their first rows
  bool has_commands = false;
  bool has_headings = false;

  [[nodiscard]] std::size_t samples() const;
  [[nodiscard]] std::size_t tracks() const;
  /// All robot numbers, ascending.
  [[nodiscard]] std::vector<std::uint32_t> robots() const;
};

/// Whether the directory holds trajectories.csv[.gz].
[[nodiscard]] bool has_trajectories(const std::filesystem::path& directory);

/// Reads DIR/trajectories.csv[.gz] and DIR/commands.csv[.gz]. Columns are found by name, in any order; further
/// columns are ignored. Rows may come in any order. Without any commands, robots drive straight all the time. With
/// commands, a robot rests before its first one. Throws UserError with file, line and column.
[[nodiscard]] MeasuredSet load_measured_set(const std::filesystem::path& directory);

/// Writes both files, uncompressed.
void save_measured_set(const MeasuredSet&, const std::filesystem::path& directory);

}  // namespace kilotwin::identify
