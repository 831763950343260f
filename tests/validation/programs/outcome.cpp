#include "tests/validation/programs/outcome.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <numeric>
#include <random>

namespace kilotwin::validation {
namespace {

/// Number of changes that agree in order, at most one tick apart. Changes in the last two ticks are left out.
void count_changes(const std::vector<std::vector<Change>>& native, const std::vector<std::vector<Change>>& firmware,
                   std::int64_t last, Comparison& result) {
  for (std::size_t robot = 0; robot < native.size(); ++robot) {
    const auto ends = [last](const std::vector<Change>& changes) {
      std::size_t n = changes.size();
      while (n > 0 && changes[n - 1].tick >= last - 1) --n;
      return n;
    };
    const std::size_t a = ends(native[robot]), b = ends(firmware[robot]);
    result.native_changes += a;
    result.firmware_changes += b;
    for (std::size_t i = 0, j = 0; i < a && j < b;) {
      const Change &one = native[robot][i], &other = firmware[robot][j];
      if (one.value == other.value && std::abs(one.tick - other.tick) <= 1)
        ++result.same_changes, ++i, ++j;
      else if (one.tick <= other.tick)
        ++i;
      else
        ++j;
    }
  }
}

double mean(std::span<const double> values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

/// The mean over the robots of each run.
std::vector<double> means_of_runs(const std::vector<double>& values, std::size_t robots) {
  std::vector<double> means;
  for (std::size_t first = 0; first + robots <= values.size(); first += robots)
    means.push_back(mean(std::span(values).subspan(first, robots)));
  return means;
}

}  // namespace

double permutation_p(std::span<const double> a, std::span<const double> b) {
  constexpr double kRounding = 1e-9;
  std::vector<double> all(a.begin(), a.end());
  all.insert(all.end(), b.begin(), b.end());
  const double found = std::abs(mean(a) - mean(b)) * (1 - kRounding);
  std::mt19937_64 random(1);
  int as_far = 1;
  for (int n = 0; n < kDivisions; ++n) {
    for (std::size_t i = 0; i < a.size(); ++i) std::swap(all[i], all[i + random() % (all.size() - i)]);
    const std::span<const double> divided(all);
    as_far += std::abs(mean(divided.first(a.size())) - mean(divided.subspan(a.size()))) >= found ? 1 : 0;
  }
  return static_cast<double>(as_far) / (kDivisions + 1);
}

Comparison compare(const Outcome& native, const Outcome& firmware) {
  struct Measure {
    const char* name;
    std::vector<double> Outcome::*values;
    double least;  ///< a difference below this does not count
  };
  static constexpr std::array kMeasures{Measure{"path, mm", &Outcome::path_mm, 5},
                                        Measure{"distance, mm", &Outcome::distance_mm, 5},
                                        Measure{"LED's brightness", &Outcome::brightness, 0.01},
                                        Measure{"changes of LED", &Outcome::colours, 1},
                                        Measure{"messages sent", &Outcome::sent, 1},
                                        Measure{"messages received", &Outcome::received, 2}};
  constexpr double kTenth = 0.1;
  Comparison result;
  count_changes(native.motors, firmware.motors, native.last_tick, result);
  count_changes(native.led, firmware.led, native.last_tick, result);
  result.event_exact = result.same_changes == result.native_changes &&
                       result.same_changes == result.firmware_changes && native.sent == firmware.sent &&
                       native.received == firmware.received;
  result.within_tenth = result.agrees = true;
  bool worst_agrees = true;
  for (const Measure& measure : kMeasures) {
    const std::vector<double> a = means_of_runs(native.*measure.values, native.robots);
    const std::vector<double> b = means_of_runs(firmware.*measure.values, firmware.robots);
    const double difference = std::abs(mean(a) - mean(b));
    const double part = difference <= measure.least ? 0 : difference / std::max(std::abs(mean(b)), measure.least);
    const bool tested = part > kTenth && std::min(a.size(), b.size()) >= kLeastRuns;
    const double p = tested ? permutation_p(a, b) : 1;
    const bool agrees = part <= kTenth || (tested && p >= kLevel);
    result.within_tenth = result.within_tenth && part <= kTenth;
    result.agrees = result.agrees && agrees;
    const bool is_worse = agrees == worst_agrees ? part > result.part : !agrees;
    if (!is_worse) continue;
    worst_agrees = agrees;
    result.measure = measure.name;
    result.native = mean(a);
    result.firmware = mean(b);
    result.part = part;
    result.p = p;
  }
  return result;
}

}  // namespace kilotwin::validation
