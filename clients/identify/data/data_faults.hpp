/// Faults of measured data. Data with a fault are excluded from the fit, because an effect that explains a
/// tracker's fault is an effect of no robot. Each test relies on what no robot can do, so none needs a motion
/// model:
///   outliers   a position far from the robot's positions before and after
///   frozen     the same position, to the last digit, while the robot is commanded to move; at rest the digits vary
///   duplicate  two robots closer than two discs can be, for long
///   swapped    two robots, each of which follows the other's commands
///   clock      a run whose robots follow their commands with stretched times
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "clients/identify/data/measured_set.hpp"

namespace kilotwin::identify {

struct DataFault {
  enum class Kind : std::uint8_t { kOutliers, kFrozen, kDuplicate, kSwapped, kClock };
  Kind kind;
  std::string run;
  std::optional<std::uint32_t> robot;  ///< none: the whole run
  std::optional<std::uint32_t> other;  ///< duplicate: the original; swapped: the partner
  double from_s = 0, to_s = 0;         ///< time of the run, s
  double strength =
      0;  ///< outliers: largest distance, mm; clock: stamped over true time; swapped: gain in log-likelihood
  std::size_t excluded = 0;  ///< number of samples excluded
  /// Of a test set: nothing of it is excluded, and its error contains the fault.
  bool of_test = false;

  /// One sentence: the evidence, and what was excluded.
  [[nodiscard]] std::string in_words() const;
};

/// "outliers", "frozen", "duplicate", "swapped", "clock".
[[nodiscard]] const char* name_of(DataFault::Kind);

/// Finds faults and excludes the samples affected: single outliers, frozen positions, the copy of a robot, both of
/// two swapped robots while swapped, all of a run with a wrong clock. Runs and tracks keep their indices and may
/// become empty. Returns the faults by run, then in the order of their kinds. No fault was found in 300 sets
/// without one (tests/identify).
std::vector<DataFault> exclude_faults(MeasuredSet&);

// The steps of exclude_faults, in its order. Each appends the faults it finds and excludes their samples.
void exclude_duplicates(MeasuredSet&, std::vector<DataFault>&);
void exclude_frozen(MeasuredSet&, std::vector<DataFault>&);
void exclude_wrong_clocks(MeasuredSet&, std::vector<DataFault>&);
void exclude_swapped(MeasuredSet&, std::vector<DataFault>&);
void exclude_outliers(MeasuredSet&, std::vector<DataFault>&);

}  // namespace kilotwin::identify
