#include "clients/identify/model/stalls.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace kilotwin::identify {
namespace {

/// (t / scale)^shape.
double power_of(const Stalls& stalls, double t_s) {
  const double in_scales = t_s / stalls.scale_s;
  return stalls.shape == 1 ? in_scales : std::pow(in_scales, stalls.shape);
}

/// Integral of the survival function from t_s to the longest duration, in units of the scale; tail above 1.
double survival_beyond(const Stalls& stalls, double t_s) {
  if (stalls.shape == 1) {
    const auto power = [&](double s) { return std::pow(1 + s / stalls.scale_s, 1 - stalls.tail); };
    return std::max(0.0, power(std::min(t_s, stalls.longest_s)) - power(stalls.longest_s)) / (stalls.tail - 1);
  }
  // Simpson's rule over log(1 + t / scale).
  constexpr int kIntervals = 64;
  const double from = std::log1p(std::min(t_s, stalls.longest_s) / stalls.scale_s),
               step = (std::log1p(stalls.longest_s / stalls.scale_s) - from) / kIntervals;
  double sum = 0;
  for (int i = 0; i <= kIntervals; ++i) {
    const double grown = std::exp(from + i * step);
    const double weight = i == 0 || i == kIntervals ? 1 : i % 2 == 1 ? 4 : 2;
    sum += weight * grown * std::pow(1 + power_of(stalls, stalls.scale_s * (grown - 1)), -stalls.tail);
  }
  return sum * step / 3;
}

/// Log likelihood of the durations, given that each was seen, plus the prior.
double log_posterior(const std::vector<Spell>& spells, double least_s, const Stalls& stalls) {
  // Middle and standard deviations of the prior of a law. Larger deviations leave more to the spells; smaller ones pull
  // laws of few spells to the middle.
  constexpr double kTail = 2.5, kTail_sd = 0.6, kScale_s = 5, kScale_sd = 1.5,
                   kShape_sd = 0.6;  // of the logarithms
  const double unseen = stalls.tail * std::log1p(power_of(stalls, least_s)), of_scale = std::log(stalls.scale_s);
  double sum = 0;
  for (const Spell& spell : spells) {
    const double t = std::log(std::max(spell.length_s, least_s)) - of_scale,
                 beyond = std::log1p(std::exp(stalls.shape * t));
    sum += unseen - stalls.tail * beyond;
    if (!spell.censored)
      sum += std::log(stalls.tail * stalls.shape / stalls.scale_s) + (stalls.shape - 1) * t - beyond;
  }
  return sum - 0.5 * std::pow(std::log(stalls.tail / kTail) / kTail_sd, 2) -
         0.5 * std::pow((of_scale - std::log(kScale_s)) / kScale_sd, 2) -
         0.5 * std::pow(std::log(stalls.shape) / kShape_sd, 2);
}

/// Calls each(law, log posterior) for laws of the durations on a grid that is even in the logarithms of scale, tail and shape.
template <class Each>
void for_each_law(const std::vector<Spell>& spells, double least_s, const Stalls& stalls, Each&& each) {
  // Bounds and numbers of points of the grid. Wider bounds or more points cost time in proportion; laws beyond the bounds
  // are not found.
  constexpr double kLeast_s = 0.3, kMost_s = 100, kLeastTail = 1.2, kMostTail = 12, kLeastShape = 1, kMostShape = 8;
  constexpr int kScales = 60, kTails = 40, kShapes = 7;
  const auto on_grid = [](double least, double most, int i, int count) {
    return least * std::pow(most / least, static_cast<double>(i) / (count - 1));
  };
  Stalls law = stalls;
  for (int k = 0; k < kShapes; ++k) {
    law.shape = on_grid(kLeastShape, kMostShape, k, kShapes);
    for (int i = 0; i < kScales; ++i) {
      law.scale_s = on_grid(kLeast_s, kMost_s, i, kScales);
      for (int j = 0; j < kTails; ++j) {
        law.tail = on_grid(kLeastTail, kMostTail, j, kTails);
        each(law, log_posterior(spells, least_s, law));
      }
    }
  }
}

}  // namespace

double Stalls::survival(double t_s) const {
  return t_s >= longest_s ? 0 : std::pow(1 + power_of(*this, t_s), -tail);
}

double Stalls::mean_length_s() const { return scale_s * survival_beyond(*this, 0); }

double Stalls::length_s(double u) const {
  const double power = std::pow(u, -1 / tail) - 1;
  return std::min(longest_s, scale_s * (shape == 1 ? power : std::pow(power, 1 / shape)));
}

double Stalls::rest_after_s(double lasted_s, double u) const {
  return std::max(0.0, length_s(u * survival(lasted_s)) - lasted_s);
}

double Stalls::rest_s(double u) const {
  if (shape != 1) {
    // A spell that lasts at a random instant lasts for t more with the probability survival_beyond(t) / survival_beyond(0).
    constexpr int kHalvings = 40;
    const double all = survival_beyond(*this, 0);
    double low = 0, high = longest_s;
    for (int i = 0; i < kHalvings; ++i) {
      const double middle = (low + high) / 2;
      (survival_beyond(*this, middle) > u * all ? low : high) = middle;
    }
    return (low + high) / 2;
  }
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
  /// Another shape has to make the durations this much more likely, nat.
  constexpr double kShapeGain = 2;
  double best = -std::numeric_limits<double>::infinity();
  for_each_law(spells, least_s, stalls, [&](const Stalls& law, double value) {
    if (!(value - (law.shape == 1 ? 0 : kShapeGain) > best)) return;
    best = value - (law.shape == 1 ? 0 : kShapeGain);
    stalls.scale_s = law.scale_s;
    stalls.tail = law.tail;
    stalls.shape = law.shape;
  });
}

std::pair<double, double> mean_length_interval_s(const std::vector<Spell>& spells, double least_s,
                                                 const Stalls& stalls) {
  // Share on each side of a 95 % interval, and nat below the best beyond which laws do not count.
  constexpr double kTail = 0.025, kNegligible = 30;
  std::vector<std::pair<double, double>> means;  // with their log posterior
  double best = -std::numeric_limits<double>::infinity(), all = 0;
  for_each_law(spells, least_s, stalls, [&](const Stalls&, double value) { best = std::max(best, value); });
  for_each_law(spells, least_s, stalls, [&](const Stalls& law, double value) {
    if (!(value > best - kNegligible)) return;
    means.emplace_back(law.mean_length_s(), std::exp(value - best));
    all += means.back().second;
  });
  std::sort(means.begin(), means.end());
  std::pair<double, double> out{means.front().first, means.back().first};
  double below = 0;
  for (const auto& [mean_s, weight] : means) {
    if (below <= kTail * all) out.first = mean_s;
    below += weight;
    if (below < (1 - kTail) * all) continue;
    out.second = mean_s;
    break;
  }
  return out;
}

}  // namespace kilotwin::identify
