/// Summary: facts and counts of a run, as summary.json for scripts and as a few lines for users.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "clients/recorder/provenance.hpp"
#include "core/federation/run_observer.hpp"

namespace kilotwin::recorder {

/// Fields have the same names as in the file.
struct Summary {
  std::string name;
  std::uint64_t seed = 0;
  std::string mode;                                         ///< "local" or "federated"
  std::uint32_t partition_columns = 1, partition_rows = 1;  ///< partitions: "2x1", as for --partitions
  std::uint32_t hosts = 1;
  std::uint32_t robots = 0;              ///< without cells
  std::uint32_t cells = 0;               ///< of a Kilogrid; in the file where there are any
  std::int64_t ticks = 0;                ///< the run's last tick
  std::int64_t resumed_from_tick = 0;    ///< 0 if the run started at tick 0
  std::int64_t recovered_from_tick = 0;  ///< tick of the last recovery's checkpoint; 0: no recovery
  double simulated_s = 0;                ///< at the last tick
  double start_s = 0;                    ///< wall time from the command to the first tick of this attempt
  double wall_s = 0;                     ///< wall time from that tick to the last tick
  double cpu_s = 0;                      ///< of all processes of the run
  double peak_memory_mib = 0;            ///< of all processes of the run, resident
  std::uint64_t state_hash = 0;          ///< 16 hex digits in the file
  std::string failure;  ///< one line: why the run failed; empty, and not in the file, if it did not
  struct Messages {
    std::uint64_t attempted = 0, sent = 0, received = 0, collided = 0;
  } messages;
  /// Least, mean and greatest value over robots of the radio counts; messages_per_robot in the file.
  struct PerRobot {
    struct Spread {
      std::uint32_t least = 0, most = 0;
      std::uint64_t sum = 0;
    };
    std::uint32_t robots = 0;
    Spread attempted, sent, received, collided, backed_off;
    void add(const RadioCount& radio);
  } per_robot;
  Provenance provenance;
  StationTotals station;  ///< in the file where there are virtual environments
  std::uint32_t robots_failed = 0;
  /// The observables that the experiment names, at the end of the run; NaN, null in the file: it has no value.
  std::vector<std::pair<std::string, double>> observables;
  struct Failure {
    std::uint32_t robot = 0;
    double time_s = 0;  ///< begin of the tick in which it failed
    std::string text;   ///< one line: what happened, and where in the program
  };
  std::vector<Failure> failures;  ///< by ascending time; the first kMostFailures are in the file
  static constexpr std::size_t kMostFailures = 1000;
  std::uint32_t recoveries = 0;
  bool paced = false;       ///< `lateness` says something
  LatenessTotals lateness;  ///< late_ticks and worst_lateness_ms in the file
  bool tracked = false;     ///< `tracking` says something
  TrackingTotals tracking;  ///< tracking in the file; times there are ms
  std::string monitor;      ///< the monitor's report, a JSON object; empty without one
  /// Distance between a robot's first and last recorded position.
  struct Moved {
    double mean = 0, max = 0;
  } moved_mm;
  /// CPU time by subject, over robots and ticks stepped.
  struct Cost {
    double behaviours = 0, physics = 0, radio = 0, station = 0, exchange = 0, recording = 0;
    [[nodiscard]] double total() const { return behaviours + physics + radio + station + exchange + recording; }
  } cost_ns_per_robot_tick;
  std::vector<FederateTime> federates;  ///< of a federated run; empty: none is known

  /// Simulated time per wall time, over the ticks that this run itself stepped; 0 if there are none.
  [[nodiscard]] double realtime_factor() const;
};

/// Writes summary.json. Throws RunError.
void write_summary(const Summary& summary, const std::filesystem::path& file);

/// Reads summary.json. Throws UserError if a field of the contract is missing or of another type: "FILE: not a summary;
/// ...".
[[nodiscard]] Summary read_summary(const std::filesystem::path& file);

/// 8 to 12 lines: what happened, and where the results are. `place`: the directory of the results, in words.
[[nodiscard]] std::string summary_text(const Summary& summary, const std::string& place);

}  // namespace kilotwin::recorder
