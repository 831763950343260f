/// What is wrong with measured data themselves. Such data must not be fitted to: an effect that explains a tracker's slip is
/// an effect of no robot. Each fault is found by what no robot can do, whatever effects act on it, so that no model is needed:
///   outliers   a position away from where the robot is before and after it
///   frozen     the very same position again and again, to the last digit, while the robot is told to move and others of
///              its positions differ even at rest
///   duplicate  two robots closer than two discs can be, for long
///   swapped    two robots each of which does what the other is told to
///   clock      a run whose robots do what they are told to, but at times that are stretched
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "clients/identify/data/measured_set.hpp"

namespace kilotwin::identify {

struct DataFault {
  enum class Kind : std::uint8_t { kOutliers, kFrozen, kDuplicate, kSwapped, kClock };
  Kind kind;
  std::string run;
  std::optional<std::uint32_t> robot;  ///< none: all of the run
  std::optional<std::uint32_t> other;  ///< duplicate: the robot that it is; swapped: the other one
  double from_s = 0, to_s = 0;         ///< of the run's time
  double strength =
      0;  ///< outliers: largest distance, mm; clock: stamped over true time; swapped: log-likelihood gained
  std::size_t excluded = 0;  ///< samples taken out for it

  /// One sentence with the evidence and what was excluded.
  [[nodiscard]] std::string in_words() const;
};

/// "outliers", "frozen", "duplicate", "swapped", "clock".
[[nodiscard]] const char* name_of(DataFault::Kind);

/// Finds faults and takes out what they spoil: outliers and frozen positions alone, the copy of a robot, both of two swapped
/// robots for as long as they are, all of a run with a wrong clock. Runs and tracks stay in their places, if need be empty.
/// By run, then in the order of the kinds. Thresholds are such that none was found in 300 sets without (tests/identify).
std::vector<DataFault> exclude_faults(MeasuredSet&);

/// [{kind, run, robot, other, from_s, to_s, strength, excluded, in_words}]; robot and other null where there is none.
[[nodiscard]] nlohmann::json document_of(const std::vector<DataFault>&);

// What exclude_faults does, in its order; each appends what it finds and excludes it.
void exclude_duplicates(MeasuredSet&, std::vector<DataFault>&);
void exclude_frozen(MeasuredSet&, std::vector<DataFault>&);
void exclude_wrong_clocks(MeasuredSet&, std::vector<DataFault>&);
void exclude_swapped(MeasuredSet&, std::vector<DataFault>&);
void exclude_outliers(MeasuredSet&, std::vector<DataFault>&);

}  // namespace kilotwin::identify
