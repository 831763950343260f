/// Behaviour of robots in runs of one program, and agreement of native robots and firmware robots.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace kilotwin::validation {

/// A robot's motors or LED change at a tick.
struct Change {
  std::int64_t tick = 0;
  std::uint32_t value = 0;
};

/// Behaviour of the robots of one kind: entry i belongs to robot i % robots of run i / robots. Runs differ by their seeds.
struct Outcome {
  std::string refusal;  ///< not empty: why the program did not run
  std::string warning;  ///< the first line that a run printed about the program
  std::size_t robots = 0;
  std::vector<std::vector<Change>> motors, led;
  std::vector<double> path_mm;      ///< length of the path, in steps of one second
  std::vector<double> distance_mm;  ///< from first to last position
  std::vector<double> brightness;   ///< mean over time of the LED's colours, 0..1
  std::vector<double> colours;      ///< number of changes of the LED
  std::vector<double> sent, received;
  std::int64_t last_tick = 0;
};

/// Divisions of the permutation test; no p is below 1 / (kDivisions + 1).
inline constexpr int kDivisions = 9999;

/// Two-sample permutation test of the difference of means (Fisher 1935, Pitman 1937): the part of random divisions of all values
/// into two such samples whose means differ at least as much. 9999 divisions from a fixed seed. Requires values in both samples.
[[nodiscard]] double permutation_p(std::span<const double> a, std::span<const double> b);

/// How far native and firmware robots agree.
struct Comparison {
  std::string measure;  ///< the measure that differs most
  double native = 0, firmware = 0;
  double part = 0;            ///< difference / firmware, of that measure
  double p = 1;               ///< permutation test of that measure over runs; 1 with fewer than kLeastRuns
  bool event_exact = false;   ///< every change of motors and LED within one tick, and equal counts of messages
  bool within_tenth = false;  ///< each measure within 10 %
  bool agrees = false;        ///< each measure within 10 %, or p at least kLevel with kLeastRuns or more
  std::size_t native_changes = 0, firmware_changes = 0, same_changes = 0;
};

/// Runs that the test needs: robots of one run hear each other, so that runs are the independent units.
inline constexpr std::size_t kLeastRuns = 10;
/// Level of the test: 0.01 per program, divided by its six measures (Bonferroni).
inline constexpr double kLevel = 0.01 / 6;

[[nodiscard]] Comparison compare(const Outcome& native, const Outcome& firmware);

}  // namespace kilotwin::validation
