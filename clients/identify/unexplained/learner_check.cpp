#include "clients/identify/unexplained/learner_check.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "clients/identify/unexplained/random_forest.hpp"

namespace kilotwin::identify {
namespace {

/// Fewest windows that a learner is trained on and judged on.
constexpr std::size_t kFewestKnown = 150, kFewestHeldOut = 40;
/// Least share of the mean square error that counts as large.
constexpr double kLarge = 0.05;

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
Eigen::MatrixX2f left_of(const std::vector<Window>& known, const std::vector<Window>& judged, bool in_body,
                         std::uint32_t threads) {
  const RandomForest learner(covariates_of(known), errors_of(known, in_body), threads);
  return errors_of(judged, in_body) - learner.predict(covariates_of(judged));
}

/// Whether errors ahead and to the left are easier to learn than those along x and y: half of the tracks from the rest.
bool body_is_better(const std::vector<Window>& known, std::uint32_t threads) {
  const std::vector<Window> first = part_of(known, 2, 0, true), second = part_of(known, 2, 0, false);
  if (std::min(first.size(), second.size()) < kFewestKnown / 2) return true;
  return left_of(first, second, true, threads).squaredNorm() < left_of(first, second, false, threads).squaredNorm();
}

void add(PredictionErrors& to, const Window& w, double square_mm2) {
  PredictionErrors::Part& part = to.by_track[{w.run, w.place}];
  part.sum_mm2 += square_mm2;
  part.rows += 1;
  to.sum_mm2 += square_mm2;
  ++to.rows;
}

/// Whether each held-out robot has tracks in the fit, too. The result then concerns these robots.
bool robots_are_known(const std::vector<Window>& known, const std::vector<Window>& held_out) {
  std::set<double> robots;
  for (const Window& w : known) robots.insert(w[Feature::kRobot]);
  return std::all_of(held_out.begin(), held_out.end(),
                     [&](const Window& w) { return robots.contains(w[Feature::kRobot]); });
}

}  // namespace

std::vector<Window> part_of(const std::vector<Window>& all, std::size_t folds, std::size_t fold, bool inside) {
  std::vector<Window> part;
  for (const Window& w : all)
    if (((w.run + w.place) % folds == fold) == inside) part.push_back(w);
  return part;
}

std::optional<LearnerCheck> learner_check(const MeasuredSet& set, const std::vector<Window>& known,
                                          const std::vector<Window>& held_out, std::uint32_t threads,
                                          const Stretches& stretches) {
  const bool cross_validated = held_out.empty();
  if (known.size() < kFewestKnown || (!cross_validated && held_out.size() < kFewestHeldOut)) return std::nullopt;
  const bool in_body = body_is_better(known, threads);
  PredictionErrors with, without;
  std::map<std::pair<std::uint32_t, double>, Stretch> by_time;  ///< by run and number of the stretch
  const auto judge = [&](const std::vector<Window>& from, const std::vector<Window>& judged) {
    const Eigen::MatrixX2f left = left_of(from, judged, in_body, threads);
    for (std::size_t i = 0; i < judged.size(); ++i) {
      const double before_mm2 = judged[i].in_world_mm.squaredNorm(),
                   after_mm2 = static_cast<double>(left.row(static_cast<Eigen::Index>(i)).squaredNorm());
      add(without, judged[i], before_mm2);
      add(with, judged[i], after_mm2);
      Stretch& stretch = by_time[{judged[i].run, std::floor(judged[i][Feature::kTime] / stretches.length_s)}];
      stretch.before_mm2 += before_mm2;
      stretch.after_mm2 += after_mm2;
      stretch.rows += 1;
    }
  };
  // Folds of the cross-validation; more leave more windows to learn from, and cost a forest each.
  constexpr std::size_t kFolds = 4;
  if (!cross_validated) judge(known, held_out);
  for (std::size_t fold = 0; cross_validated && fold < kFolds; ++fold) {
    const std::vector<Window> judged = part_of(known, kFolds, fold, true),
                              rest = part_of(known, kFolds, fold, false);
    if (!judged.empty() && rest.size() >= kFewestKnown / 2) judge(rest, judged);
  }
  const std::optional<ErrorBounds> bounds = bounds_of(set, without, with);
  if (!bounds) return std::nullopt;
  StretchBounds taken{bounds->before, bounds->less_by};
  if (!cross_validated && stretches.same_robots && robots_are_known(known, held_out)) {
    std::vector<Stretch> drawn;
    drawn.reserve(by_time.size());
    for (const auto& [when, stretch] : by_time) drawn.push_back(stretch);
    taken = bounds_of(drawn).value_or(taken);
  }
  return LearnerCheck{without.rmse_mm(), with.rmse_mm(), taken.less_by, cross_validated, taken.before.low_mm};
}

double LearnerCheck::predicted_mm() const {
  const double square = error_mm * error_mm - error_left_mm * error_left_mm;
  return less_by_mm.low_mm > 0 && square > kLarge * error_mm * error_mm ? std::sqrt(square) : 0;
}

}  // namespace kilotwin::identify
