/// Tables from a recording as CSV: to a file, to a gzipped file (.gz), or to standard output ("-").
#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>

#include "clients/recorder/reader.hpp"

namespace kilotwin::recorder {

/// True poses, or poses as a tracker measures them if the model has effects on measurement.
enum class Poses { kTrue, kMeasured };

/// led_r, led_g, led_b: 0..3. group: number of the robot's group, from 0 in the experiment's order. state: its life cycle:
/// "running", "failed"...
inline constexpr std::string_view kTrajectoryColumns =
    "time_s,robot,x_mm,y_mm,heading_rad,led_r,led_g,led_b,group,state";
/// The last column is 1 in rows whose count is the number of messages that the robot itself sent.
inline constexpr std::string_view kMessageColumns = "receiver,sender,count,sent_if_receiver_is_sender";

/// Columns kTrajectoryColumns: one row per robot at 0, every_s, 2 every_s..., sorted by time and then by robot. A row has the
/// first recorded state at or after its time; time_s is the exact simulated time of that state's tick. Lengths have 4
/// decimals, angles 6. Without recorded measured poses, `which` has no effect.
/// Returns the number of rows. Throws UserError if the recording has no state within one tick after each of these times, i.e.
/// every_s is no multiple of the recorded interval. Throws RunError if the file cannot be written.
std::uint64_t export_trajectories(Reader& recording, const std::filesystem::path& csv, double every_s = 1,
                                  Poses which = Poses::kTrue);

/// Columns time_s,body,x_mm,y_mm,heading_rad: the same for movable bodies; x, y is a body's centre. Throws UserError if the
/// experiment has none.
std::uint64_t export_bodies(Reader& recording, const std::filesystem::path& csv, double every_s = 1);

/// Columns kMessageColumns: number of messages per pair, sorted by receiver and then by sender. A robot's row with itself has
/// the number of messages that it sent successfully. Returns the number of rows. Throws UserError if no messages were
/// recorded.
std::uint64_t export_messages(Reader& recording, const std::filesystem::path& csv);

/// Columns robot,attempted,sent,received,collided,backed_off: counts of each robot's radio. Returns the number of rows. Throws
/// UserError if the run did not reach its end.
std::uint64_t export_radio(Reader& recording, const std::filesystem::path& csv);

}  // namespace kilotwin::recorder
