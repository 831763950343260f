#include "clients/identify/unexplained/error_patterns.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace kilotwin::identify {
namespace {

/// Bins of a covariate alone and of each of two, and robots that may have a bin each. More show finer patterns, from fewer
/// windows each.
constexpr std::size_t kBins = 12, kBinsOfPairs = 8, kMostRobots = 64;
/// Windows that pull a mean to 0: means of few windows predict less than they show.
constexpr double kShrink = 4;

const Eigen::Vector2d& error_of(const Window& w, bool in_body) { return in_body ? w.in_body_mm : w.in_world_mm; }

/// Bins of one covariate with about equal numbers of windows; one bin per value of commands and robots.
class Bins {
 public:
  Bins(const std::vector<Window>& windows, Feature feature, std::size_t most) : feature_(feature) {
    std::vector<double> all;
    all.reserve(windows.size());
    for (const Window& w : windows) all.push_back(w[feature]);
    std::sort(all.begin(), all.end());
    std::vector<double> values = all;
    values.erase(std::unique(values.begin(), values.end()), values.end());
    const bool each = feature == Feature::kCommand || (feature == Feature::kRobot && values.size() <= kMostRobots);
    if (each) {
      for (std::size_t i = 0; i + 1 < values.size(); ++i) edges_.push_back((values[i] + values[i + 1]) / 2);
    } else {
      for (std::size_t i = 1; i < most; ++i) {
        const double edge = all[all.size() * i / most];
        if (edges_.empty() ? edge > all.front() : edge > edges_.back()) edges_.push_back(edge);
      }
    }
    std::vector<double> sum(size()), count(size());
    for (const double v : all) sum[place(v)] += v, count[place(v)] += 1;
    for (std::size_t i = 0; i < size(); ++i) at_.push_back(count[i] > 0 ? sum[i] / count[i] : 0);
  }
  [[nodiscard]] std::size_t size() const { return edges_.size() + 1; }
  [[nodiscard]] std::size_t of(const Window& w) const { return place(w[feature_]); }
  [[nodiscard]] const std::vector<double>& at() const { return at_; }

 private:
  [[nodiscard]] std::size_t place(double value) const {
    return static_cast<std::size_t>(std::upper_bound(edges_.begin(), edges_.end(), value) - edges_.begin());
  }
  Feature feature_;
  std::vector<double> edges_, at_;
};

Pattern pattern_of(const std::vector<Window>& known, const std::vector<Window>& held_out,
                   const std::vector<Feature>& over, const Bins& columns, const Bins* rows, bool in_body) {
  const auto height = static_cast<Eigen::Index>(rows != nullptr ? rows->size() : 1),
             width = static_cast<Eigen::Index>(columns.size());
  const auto cell = [&](const Window& w) {
    return std::pair{static_cast<Eigen::Index>(rows != nullptr ? rows->of(w) : 0),
                     static_cast<Eigen::Index>(columns.of(w))};
  };
  Eigen::MatrixXd count = Eigen::MatrixXd::Zero(height, width), first = count, second = count;
  for (const Window& w : known) {
    const auto [row, column] = cell(w);
    count(row, column) += 1;
    first(row, column) += error_of(w, in_body)[0];
    second(row, column) += error_of(w, in_body)[1];
  }
  double before_mm2 = 0, after_mm2 = 0;
  for (const Window& w : held_out) {
    const auto [row, column] = cell(w);
    const double weight = 1 / (count(row, column) + kShrink);
    const Eigen::Vector2d left =
        error_of(w, in_body) - weight * Eigen::Vector2d(first(row, column), second(row, column));
    before_mm2 += error_of(w, in_body).squaredNorm();
    after_mm2 += left.squaredNorm();
  }
  Pattern p{over, in_body, columns.at(), rows != nullptr ? rows->at() : std::vector<double>{0}, {}, {}, 0};
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  p.first_mm = (count.array() > 0).select(first.array() / count.array().max(1), kNaN);
  p.second_mm = (count.array() > 0).select(second.array() / count.array().max(1), kNaN);
  p.share = before_mm2 > 0 ? 1 - after_mm2 / before_mm2 : 0;
  return p;
}

}  // namespace

std::vector<Pattern> patterns_of(const std::vector<Window>& known, const std::vector<Window>& held_out,
                                 double least_share) {
  std::vector<Pattern> found;
  if (known.empty() || held_out.empty()) return found;
  std::array<double, kFeatures> alone{};
  const auto better_frame = [&](const std::vector<Feature>& over, const Bins& columns, const Bins* rows) {
    Pattern world = pattern_of(known, held_out, over, columns, rows, false),
            body = pattern_of(known, held_out, over, columns, rows, true);
    return body.share > world.share ? body : world;
  };
  std::vector<Bins> fine, coarse;
  for (std::size_t f = 0; f < kFeatures; ++f) {
    const auto feature = static_cast<Feature>(f);
    fine.emplace_back(known, feature, kBins);
    coarse.emplace_back(known, feature, kBinsOfPairs);
    Pattern p = better_frame({feature}, fine.back(), nullptr);
    alone[f] = std::max(p.share, 0.0);
    if (p.share >= least_share) found.push_back(std::move(p));
  }
  for (std::size_t f = 0; f < kFeatures; ++f) {
    for (std::size_t g = f + 1; g < kFeatures; ++g) {
      Pattern p = better_frame({static_cast<Feature>(f), static_cast<Feature>(g)}, coarse[f], &coarse[g]);
      if (p.share >= alone[f] + alone[g] + least_share) found.push_back(std::move(p));
    }
  }
  // A pair repeats what its covariates show alone: it counts by what it adds.
  const auto adds = [&](const Pattern& p) {
    if (p.over.size() == 1) return p.share;
    return p.share -
           std::max(alone[static_cast<std::size_t>(p.over[0])], alone[static_cast<std::size_t>(p.over[1])]);
  };
  std::stable_sort(found.begin(), found.end(),
                   [&](const Pattern& a, const Pattern& b) { return adds(a) > adds(b); });
  return found;
}

}  // namespace kilotwin::identify
