/// One program, run natively and as firmware in the same experiment, and what the robots did in both.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace kilotwin::validation {

/// A robot's motors or LED change at a tick.
struct Change {
  std::int64_t tick = 0;
  std::uint32_t value = 0;
};

/// What the robots of one kind did: entry i belongs to robot i % robots with seed i / robots + 1.
struct Outcome {
  std::string refusal;  ///< not empty: why the program did not run
  std::string warning;  ///< the first line that a run printed about the program
  std::vector<std::vector<Change>> motors, led;
  std::vector<double> path_mm;      ///< length of the path, in steps of one second
  std::vector<double> distance_mm;  ///< from first to last position
  std::vector<double> brightness;   ///< mean over time of the LED's colours, 0..1
  std::vector<double> colours;      ///< number of changes of the LED
  std::vector<double> sent, received;
  std::int64_t last_tick = 0;
};

struct PairSettings {
  std::string kilotwin;           ///< the program
  std::filesystem::path scratch;  ///< directory for experiments and runs
  int seeds = 1, more_seeds = 1, robots = 4;
  double duration_s = 12;
};

/// Runs `program` as `avr` says. Runs that take more than ten minutes are ended and count as refused.
[[nodiscard]] Outcome run_program(const PairSettings& settings, const std::filesystem::path& program, bool avr);

/// How far native and firmware robots agree.
struct Comparison {
  std::string measure;  ///< the measure that differs most
  double native = 0, firmware = 0;
  double part = 0;           ///< difference / firmware
  bool event_exact = false;  ///< every change of motors and LED within one tick
  bool agrees = false;       ///< each measure within 10 %, or within two standard errors
  std::size_t native_changes = 0, firmware_changes = 0, same_changes = 0;
};
[[nodiscard]] Comparison compare(const Outcome& native, const Outcome& firmware);

}  // namespace kilotwin::validation
