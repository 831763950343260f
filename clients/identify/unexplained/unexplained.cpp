#include "clients/identify/unexplained/unexplained.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace kilotwin::identify {
namespace {

/// Least ratio of an error to the model's own expectation or to repetitions that counts as large. Both are estimates
/// without an interval of their own.
constexpr double kBeyond = 1.15;
/// Least share of a pattern that is shown, and the most patterns.
constexpr double kShown = 0.02;
constexpr std::size_t kMostPatterns = 6;

/// The error that one comparison leaves to explain.
struct Gap {
  double systematic_mm = 0;
  std::string evidence;
};

Gap largest_gap(const Unexplained& u, const std::optional<ErrorBounds>& bounds) {
  Gap largest;
  const auto note = [&](double systematic_mm, std::string evidence) {
    if (systematic_mm > largest.systematic_mm) largest = {systematic_mm, std::move(evidence)};
  };
  const double learned_mm = u.learner ? u.learner->predicted_mm() : 0;
  // If something is learned, the error of these robots is systematic. Its size then needs no interval over other robots.
  const auto beyond = [&](double floor_mm) {
    return (bounds && bounds->after.low_mm > kBeyond * floor_mm) ||
           (learned_mm > 0 && !u.learner->cross_validated && u.learner->error_low_mm > kBeyond * floor_mm);
  };
  const auto above = [&](double floor_mm) {
    return std::sqrt(std::max(0.0, u.error_mm * u.error_mm - floor_mm * floor_mm));
  };
  if (u.expected_mm > 0 && beyond(u.expected_mm))
    note(above(u.expected_mm), fmt::format("the model itself expects {:.2f} mm", u.expected_mm));
  if (u.repetitions_mm && beyond(*u.repetitions_mm))
    note(above(*u.repetitions_mm),
         fmt::format("repetitions of the same commands differ by {:.2f} mm only", *u.repetitions_mm));
  if (learned_mm > 0)
    note(learned_mm, fmt::format("a random forest over all covariates predicts that part of it{}",
                                 u.learner->cross_validated ? ", in cross-validation" : ""));
  return largest;
}

std::string words_of(const Pattern& p) {
  std::vector<std::string> names;
  for (const Feature f : p.over) names.emplace_back(in_words(f));
  return fmt::format("{} ({:.0f} %)", fmt::join(names, " with "), 100 * p.share);
}

/// Whether the error exceeds the model's expectation or the difference of repetitions, whatever its uncertainty.
bool exceeds_a_floor(const Unexplained& u) {
  return (u.expected_mm > 0 && u.error_mm > kBeyond * u.expected_mm) ||
         (u.repetitions_mm && u.error_mm > kBeyond * *u.repetitions_mm);
}

/// How the error compares with what the model expects of itself and with repetitions, where no gap is beyond its uncertainty.
std::string comparison_in_words(const Unexplained& u, const std::optional<ErrorBounds>& bounds) {
  if (u.error_mm == 0) return "No held-out data give an error that could be compared with what the model expects.";
  const auto said = [&](const std::string& how) {
    return fmt::format("The error of {:.2f} mm {}", u.error_mm, how);
  };
  if (!u.perhaps)
    return said(u.expected_mm > 0 ? fmt::format("is near what the model expects ({:.2f} mm).", u.expected_mm)
                                  : "is compared with no expectation of the model.");
  const std::string exceeded =
      u.expected_mm > 0 && u.error_mm > kBeyond * u.expected_mm
          ? fmt::format("exceeds the {:.2f} mm that the model expects", u.expected_mm)
          : fmt::format("exceeds the {:.2f} mm by which repetitions of the same commands differ",
                        *u.repetitions_mm);
  return said(exceeded + ", but too few data are held out to be sure: " +
              (bounds
                   ? fmt::format("it is {:.2f} to {:.2f} mm (95 %).", bounds->after.low_mm, bounds->after.high_mm)
                   : "they are one track."));
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
  constexpr double kOdd = 3;
  constexpr std::size_t kFewestRobots = 4;
  std::map<std::uint32_t, PredictionErrors::Part> robots;
  for (const auto& [at, part] : errors.by_track) {
    PredictionErrors::Part& sum = robots[set.runs[at.first].tracks[at.second].robot];
    sum.sum_mm2 += part.sum_mm2;
    sum.rows += part.rows;
  }
  if (robots.size() < kFewestRobots) return {};
  std::vector<std::pair<double, std::uint32_t>> by_error;
  for (const auto& [robot, part] : robots)
    if (part.rows > 0) by_error.emplace_back(std::sqrt(part.sum_mm2 / static_cast<double>(part.rows)), robot);
  if (by_error.empty()) return {};
  std::sort(by_error.begin(), by_error.end());
  const double median_mm = by_error[by_error.size() / 2].first;
  const auto& [largest_mm, robot] = by_error.back();
  if (!(largest_mm > kOdd * median_mm)) return {};
  return fmt::format(" Robot {} has an error of {:.2f} mm, {:.1f} times the median of the robots.", robot,
                     largest_mm, largest_mm / median_mm);
}

std::string words_of(const Unexplained& u, const std::optional<ErrorBounds>& bounds, const std::string& evidence) {
  if (!u.large())
    return comparison_in_words(u, bounds) + (u.perhaps ? variation_in_words(u.patterns) : "") +
           (u.learner ? " A random forest over all covariates predicts no large part of the error."
                      : " There are too few predictions for a random forest to look for a pattern in the error.");
  const double error_mm = u.error_mm > 0 ? u.error_mm : u.learner->error_mm;
  return fmt::format(
             "Of the prediction error of {:.2f} mm, {:.2f} mm are systematic and unexplained ({:.0f} % of the mean "
             "square "
             "error): "
             "{}.",
             error_mm, u.systematic_mm, 100 * u.share, evidence) +
         variation_in_words(u.patterns);
}

}  // namespace

bool leaves_systematic_error(const MeasuredSet& set, const std::vector<Window>& known,
                             const PredictionErrors& errors, std::uint32_t threads) {
  if (errors.rows == 0) return false;
  if (errors.rmse_mm() > kBeyond * errors.expected_mm()) return true;
  const std::optional<LearnerCheck> learner = learner_check(set, known, {}, threads);
  return learner && learner->predicted_mm() > 0;
}

Unexplained find_unexplained(const MeasuredSet& set, const std::vector<Window>& known,
                             const std::vector<Window>& held_out, const PredictionErrors& errors,
                             const std::optional<ErrorBounds>& bounds, const std::optional<Replicates>& replicates,
                             std::uint32_t threads, const Stretches& stretches) {
  Unexplained u;
  u.error_mm = errors.rmse_mm();
  u.expected_mm = errors.expected_mm();
  if (replicates) u.repetitions_mm = replicates->floor_mm;
  u.learner = learner_check(set, known, held_out, threads, stretches);
  const Gap gap = largest_gap(u, bounds);
  u.systematic_mm = gap.systematic_mm;
  u.perhaps = !u.large() && exceeds_a_floor(u);
  if (u.large()) {
    const double error_mm = u.error_mm > 0 ? u.error_mm : u.learner->error_mm;
    u.share = std::min(1.0, gap.systematic_mm * gap.systematic_mm / (error_mm * error_mm));
  }
  if (u.large() || u.perhaps) {
    // Without held-out windows: half of the tracks from the rest.
    u.patterns = held_out.empty() ? patterns_of(part_of(known, 2, 0, true), part_of(known, 2, 0, false), kShown)
                                  : patterns_of(known, held_out, kShown);
    if (u.patterns.size() > kMostPatterns) u.patterns.resize(kMostPatterns);
  }
  u.in_words = words_of(u, bounds, gap.evidence) + odd_robot_in_words(set, errors);
  return u;
}

}  // namespace kilotwin::identify
