/// Optimisation of a noisy measure by CMA-ES (Hansen 2006; pagmo's implementation), with an honest end: the best points are measured
/// again with random seeds that took no part in the search, and the winner once more, so that its value has no winner's curse.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <stdexcept>
#include <vector>

namespace kilotwin::tune {

/// A point of the unit cube, one coordinate per parameter.
using Point = std::vector<double>;

/// The measure of a point for random seeds first..first + count - 1, in this order. Larger is better. NaN: failed.
using Measure = std::function<std::vector<double>(const Point&, std::uint64_t first_seed, std::size_t count)>;

struct Settings {
  std::size_t parameters = 1;
  std::size_t seeds = 4;       ///< measurements of a point in the search; at least 2
  std::size_t budget = 400;    ///< measurements of search and check together
  std::uint64_t seed = 1;      ///< of the search, and the first of the measurements
  std::function<bool()> stop;  ///< asked between points; may be empty
};

/// A point that was measured.
struct Trial {
  Point point;
  std::size_t generation = 0;
  double mean = 0, standard_error = 0;
  std::size_t failed = 0;  ///< measurements that failed, of Settings::seeds
};

/// Of values that were measured with the same seeds, or of their differences.
struct Estimate {
  double mean = 0, standard_error = 0;
  std::size_t count = 0;
};

struct Tuned {
  std::vector<Trial> trials;  ///< in their order
  std::vector<Trial>
      again;  ///< the best ones and the centre of the last generation, measured again; the best first
  Point best;
  std::vector<double> last;  ///< measurements of the best point, by last_seeds(), which are used for nothing else
  Estimate value;            ///< of these
  bool stopped = false;      ///< by Settings::stop; `again`, `best` and `value` are empty
};

/// Fewest measurements that search and check need.
[[nodiscard]] std::size_t least_budget(const Settings&);

/// Throws std::invalid_argument for a budget below least_budget, and FailedSearch where no measurement of the first generation
/// succeeds.
[[nodiscard]] Tuned tune(const Measure&, const Settings&);

struct FailedSearch : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Seeds of the last measurement of the winner, so that another point can be compared with it.
struct Seeds {
  std::uint64_t first = 0;
  std::size_t count = 0;
};
[[nodiscard]] Seeds last_seeds(const Settings&);

/// Mean and standard error of the values that are numbers.
[[nodiscard]] Estimate estimate(const std::vector<double>& values);
/// Of a - b, value by value, where both are numbers.
[[nodiscard]] Estimate difference(const std::vector<double>& a, const std::vector<double>& b);

}  // namespace kilotwin::tune
