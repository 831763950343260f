#include "clients/identify/model/stalls.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace kilotwin::identify {
namespace {

/// Integral of the survival function from t_s to the longest duration, in units of the scale; tail above 1.
double survival_beyond(const Stalls& stalls, double t_s) {
  const auto power = [&](double s) { return std::pow(1 + s / stalls.scale_s, 1 - stalls.tail); };
  return std::max(0.0, power(std::min(t_s, stalls.longest_s)) - power(stalls.longest_s)) / (stalls.tail - 1);
}

/// Log likelihood of the durations, given that each was seen, plus the prior.
double log_posterior(const std::vector<Spell>& spells, double least_s, const Stalls& stalls) {
  constexpr double kTail = 2.5, kTail_sd = 0.6, kScale_s = 5, kScale_sd = 1.5;  // of the logarithms
  double sum = 0;
  for (const Spell& spell : spells) {
    const double t = std::max(spell.length_s, least_s);
    sum += -stalls.tail * std::log1p(t / stalls.scale_s) + stalls.tail * std::log1p(least_s / stalls.scale_s);
    if (!spell.censored) sum += std::log(stalls.tail / stalls.scale_s) - std::log1p(t / stalls.scale_s);
  }
  return sum - 0.5 * std::pow(std::log(stalls.tail / kTail) / kTail_sd, 2) -
         0.5 * std::pow(std::log(stalls.scale_s / kScale_s) / kScale_sd, 2);
}

}  // namespace

double Stalls::survival(double t_s) const { return t_s >= longest_s ? 0 : std::pow(1 + t_s / scale_s, -tail); }

double Stalls::mean_length_s() const { return scale_s * survival_beyond(*this, 0); }

double Stalls::length_s(double u) const { return std::min(longest_s, scale_s * (std::pow(u, -1 / tail) - 1)); }

double Stalls::rest_s(double u) const {
  const double least = std::pow(1 + longest_s / scale_s, 1 - tail);
  return scale_s * (std::pow(least + u * (1 - least), 1 / (1 - tail)) - 1);
}

double Stalls::share() const { return mean_length_s() / (mean_length_s() + mean_apart_s); }

double Stalls::variance_s(double over_s) const {
  // A spell that lasts at a random instant lasts for t more with the probability survival_beyond(t) / survival_beyond(0).
  constexpr int kParts = 50;
  const double all = survival_beyond(*this, 0), p = share();
  if (!(all > 0)) return 0;
  double sum = 0;
  for (int i = 0; i < kParts; ++i) {
    const double part = (i + 0.5) / kParts;
    sum += (1 - part) * survival_beyond(*this, part * over_s) / all / kParts;
  }
  return 2 * over_s * p * (1 - p) * sum;
}

void fit_lengths(const std::vector<Spell>& spells, double least_s, Stalls& stalls) {
  constexpr double kLeast_s = 0.3, kMost_s = 100, kLeastTail = 1.2, kMostTail = 12;
  constexpr int kScales = 60, kTails = 40;
  double best = -std::numeric_limits<double>::infinity();
  Stalls trial = stalls;
  for (int i = 0; i < kScales; ++i) {
    trial.scale_s = kLeast_s * std::pow(kMost_s / kLeast_s, static_cast<double>(i) / (kScales - 1));
    for (int j = 0; j < kTails; ++j) {
      trial.tail = kLeastTail * std::pow(kMostTail / kLeastTail, static_cast<double>(j) / (kTails - 1));
      const double value = log_posterior(spells, least_s, trial);
      if (!(value > best)) continue;
      best = value;
      stalls.scale_s = trial.scale_s;
      stalls.tail = trial.tail;
    }
  }
}

}  // namespace kilotwin::identify
