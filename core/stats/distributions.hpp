/// Distributions of test statistics.
#pragma once

#include <cmath>

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

}  // namespace kilotwin::stats
