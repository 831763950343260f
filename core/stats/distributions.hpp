/// Distributions of test statistics.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace kilotwin::stats {

/// Half width of the central 95 % of the normal distribution, in standard deviations.
inline constexpr double kNormal95 = 1.96;

/// P(Z <= z) and the density at z, Z standard normal.
[[nodiscard]] inline double normal_cdf(double z) { return 0.5 * std::erfc(-z * M_SQRT1_2); }
[[nodiscard]] inline double normal_pdf(double z) { return std::exp(-z * z / 2) / std::sqrt(2 * M_PI); }

/// P(X > x), X chi-squared distributed with this many degrees of freedom.
[[nodiscard]] double chi_squared_tail(double x, double degrees);
/// log10 of the same; exact also where the probability underflows.
[[nodiscard]] double log10_chi_squared_tail(double x, double degrees);

/// The value that a t distributed variable exceeds with probability 1 - p.
[[nodiscard]] double student_quantile(double p, double degrees);

/// Standard deviation of the standard Gumbel distribution, exp(-exp(-x)); its mean is Euler's constant.
inline constexpr double kGumbelSd = 1.28254983016186409554;  // pi / sqrt(6)

/// The value that the maximum of many independent variables exceeds with probability 1 - p: the quantile of the Gumbel
/// distribution with this mean and standard deviation (Gumbel 1958, fit by moments). 0 < p < 1; the unit is that of the
/// mean.
[[nodiscard]] inline double gumbel_quantile(double p, double mean, double standard_deviation) {
  return mean + standard_deviation * (-std::log(-std::log(p)) - std::numbers::egamma) / kGumbelSd;
}

/// 95 % interval of the mean of a Poisson distribution of which one variable is `count` (Garwood 1936). count >= 0.
[[nodiscard]] std::pair<double, double> poisson_interval(double count);

/// 95 % interval of a probability of which `hits` of `trials` independent trials tell (Wilson 1927). trials > 0.
[[nodiscard]] inline std::pair<double, double> wilson_interval(double hits, double trials) {
  const double share = hits / trials, z2 = kNormal95 * kNormal95 / trials;
  const double centre = share + z2 / 2, half = std::sqrt(z2 * (share * (1 - share) + z2 / 4));
  return {std::max(0.0, (centre - half) / (1 + z2)), std::min(1.0, (centre + half) / (1 + z2))};
}

}  // namespace kilotwin::stats
