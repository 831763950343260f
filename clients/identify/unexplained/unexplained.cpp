#include "clients/identify/unexplained/unexplained.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "clients/identify/result/large_error.hpp"
#include "core/stats/quantiles.hpp"

namespace kilotwin::identify {
namespace {

/// Least share of a pattern that is shown, and the most patterns.
constexpr double kShown = 0.02;
constexpr std::size_t kMostPatterns = 6;

/// One error beside what the model expects. `of`: of which forecasts, in words.
struct Comparison {
  double error_mm, expected_mm;
  std::optional<Interval> interval;
  const char* of;
};

std::vector<Comparison> comparisons_of(const HeldOutErrors& all, const std::optional<HeldOutErrors>& known_starts) {
  std::vector<Comparison> out;
  const auto add = [&](const HeldOutErrors& of, const char* words) {
    if (of.errors.rows > 0)
      out.push_back({of.errors.rmse_mm(), of.errors.expected_mm(),
                     of.bounds ? std::optional(of.bounds->after) : std::nullopt, words});
  };
  add(all, "");
  if (known_starts) add(*known_starts, " from known starts");
  return out;
}

/// The error that one comparison leaves to explain.
struct Gap {
  double systematic_mm = 0;
  double error_mm = 0;  ///< of which it is a part
  std::string of, evidence;
};

Gap largest_gap(const Unexplained& u, const std::vector<Comparison>& comparisons) {
  Gap largest;
  const auto share = [](double systematic_mm, double error_mm) {
    return error_mm > 0 ? systematic_mm / error_mm : 0;
  };
  const auto note = [&](double systematic_mm, double error_mm, const char* of, std::string evidence) {
    if (share(systematic_mm, error_mm) > share(largest.systematic_mm, largest.error_mm))
      largest = {systematic_mm, error_mm, of, std::move(evidence)};
  };
  const double learned_mm = u.learner ? u.learner->predicted_mm() : 0;
  for (const Comparison& c : comparisons) {
    // If something is learned, the error of these robots is systematic. Its size then needs no interval over other robots.
    const auto beyond = [&](double floor_mm) {
      return (c.interval && c.interval->low_mm > kLargeErrorRatio * floor_mm) ||
             (learned_mm > 0 && !u.learner->cross_validated &&
              u.learner->error_low_mm > kLargeErrorRatio * floor_mm);
    };
    const auto above = [&](double floor_mm) {
      return std::sqrt(std::max(0.0, c.error_mm * c.error_mm - floor_mm * floor_mm));
    };
    if (c.expected_mm > 0 && beyond(c.expected_mm))
      note(above(c.expected_mm), c.error_mm, c.of,
           fmt::format("the model itself expects {:.2f} mm", c.expected_mm));
    if (u.repetitions_mm && beyond(*u.repetitions_mm))
      note(above(*u.repetitions_mm), c.error_mm, c.of,
           fmt::format("repetitions of the same commands differ by {:.2f} mm only", *u.repetitions_mm));
  }
  // Its windows are those from known starts.
  const char* const of = comparisons.empty() ? "" : comparisons.back().of;
  if (learned_mm > 0)
    note(learned_mm, u.learner->error_mm, of,
         fmt::format("a random forest over all covariates predicts that part of it{}",
                     u.learner->cross_validated ? ", in cross-validation" : ""));
  return largest;
}

std::string words_of(const Pattern& p) {
  std::vector<std::string> names;
  for (const Feature f : p.over) names.emplace_back(in_words(f));
  return fmt::format("{} ({:.0f} %)", fmt::join(names, " with "), 100 * p.share);
}

/// The comparison in which the error exceeds the model's expectation or the difference of repetitions, whatever its uncertainty. Null: in
/// none.
const Comparison* exceeding(const Unexplained& u, const std::vector<Comparison>& comparisons) {
  const auto found = std::find_if(comparisons.begin(), comparisons.end(), [&](const Comparison& c) {
    return (c.expected_mm > 0 && c.error_mm > kLargeErrorRatio * c.expected_mm) ||
           (u.repetitions_mm && c.error_mm > kLargeErrorRatio * *u.repetitions_mm);
  });
  return found == comparisons.end() ? nullptr : &*found;
}

/// How the error compares with what the model expects of itself and with repetitions, where no gap is beyond its uncertainty.
std::string comparison_in_words(const Unexplained& u, const Comparison* exceeds) {
  if (u.error_mm == 0) return "No held-out data give an error that could be compared with what the model expects.";
  if (exceeds == nullptr)
    return fmt::format("The error of {:.2f} mm {}", u.error_mm,
                       u.expected_mm > 0 ? fmt::format("is near what the model expects ({:.2f} mm).", u.expected_mm)
                                         : "is compared with no expectation of the model.");
  const Comparison& c = *exceeds;
  const std::string exceeded =
      c.expected_mm > 0 && c.error_mm > kLargeErrorRatio * c.expected_mm
          ? fmt::format("exceeds the {:.2f} mm that the model expects", c.expected_mm)
          : fmt::format("exceeds the {:.2f} mm by which repetitions of the same commands differ",
                        *u.repetitions_mm);
  return fmt::format(
      "The error of {:.2f} mm{} {}, but too few data are held out to be sure: {}", c.error_mm, c.of, exceeded,
      c.interval ? fmt::format("it is {:.2f} to {:.2f} mm (95 %).", c.interval->low_mm, c.interval->high_mm)
                 : "they are one track.");
}

std::string variation_in_words(const std::vector<Pattern>& patterns) {
  if (patterns.empty()) return " No covariate and no pair of covariates shows a pattern of it.";
  std::vector<std::string> shown;
  for (std::size_t i = 0; i < std::min<std::size_t>(3, patterns.size()); ++i)
    shown.push_back(words_of(patterns[i]));
  return fmt::format(" It varies with {}.", fmt::join(shown, ", "));
}

/// A robot whose error is several times that of the others, in one sentence; empty: none.
std::string odd_robot_in_words(const MeasuredSet& set, const PredictionErrors& errors) {
  constexpr double kOdd = 3;  // multiple of the robots' median; a smaller one names robots that differ by chance
  constexpr std::size_t kFewestRobots = 4;  // robots; with fewer, the median says little, and no robot is named
  std::map<std::uint32_t, PredictionErrors::Part> robots;
  for (const auto& [at, part] : errors.by_track) {
    PredictionErrors::Part& sum = robots[set.runs[at.first].tracks[at.second].robot];
    sum.sum_mm2 += part.sum_mm2;
    sum.rows += part.rows;
  }
  if (robots.size() < kFewestRobots) return {};
  std::vector<double> errors_mm;
  std::pair<double, std::uint32_t> largest{-1, 0};
  for (const auto& [robot, part] : robots) {
    if (part.rows == 0) continue;
    errors_mm.push_back(std::sqrt(part.sum_mm2 / static_cast<double>(part.rows)));
    largest = std::max(largest, {errors_mm.back(), robot});
  }
  if (errors_mm.empty()) return {};
  const double median_mm = stats::upper_median(errors_mm);
  const auto& [largest_mm, robot] = largest;
  if (!(largest_mm > kOdd * median_mm)) return {};
  return fmt::format(" Robot {} has an error of {:.2f} mm, {:.1f} times the median of the robots.", robot,
                     largest_mm, largest_mm / median_mm);
}

std::string words_of(const Unexplained& u, const Gap& gap, const Comparison* exceeds) {
  if (!u.large())
    return comparison_in_words(u, exceeds) + (u.perhaps ? variation_in_words(u.patterns) : "") +
           (u.learner ? " A random forest over all covariates predicts no large part of the error."
                      : " There are too few predictions for a random forest to look for a pattern in the error.");
  return fmt::format(
             "Of the prediction error of {:.2f} mm{}, {:.2f} mm are systematic and unexplained ({:.0f} % of the "
             "mean "
             "square error): {}.",
             gap.error_mm, gap.of, u.systematic_mm, 100 * u.share, gap.evidence) +
         variation_in_words(u.patterns);
}

}  // namespace

bool leaves_systematic_error(const MeasuredSet& set, const std::vector<Window>& known,
                             const PredictionErrors& errors, const std::optional<Replicates>& replicates,
                             std::uint32_t threads) {
  if (errors.rows == 0) return false;
  if (errors.rmse_mm() > kLargeErrorRatio * errors.expected_mm()) return true;
  if (replicates &&
      std::hypot(replicates->repeatable_mm, replicates->floor_mm) > kLargeErrorRatio * replicates->floor_mm)
    return true;
  const std::optional<LearnerCheck> learner = learner_check(set, known, {}, threads);
  return learner && learner->predicted_mm() > 0;
}

Unexplained find_unexplained(const MeasuredSet& set, const std::vector<Window>& known,
                             const std::vector<Window>& held_out, const HeldOutErrors& all,
                             const std::optional<HeldOutErrors>& known_starts,
                             const std::optional<Replicates>& replicates, std::uint32_t threads,
                             const Stretches& stretches) {
  Unexplained u;
  u.error_mm = all.errors.rmse_mm();
  u.expected_mm = all.errors.expected_mm();
  if (known_starts) {
    u.known_starts_mm = known_starts->errors.rmse_mm();
    u.known_starts_expected_mm = known_starts->errors.expected_mm();
  }
  if (replicates) u.repetitions_mm = replicates->floor_mm;
  u.learner = learner_check(set, known, held_out, threads, stretches);
  const std::vector<Comparison> comparisons = comparisons_of(all, known_starts);
  const Gap gap = largest_gap(u, comparisons);
  const Comparison* const exceeds = exceeding(u, comparisons);
  u.systematic_mm = gap.systematic_mm;
  u.perhaps = !u.large() && exceeds != nullptr;
  if (u.large()) u.share = std::min(1.0, gap.systematic_mm * gap.systematic_mm / (gap.error_mm * gap.error_mm));
  if (u.large() || u.perhaps) {
    // Without held-out windows: half of the tracks from the rest.
    u.patterns = held_out.empty() ? patterns_of(part_of(known, 2, 0, true), part_of(known, 2, 0, false), kShown)
                                  : patterns_of(known, held_out, kShown);
    if (u.patterns.size() > kMostPatterns) u.patterns.resize(kMostPatterns);
  }
  u.in_words =
      words_of(u, gap, exceeds) + odd_robot_in_words(set, known_starts ? known_starts->errors : all.errors);
  return u;
}

}  // namespace kilotwin::identify
