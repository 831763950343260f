/// SweepColours: the plotted observable of a sweep by the value of a swept field, or by group of robots. A colour of the plots is one
/// sample: all runs with that value, or the robots of that group in all runs.
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "clients/cli/sweep_points.hpp"
#include "clients/report/plot.hpp"
#include "core/stats/moments.hpp"

namespace kilotwin::cli {

/// Largest number of curves that a reader can distinguish in one plot.
inline constexpr std::size_t kMostCurves = 8;

/// Observes a run: the times of its states, and the plotted observable there, of one group or of all robots.
struct ObservedCurve {
  std::vector<double> time_s, value;
};

class SweepColours {
 public:
  static constexpr const char* kGroup = "group";

  /// `by`: a swept field, or kGroup. `response_field`: index into a point of the field on the x axis of the response, if any. Fields
  /// with more than kMostCurves numbers are divided into four ranges with equally many points. Throws UserError for another field.
  SweepColours(const std::vector<SweepPoint>& points, std::string by, std::optional<std::size_t> response_field);

  [[nodiscard]] bool by_group() const { return by_ == kGroup; }
  /// Adds a run at a point. `group`: with kGroup, whose curve it is.
  void add(std::size_t point, std::size_t group, const ObservedCurve& curve);

  /// Adds a series per colour, and the legend's title.
  void add_curves(Plot& plot) const;
  void add_response(Plot& plot) const;

 private:
  struct Colour {
    std::string name;
    std::vector<double> time_s;
    std::vector<stats::Moments> over_time;    ///< per recorded state
    std::map<double, stats::Moments> at_end;  ///< by the value of the response field
  };
  void divide(std::size_t field);

  const std::vector<SweepPoint> points_;
  const std::string by_;
  const std::optional<std::size_t> response_field_;
  std::vector<Colour> colours_;
  std::vector<std::size_t> colour_of_;  ///< per point; empty with kGroup
};

/// Whether numbers are steps of equal ratios, as `log:` gives them: at least three, above 0, over a factor of 4 or more, each ratio
/// within 2 % of their geometric mean.
[[nodiscard]] bool have_equal_ratios(std::vector<double> numbers);

}  // namespace kilotwin::cli
