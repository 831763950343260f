/// An alarm: what left the model, when, where, by how much, with the evidence.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/time.hpp"

namespace kilotwin::monitor {

/// Suspected effects, in the words of identification.
enum class Suspect : std::uint8_t {
  kGainLeft,
  kGainRight,
  kGain,
  kBiasLeft,
  kBiasRight,
  kTurnRate,
  kDrift,
  kHeading,
  kJump,
  // Of the arena or a tracker:
  kCalibrationShift,
  kGainOfAll,
  kDriftOfAll,
  kPatch,
};

/// "gain_left": the word in tables.
[[nodiscard]] std::string_view word_of(Suspect suspect);
/// "gain of the left wheel".
[[nodiscard]] std::string_view name_of(Suspect suspect);
/// Unit of its sizes: "mm/s"; empty for gains, which are relative.
[[nodiscard]] std::string_view unit_of(Suspect suspect);

struct Size {
  double value = 0, standard_error = 0;
};

struct Alarm {
  double time_s = 0;   ///< simulated time of the alarm
  double onset_s = 0;  ///< estimated begin; the start of the grid with the largest evidence
  Suspect suspect = Suspect::kGain;
  std::vector<std::uint32_t> robots;  ///< that contributed, ascending
  std::string tracker;                ///< of a calibration shift: the source's name, if it is known
  double x_mm = 0, y_mm = 0;          ///< of the robot, of the robots' mean, or of the patch
  std::vector<Size> sizes;  ///< 1; 2 for drifts and jumps: x, y; 3 for calibration shifts: x mm, y mm, turn rad
  double evidence_nat = 0, threshold_nat = 0;
  std::vector<Suspect> alternatives;  ///< with an evidence of at most 3 nat less
};

/// One line for people, without its end.
[[nodiscard]] std::string line_of(const Alarm& alarm);

/// The table of alarms: header and rows, without line ends.
[[nodiscard]] std::string table_header();
[[nodiscard]] std::string table_row(const Alarm& alarm);

}  // namespace kilotwin::monitor
