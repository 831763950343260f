/// Tables from a recording, as CSV: to a file, gzipped where its name ends in .gz, or to standard output where it is "-".
#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>

#include "clients/recorder/reader.hpp"

namespace kilotwin::recorder {

/// Poses as they are, or as a tracker sees them, where the model has effects on what is measured.
enum class Poses { kTrue, kMeasured };

/// led_r, led_g, led_b: 0..3. group: the robot's group, numbered from 0 as the experiment lists them. state: its life cycle,
/// "running", "failed"...
inline constexpr std::string_view kTrajectoryColumns =
    "time_s,robot,x_mm,y_mm,heading_rad,led_r,led_g,led_b,group,state";
/// The name of the last column says what it means: it is 1 in rows whose count is what the robot itself sent.
inline constexpr std::string_view kMessageColumns = "receiver,sender,count,sent_if_receiver_is_sender";

/// kTrajectoryColumns: one row per robot at 0, every_s, 2 every_s..., by time and then by robot. For each of these times the
/// first recorded state at or after it is taken; time_s is the simulated time of that state's tick, exactly. Lengths have 4
/// decimals, angles 6.
/// Returns the number of rows. Throws UserError where the recording has no state within one tick after each such time,
/// i.e. every_s is no multiple of the recorded interval, and RunError where the file cannot be written.
/// `which`: where the recording holds no measured poses, they are the true ones.
std::uint64_t export_trajectories(Reader& recording, const std::filesystem::path& csv, double every_s = 1,
                                  Poses which = Poses::kTrue);

/// time_s,body,x_mm,y_mm,heading_rad: the same of movable bodies; x, y is a body's centre. Throws UserError where the
/// experiment has none.
std::uint64_t export_bodies(Reader& recording, const std::filesystem::path& csv, double every_s = 1);

/// kMessageColumns: how often each pair communicated, by receiver and then by sender; a robot's row with itself is what it
/// sent with success. Returns the number of rows. Throws UserError where no messages were
/// recorded.
std::uint64_t export_messages(Reader& recording, const std::filesystem::path& csv);

/// robot,attempted,sent,received,collided,backed_off: what each robot's radio did. Returns the number of rows. Throws
/// UserError where the run did not come to its end.
std::uint64_t export_radio(Reader& recording, const std::filesystem::path& csv);

}  // namespace kilotwin::recorder
