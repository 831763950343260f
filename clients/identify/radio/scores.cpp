#include "clients/identify/radio/scores.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "clients/identify/radio/link_fit.hpp"

namespace kilotwin::radio_fit {
namespace {

constexpr double kSilent = 0.02, kWhole = 0.6, kFarLink_mm = 125;
/// Shrinks a pair's mean and dispersion towards its displacement class, with the weight of this many runs.
constexpr double kPriorRuns = 0.5;

double log_beta(double a, double b) { return std::lgamma(a) + std::lgamma(b) - std::lgamma(a + b); }

/// Log beta-binomial probability without the binomial coefficient, which is common to all models.
double log_beta_binomial(double count, double of, double mean, double dispersion) {
  mean = std::clamp(mean, 1e-3, 1 - 1e-3);
  dispersion = std::clamp(dispersion, 1e-4, 0.98);
  const double strength = 1 / dispersion - 1, a = mean * strength, b = (1 - mean) * strength;
  const double coefficient = std::lgamma(of + 1) - std::lgamma(count + 1) - std::lgamma(of - count + 1);
  return coefficient + log_beta(count + a, of - count + b) - log_beta(a, b);
}

/// Means and variances of shares over runs.
struct Moments {
  double runs = 0, sum = 0, squares = 0, sent = 0;
  void add(double share, double of) {
    runs += 1;
    sum += share;
    squares += share * share;
    sent += of;
  }
};

std::pair<int, int> class_of(const GridSet& set, int i, int j) {
  return {std::abs(i / set.side() - j / set.side()), std::abs(i % set.side() - j % set.side())};
}

}  // namespace

Statistics statistics(const GridSet& set) {
  Statistics s;
  const int robots = set.robots();
  double sent = 0, known_sent = 0, silent = 0, entries = 0, spread = 0, pairs = 0, near = 0, near_entries = 0,
         partial = 0, far_entries = 0;
  std::map<std::pair<int, int>, Moments> classes;
  std::vector<Moments> senders(static_cast<std::size_t>(robots));
  for (int i = 0; i < robots; ++i) {
    for (int j = 0; j < robots; ++j) {
      Moments pair;
      for (const GridRun& run : set.runs) {
        if (i == j) {
          if (run.counts(i, i) < 0) continue;
          sent += run.counts(i, i);
          known_sent += 1;
          continue;
        }
        const double share = run.share(i, j);
        if (share < 0) continue;
        pair.add(share, run.sent(j));
        classes[class_of(set, i, j)].add(share, 1);
        senders[static_cast<std::size_t>(j)].add(share, 1);
        silent += share < kSilent;
        entries += 1;
        if (set.distance_mm(i, j) > kFarLink_mm && set.distance_mm(i, j) < kNeverHeard_mm) {
          partial += share > kSilent && share < kWhole;
          far_entries += 1;
        }
        if (set.distance_mm(i, j) > kSurelyHeard_mm) continue;
        near += share;
        near_entries += 1;
      }
      if (pair.runs < 2) continue;
      const double mean = pair.sum / pair.runs;
      spread += std::sqrt(std::max(0.0, (pair.squares - pair.runs * mean * mean) / (pair.runs - 1)));
      pairs += 1;
    }
  }
  s.sent = sent / known_sent;
  s.silent = silent / entries;
  s.run_spread = pairs > 0 ? spread / pairs : 0;
  s.near = near / near_entries;
  s.partial = far_entries > 0 ? partial / far_entries : 0;
  Moments over;
  for (const Moments& sender : senders) {
    if (sender.runs > 0) over.add(sender.sum / sender.runs, 1);
  }
  const double mean = over.sum / over.runs;
  s.sender_spread = std::sqrt(std::max(0.0, over.squares / over.runs - mean * mean));
  for (const auto& [key, moments] : classes) {
    s.classes.push_back(
        {key.first, key.second, set.pitch_mm * std::hypot(key.first, key.second), moments.sum / moments.runs});
  }
  std::sort(s.classes.begin(), s.classes.end(), [](const DisplacementClass& a, const DisplacementClass& b) {
    return std::pair(a.distance_mm, a.rows) < std::pair(b.distance_mm, b.rows);
  });
  return s;
}

double log_likelihood(const GridSet& measured, const GridSet& model) {
  const int robots = measured.robots();
  std::map<std::pair<int, int>, Moments> classes;
  for (int i = 0; i < robots; ++i) {
    for (int j = 0; j < robots; ++j) {
      for (const GridRun& run : model.runs) {
        if (i != j && run.share(i, j) >= 0) classes[class_of(model, i, j)].add(run.share(i, j), 1);
      }
    }
  }
  double sum = 0, entries = 0;
  for (int i = 0; i < robots; ++i) {
    for (int j = 0; j < robots; ++j) {
      if (i == j) continue;
      Moments own;
      for (const GridRun& run : model.runs) {
        if (run.share(i, j) >= 0) own.add(run.share(i, j), run.sent(j));
      }
      const Moments& all = classes[class_of(model, i, j)];
      const double runs = own.runs + kPriorRuns;
      const double mean = (own.sum + kPriorRuns * all.sum / all.runs) / runs;
      const double square = (own.squares + kPriorRuns * all.squares / all.runs) / runs;
      const double of = own.runs > 0 ? own.sent / own.runs : 300;
      const double binary = std::max(mean * (1 - mean), 1e-6);
      const double dispersion = ((square - mean * mean) / binary - 1 / of) / (1 - 1 / of);
      for (const GridRun& run : measured.runs) {
        if (run.share(i, j) < 0) continue;
        const double sent = run.sent(j);
        sum += log_beta_binomial(std::min(run.counts(i, j), sent), sent, mean, dispersion);
        entries += 1;
      }
    }
  }
  return sum / entries;
}

Errors compare(const GridSet& measured, const GridSet& simulated, const GridSet& reference) {
  Errors e;
  const Statistics real = statistics(measured);
  e.simulated = statistics(simulated);
  e.sent = e.simulated.sent - real.sent;
  e.silent = e.simulated.silent - real.silent;
  e.sender_spread = e.simulated.sender_spread - real.sender_spread;
  e.run_spread = e.simulated.run_spread - real.run_spread;
  for (std::size_t c = 0; c < real.classes.size(); ++c) {
    const double difference = std::abs(e.simulated.classes[c].reception - real.classes[c].reception);
    double& worst = real.classes[c].distance_mm <= kSurelyHeard_mm ? e.near_worst : e.far_worst;
    if (real.classes[c].distance_mm <= kSurelyHeard_mm || real.classes[c].distance_mm > kFarLink_mm)
      worst = std::max(worst, difference);
  }
  e.log_likelihood = log_likelihood(measured, simulated);
  e.deficit = log_likelihood(measured, reference) - e.log_likelihood;
  return e;
}

}  // namespace kilotwin::radio_fit
