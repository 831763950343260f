/// Spells in which the wheels of a robot stand still, or slip, although a motor is on: rare events at random times. They follow
/// `Episodes` of idl/effects.proto. The time from the end of a spell to the next is exponential, the duration has a Burr XII
/// distribution (Lomax for a shape of 1).
#pragma once

#include <utility>
#include <vector>

namespace kilotwin::identify {

/// A spell as the tracks show it.
struct Spell {
  double start_s, length_s;
  bool censored;  ///< it lasted when the track ended, or when it began
};

struct Stalls {
  double mean_apart_s = 300;
  double scale_s = 5, tail = 2;  ///< P(duration > t) = (1 + (t / scale_s)^shape)^-tail
  double shape = 1;
  double longest_s = 3600;
  double gain = 0;  ///< factor of the wheels' speeds during a spell: 0 stands still

  /// P(duration > t_s).
  [[nodiscard]] double survival(double t_s) const;
  /// Mean duration, s.
  [[nodiscard]] double mean_length_s() const;
  /// Share of the time in spells.
  [[nodiscard]] double share() const;
  /// The duration that is exceeded with this probability, s; u in (0, 1].
  [[nodiscard]] double length_s(double u) const;
  /// The same of the rest of a spell that lasts at a random instant.
  [[nodiscard]] double rest_s(double u) const;
  /// The same of the rest of a spell that has lasted `lasted_s`.
  [[nodiscard]] double rest_after_s(double lasted_s, double u) const;
  /// Variance of the time in spells during `over_s`, divided by `over_s`, s. Covariance of two instants: that of rare spells.
  [[nodiscard]] double variance_s(double over_s) const;
};

/// Scale, tail and shape of maximum likelihood, with a weak prior. Spells shorter than `least_s` are not seen.
void fit_lengths(const std::vector<Spell>&, double least_s, Stalls&);
/// 95 % interval of the mean duration, s: of its posterior distribution, with the same prior. Of the stalls, `longest_s` counts.
[[nodiscard]] std::pair<double, double> mean_length_interval_s(const std::vector<Spell>&, double least_s,
                                                               const Stalls&);

}  // namespace kilotwin::identify
