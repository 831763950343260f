/// Tables from a recording: table.hpp has the formats.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "clients/recorder/reader.hpp"
#include "clients/recorder/table.hpp"

namespace kilotwin::recorder {

/// True poses, or poses as a tracker measures them if the model has effects on measurement.
enum class Poses { kTrue, kMeasured };

/// led_r, led_g, led_b: 0..3. group: number of the robot's group, from 0 in the experiment's order. state: its life cycle:
/// "running", "failed"...
inline constexpr std::string_view kTrajectoryColumns =
    "time_s,robot,x_mm,y_mm,heading_rad,led_r,led_g,led_b,group,state,failed";
/// The last column is 1 in rows whose count is the number of messages that the robot itself sent.
inline constexpr std::string_view kMessageColumns = "receiver,sender,count,sent_if_receiver_is_sender";

/// Columns kTrajectoryColumns, and battery_V if it was recorded: one row per robot at 0, every_s, 2 every_s..., sorted by time and then by robot. A row has the
/// first recorded state at or after its time; time_s is the exact simulated time of that state's tick. Lengths have 4
/// decimals, angles 6. Without recorded measured poses, `which` has no effect.
/// Returns the number of rows. Throws UserError if the recording has no state within one tick after each of these times, i.e.
/// every_s is no multiple of the recorded interval. All throw RunError if the file cannot be written.
std::uint64_t export_trajectories(Reader& recording, const std::filesystem::path& file, double every_s = 1,
                                  Poses which = Poses::kTrue, const TableMetadata& metadata = {});

/// The columns of pogosim's own tables: time (s), robot_category ("robots", or "robots-GROUP" of several groups), robot_id, x, y (mm),
/// angle (rad), pogobot_ticks (ticks of 32.768 ms since the start). Then come the recorded variables, under their names, with their
/// newest values. The origin is the corner of the arena's bounding box, whose size is in the metadata. Rows as of
/// export_trajectories().
inline constexpr std::string_view kPogosimColumns = "time,robot_category,robot_id,x,y,angle,pogobot_ticks";
std::uint64_t export_pogosim(Reader& recording, const std::filesystem::path& file, double every_s = 1,
                             const TableMetadata& metadata = {});

/// Columns time_s,body,x_mm,y_mm,heading_rad: the same for movable bodies; x, y is a body's centre. Throws UserError if the
/// experiment has none.
std::uint64_t export_bodies(Reader& recording, const std::filesystem::path& file, double every_s = 1,
                            const TableMetadata& metadata = {});

/// Columns kMessageColumns: number of messages per pair, sorted by receiver and then by sender. A robot's row with itself has
/// the number of messages that it sent successfully. Returns the number of rows. Throws UserError if no messages were
/// recorded.
std::uint64_t export_messages(Reader& recording, const std::filesystem::path& file,
                              const TableMetadata& metadata = {});

/// Columns robot,attempted,sent,received,collided,backed_off: counts of each robot's radio. Returns the number of rows. Throws
/// UserError if the run did not reach its end.
std::uint64_t export_radio(Reader& recording, const std::filesystem::path& file,
                           const TableMetadata& metadata = {});

/// Columns time_s,robot,group and one per recorded variable, under its name: one row per robot and tick at which it has a value of any
/// of them, sorted by time and then by robot. Throws UserError if the run recorded no variables.
std::uint64_t export_variables(Reader& recording, const std::filesystem::path& file,
                               const TableMetadata& metadata = {});

/// Kinds of events as tables name them.
inline constexpr std::string_view kEventKinds = "led, motion, state, sent, received, station, failure";
/// Nothing: there is no such kind.
[[nodiscard]] std::optional<proto::RecordedEvent> event_kind(std::string_view name);

/// Columns time_s,event,robot,group,led_r,led_g,led_b,motor_left,motor_right,state,sender,distance_mm,text: one row per event, by
/// ascending time. Cells that say nothing about the event are empty. Times of messages are exact to the cycle, others to the tick.
/// `kinds`: events of these kinds alone, and of the columns those that say something about one of them; empty: all. Throws UserError
/// if the run did not record one of `kinds`.
std::uint64_t export_events(Reader& recording, const std::filesystem::path& file,
                            const std::vector<proto::RecordedEvent>& kinds = {},
                            const TableMetadata& metadata = {});

/// Duties at which a robot turns or goes straight by its calibration: kilo_turn_left and so on.
struct CalibratedDuties {
  std::uint8_t turn_left = 0, turn_right = 0, straight_left = 0, straight_right = 0;
};
/// Changes of motion to other duties than the robot's calibrated ones.
struct OtherDuties {
  std::uint64_t changes = 0;
  std::uint32_t robots = 0;  ///< robots with such changes
  // The first one.
  std::uint32_t robot = 0, left = 0, right = 0;
  double time_s = 0;
};
struct ExportedCommands {
  std::uint64_t rows = 0;
  OtherDuties other;  ///< nothing where `calibrated` is empty
};

/// Columns run,robot,time_s,motion, as `kilotwin identify` reads commands: every change of a robot's motion, exact to the tick. A motion
/// is named by the motors that run, whatever their duties. `calibrated`: per robot; empty: unknown. Throws UserError if the run did not
/// record the event MOTION.
ExportedCommands export_commands(Reader& recording, const std::filesystem::path& file,
                                 const std::vector<CalibratedDuties>& calibrated = {},
                                 const TableMetadata& metadata = {});

/// Columns time_s, one per observable of the experiment, and those of observables.hpp: one row per recorded state.
std::uint64_t export_observables(Reader& recording, const std::filesystem::path& file,
                                 const TableMetadata& metadata = {});

/// Columns environment,name,time_s,robot,colour,x,y,orientation_deg,value_1...: the logs station-N.tsv of a run directory. Throws
/// UserError if there are none.
std::uint64_t export_environment(const std::filesystem::path& run_directory, const proto::RecordingHeader& header,
                                 const std::filesystem::path& file, const TableMetadata& metadata = {});

/// A life cycle's name: "running", "failed"...
[[nodiscard]] std::string state_name(std::uint8_t life_cycle);
/// Per robot: number of its group, in the experiment's order.
[[nodiscard]] std::vector<std::uint32_t> groups_of(const proto::RecordingHeader& header);

}  // namespace kilotwin::recorder
