/// Estimates the remaining time of a computation that consists of units of work, from the measured time of the finished units.
/// Pure: the caller reads the clock.
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace kilotwin::stats {

/// Units of one kind that follow the present one: the sum of their costs, as expected, and at most, which is no less. A cost is a time
/// in any unit that all kinds of a computation share.
struct WorkLeft {
  int kind = 0;
  double likely = 0, most = 0;
};

/// A unit of work that begins; or the present one, which goes on with another activity.
struct Work {
  static constexpr int kSame = -1;  ///< kind: no unit begins
  std::string stage;                ///< "search, round 2"
  std::string activity;             ///< "fitting; accepted: speed-by-time"
  int kind = 0;
  double cost = 1;
  std::vector<WorkLeft> left = {};  ///< after this unit
};
/// Receives each unit when it begins; the unit before it has ended.
using WorkReport = std::function<void(const Work&)>;

/// The estimate. Every kind has a rate, seconds per cost. Its prior is the common rate of all finished units; the kind's own finished units
/// correct it, and the prior weighs as much as one of them.
class TimeLeft {
 public:
  struct Estimate {
    double likely_s = 0, most_s = 0;
  };

  /// Times are seconds since the start of the computation, and never fall.
  void begin(double now_s, const Work&);
  /// Time until the end. Nothing until a first unit with a cost has ended. Never below 0.
  [[nodiscard]] std::optional<Estimate> at(double now_s) const;
  /// The share of the whole time that has passed, 0..1; 0 while the remaining time is unknown. It never falls.
  [[nodiscard]] double share(double now_s) const;

 private:
  struct Finished {
    double cost = 0, seconds = 0, highest_rate = 0;
    int units = 0;
  };
  struct Rate {
    double likely, most;
  };
  [[nodiscard]] Rate rate_of(int kind) const;

  std::map<int, Finished> finished_;
  Finished all_;
  std::optional<Work> now_;
  double began_s_ = 0, least_share_ = 0;
};

/// "about 40 s left (at most 90 s)", in figures that do not pretend to be exact; without an estimate "time left not known yet".
[[nodiscard]] std::string in_words(const std::optional<TimeLeft::Estimate>&);

}  // namespace kilotwin::stats
