// Forecasts that start where the model knows the robot.
#include <cmath>
#include <map>
#include <tuple>

#include "clients/identify/predict/forecast.hpp"
#include "core/stats/quantiles.hpp"

namespace kilotwin::identify {

std::vector<Forecast> with_expectations_of(const std::vector<Forecast>& other, std::vector<Forecast> forecasts) {
  std::map<std::tuple<std::uint32_t, std::uint32_t, double>, double> expected_mm;
  for (const Forecast& f : other) expected_mm[{f.run, f.place, f.time_s}] = f.expected_error_mm;
  for (Forecast& f : forecasts)
    if (const auto found = expected_mm.find({f.run, f.place, f.time_s}); found != expected_mm.end())
      f.expected_error_mm = found->second;
  return forecasts;
}

std::vector<Forecast> from_known_starts(const std::vector<Forecast>& forecasts) {
  // Of a robot whose heading is unknown the expected error is ten times that of others; of robots at rest it is a fraction.
  constexpr double kKnown = 3;
  std::vector<double> expected_mm;
  for (const Forecast& f : forecasts)
    if (std::isfinite(f.expected_error_mm)) expected_mm.push_back(f.expected_error_mm);
  const double most_mm = kKnown * stats::upper_median(std::move(expected_mm));
  std::vector<Forecast> known;
  for (const Forecast& f : forecasts)
    if (f.expected_error_mm <= most_mm) known.push_back(f);
  return known;
}

}  // namespace kilotwin::identify
