#include "clients/identify/unexplained/unexplained.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "clients/identify/unexplained/random_forest.hpp"

namespace kilotwin::identify {
namespace {

/// Fewest windows that a learner is trained on and judged on.
constexpr std::size_t kFewestKnown = 150, kFewestHeldOut = 40;
/// Least share of the mean square error that counts as large.
constexpr double kLarge = 0.05;
/// The same for the model's own expectation and for repetitions: both are estimates without an interval of their own.
constexpr double kBeyond = 1.15;
/// Least share of a pattern that is shown, and the most patterns.
constexpr double kShown = 0.02;
constexpr std::size_t kMostPatterns = 6;

Eigen::MatrixXf covariates_of(const std::vector<Window>& windows) {
  // Angles as cosine and sine, so that both sides of the cut are near.
  constexpr Feature kAngles[] = {Feature::kHeading, Feature::kBearing};
  Eigen::MatrixXf out(static_cast<Eigen::Index>(windows.size()), static_cast<Eigen::Index>(kFeatures + 2));
  for (std::size_t i = 0; i < windows.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    for (std::size_t f = 0; f < kFeatures; ++f)
      out(row, static_cast<Eigen::Index>(f)) = static_cast<float>(windows[i].at[f]);
    Eigen::Index next = kFeatures;
    for (const Feature angle : kAngles) {
      out(row, static_cast<Eigen::Index>(angle)) = static_cast<float>(std::cos(windows[i][angle]));
      out(row, next++) = static_cast<float>(std::sin(windows[i][angle]));
    }
  }
  return out;
}

Eigen::MatrixX2f errors_of(const std::vector<Window>& windows, bool in_body) {
  Eigen::MatrixX2f out(static_cast<Eigen::Index>(windows.size()), 2);
  for (std::size_t i = 0; i < windows.size(); ++i)
    out.row(static_cast<Eigen::Index>(i)) =
        (in_body ? windows[i].in_body_mm : windows[i].in_world_mm).cast<float>().transpose();
  return out;
}

/// Errors of `judged` after subtraction of what a learner of `known` predicts.
Eigen::MatrixX2f left_of(const std::vector<Window>& known, const std::vector<Window>& judged, bool in_body) {
  const RandomForest learner(covariates_of(known), errors_of(known, in_body));
  return errors_of(judged, in_body) - learner.predict(covariates_of(judged));
}

/// Windows of the tracks with this remainder, or of all others.
std::vector<Window> part_of(const std::vector<Window>& all, std::size_t folds, std::size_t fold, bool inside) {
  std::vector<Window> part;
  for (const Window& w : all)
    if (((w.run + w.place) % folds == fold) == inside) part.push_back(w);
  return part;
}

/// Whether errors ahead and to the left are easier to learn than those along x and y: half of the tracks from the rest.
bool body_is_better(const std::vector<Window>& known) {
  const std::vector<Window> first = part_of(known, 2, 0, true), second = part_of(known, 2, 0, false);
  if (std::min(first.size(), second.size()) < kFewestKnown / 2) return true;
  return left_of(first, second, true).squaredNorm() < left_of(first, second, false).squaredNorm();
}

void add(PredictionErrors& to, const Window& w, double square_mm2) {
  PredictionErrors::Part& part = to.by_track[{w.run, w.place}];
  part.sum_mm2 += square_mm2;
  part.rows += 1;
  to.sum_mm2 += square_mm2;
  ++to.rows;
}

std::optional<LearnerCheck> check_of(const MeasuredSet& set, const std::vector<Window>& known,
                                     const std::vector<Window>& held_out) {
  const bool cross_validated = held_out.empty();
  if (known.size() < kFewestKnown || (!cross_validated && held_out.size() < kFewestHeldOut)) return std::nullopt;
  const bool in_body = body_is_better(known);
  PredictionErrors with, without;
  const auto judge = [&](const std::vector<Window>& from, const std::vector<Window>& judged) {
    const Eigen::MatrixX2f left = left_of(from, judged, in_body);
    for (std::size_t i = 0; i < judged.size(); ++i) {
      add(without, judged[i], judged[i].in_world_mm.squaredNorm());
      add(with, judged[i], static_cast<double>(left.row(static_cast<Eigen::Index>(i)).squaredNorm()));
    }
  };
  constexpr std::size_t kFolds = 4;
  if (!cross_validated) judge(known, held_out);
  for (std::size_t fold = 0; cross_validated && fold < kFolds; ++fold) {
    const std::vector<Window> judged = part_of(known, kFolds, fold, true),
                              rest = part_of(known, kFolds, fold, false);
    if (!judged.empty() && rest.size() >= kFewestKnown / 2) judge(rest, judged);
  }
  const std::optional<ErrorBounds> bounds = bounds_of(set, without, with);
  if (!bounds) return std::nullopt;
  return LearnerCheck{without.rmse_mm(), with.rmse_mm(), bounds->less_by, cross_validated};
}

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
  const auto beyond = [&](double floor_mm) { return bounds && bounds->after.low_mm > kBeyond * floor_mm; };
  const auto above = [&](double floor_mm) {
    return std::sqrt(std::max(0.0, u.error_mm * u.error_mm - floor_mm * floor_mm));
  };
  if (u.expected_mm > 0 && beyond(u.expected_mm))
    note(above(u.expected_mm), fmt::format("the model itself expects {:.2f} mm", u.expected_mm));
  if (u.repetitions_mm && beyond(*u.repetitions_mm))
    note(above(*u.repetitions_mm),
         fmt::format("repetitions of the same commands differ by {:.2f} mm only", *u.repetitions_mm));
  if (u.learner && u.learner->predicted_mm() > 0)
    note(u.learner->predicted_mm(), fmt::format("a random forest over all covariates predicts that part of it{}",
                                                u.learner->cross_validated ? ", in cross-validation" : ""));
  return largest;
}

std::string words_of(const Pattern& p) {
  std::vector<std::string> names;
  for (const Feature f : p.over) names.emplace_back(name_of(f));
  std::string text = fmt::format("{} ({:.0f} %)", fmt::join(names, " with "), 100 * p.share);
  std::replace(text.begin(), text.end(), '_', ' ');
  return text;
}

/// How the error compares with what the model expects of itself, where no gap is beyond its uncertainty.
std::string comparison_in_words(const Unexplained& u, const std::optional<ErrorBounds>& bounds) {
  if (u.error_mm == 0) return "No held-out data give an error that could be compared with what the model expects.";
  if (!bounds)
    return "There is one held-out track only, so that the error is not compared with what the model expects.";
  if (u.expected_mm > 0 && u.error_mm <= kBeyond * u.expected_mm)
    return fmt::format("The error of {:.2f} mm is near what the model expects ({:.2f} mm).", u.error_mm,
                       u.expected_mm);
  return fmt::format(
      "The error of {:.2f} mm exceeds the {:.2f} mm that the model expects, but too few data are held out to be "
      "sure: "
      "it is {:.2f} to {:.2f} mm (95 %).",
      u.error_mm, u.expected_mm, bounds->after.low_mm, bounds->after.high_mm);
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
    return comparison_in_words(u, bounds) +
           (u.learner ? " A random forest over all covariates predicts no large part of the error."
                      : " There are too few predictions for a random forest to look for a pattern in the error.");
  const double error_mm = u.error_mm > 0 ? u.error_mm : u.learner->error_mm;
  std::string out = fmt::format(
      "Of the prediction error of {:.2f} mm, {:.2f} mm are systematic and unexplained ({:.0f} % of the mean square "
      "error): "
      "{}.",
      error_mm, u.systematic_mm, 100 * u.share, evidence);
  if (u.patterns.empty()) return out + " No covariate and no pair of covariates shows a pattern of it.";
  std::vector<std::string> shown;
  for (std::size_t i = 0; i < std::min<std::size_t>(3, u.patterns.size()); ++i)
    shown.push_back(words_of(u.patterns[i]));
  return out + fmt::format(" It varies with {}.", fmt::join(shown, ", "));
}

}  // namespace

double LearnerCheck::predicted_mm() const {
  const double square = error_mm * error_mm - error_left_mm * error_left_mm;
  return less_by_mm.low_mm > 0 && square > kLarge * error_mm * error_mm ? std::sqrt(square) : 0;
}

bool leaves_systematic_error(const MeasuredSet& set, const std::vector<Window>& known,
                             const PredictionErrors& errors) {
  if (errors.rows == 0) return false;
  if (errors.rmse_mm() > kBeyond * errors.expected_mm()) return true;
  const std::optional<LearnerCheck> learner = check_of(set, known, {});
  return learner && learner->predicted_mm() > 0;
}

Unexplained find_unexplained(const MeasuredSet& set, const std::vector<Window>& known,
                             const std::vector<Window>& held_out, const PredictionErrors& errors,
                             const std::optional<ErrorBounds>& bounds,
                             const std::optional<Replicates>& replicates) {
  Unexplained u;
  u.error_mm = errors.rmse_mm();
  u.expected_mm = errors.expected_mm();
  if (replicates) u.repetitions_mm = replicates->floor_mm;
  u.learner = check_of(set, known, held_out);
  const Gap gap = largest_gap(u, bounds);
  u.systematic_mm = gap.systematic_mm;
  if (u.large()) {
    const double error_mm = u.error_mm > 0 ? u.error_mm : u.learner->error_mm;
    u.share = std::min(1.0, gap.systematic_mm * gap.systematic_mm / (error_mm * error_mm));
    // Without held-out windows: half of the tracks from the rest.
    u.patterns = held_out.empty() ? patterns_of(part_of(known, 2, 0, true), part_of(known, 2, 0, false), kShown)
                                  : patterns_of(known, held_out, kShown);
    if (u.patterns.size() > kMostPatterns) u.patterns.resize(kMostPatterns);
  }
  u.in_words = words_of(u, bounds, gap.evidence) + odd_robot_in_words(set, errors);
  return u;
}

}  // namespace kilotwin::identify
