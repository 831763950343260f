#include "clients/recorder/axis.hpp"

#include <cmath>

#include "core/base/error.hpp"

namespace kilotwin::recorder {
namespace {

/// Tolerance for quotients that rounding raises just above an integer.
constexpr double kSlack = 1e-9;

}  // namespace

double round_step(double range, int pieces) {
  KILOTWIN_DEMAND(range > 0 && pieces > 0);
  const double least = range / pieces;
  const double power = std::pow(10, std::floor(std::log10(least)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= least * (1 - kSlack)) return factor * power;
  }
  return 10 * power;
}

}  // namespace kilotwin::recorder
