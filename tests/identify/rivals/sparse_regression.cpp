// Sparse regression of rates on a library of functions, by sequentially thresholded least squares with an ensemble over
// tracks: S. Brunton, J. Proctor, N. Kutz (PNAS 2016); U. Fasel et al., Ensemble-SINDy (Proc. R. Soc. A 2022).
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <memory>
#include <set>
#include <string>

#include "core/stats/moments.hpp"
#include "tests/identify/rivals/columns.hpp"
#include "tests/identify/truth/dice.hpp"

namespace kilotwin::truth {
namespace {

struct Function {
  const char* covariate;
  double (*of)(const Instant&);
};

const Function kLibrary[] = {
    {"time", [](const Instant& i) { return i.time_s / 100; }},
    {"time", [](const Instant& i) { return i.time_s * i.time_s / 1e4; }},
    {"motor_time", [](const Instant& i) { return i.driven_s / 100; }},
    {"motor_time", [](const Instant& i) { return i.driven_s * i.driven_s / 1e4; }},
    {"position", [](const Instant& i) { return i.point.x / 300; }},
    {"position", [](const Instant& i) { return i.point.y / 300; }},
    {"position", [](const Instant& i) { return i.point.x * i.point.x / 9e4; }},
    {"position", [](const Instant& i) { return i.point.x * i.point.y / 9e4; }},
    {"position", [](const Instant& i) { return i.point.y * i.point.y / 9e4; }},
    {"heading", [](const Instant& i) { return std::cos(i.heading_rad); }},
    {"heading", [](const Instant& i) { return std::sin(i.heading_rad); }},
    {"heading", [](const Instant& i) { return std::cos(2 * i.heading_rad); }},
    {"heading", [](const Instant& i) { return std::sin(2 * i.heading_rad); }},
    {"time_since_command", [](const Instant& i) { return std::exp(-i.since_change_s / 0.5); }},
    {"time_since_command", [](const Instant& i) { return std::exp(-i.since_change_s); }},
    {"time_since_command", [](const Instant& i) { return std::exp(-i.since_change_s / 2); }},
    {"time_since_command", [](const Instant& i) { return std::exp(-i.since_change_s / 5); }},
    {"history", [](const Instant& i) { return i.before == Motion::kStop ? 1.0 : 0.0; }},
    {"history", [](const Instant& i) { return i.before == Motion::kLeft ? 1.0 : 0.0; }},
    {"neighbours", [](const Instant& i) { return i.near > 0 ? 1.0 : 0.0; }},
    {"neighbours", [](const Instant& i) { return std::min(i.near, 3) / 2.0; }}};
constexpr Eigen::Index kFunctions = std::size(kLibrary);

/// The base columns, then each function under each command.
void columns_of(const Instant& at, int robots, Eigen::Ref<Eigen::VectorXd> to) {
  const Eigen::Index base = base_columns(robots);
  base_of(at, robots, to.head(base));
  to.tail(3 * kFunctions).setZero();
  const auto command = static_cast<Eigen::Index>(command_of(at));
  if (command == 3) return;
  for (Eigen::Index f = 0; f < kFunctions; ++f) to[base + command * kFunctions + f] = kLibrary[f].of(at);
}

/// Sums of products over the rows of one track.
struct Gram {
  Eigen::MatrixXd xx, xy;
  double yy[3] = {0, 0, 0}, rows = 0;
  Gram& operator+=(const Gram& other) {
    xx += other.xx;
    xy += other.xy;
    for (int k = 0; k < 3; ++k) yy[k] += other.yy[k];
    rows += other.rows;
    return *this;
  }
};

Eigen::VectorXd least_squares(const Gram& g, int response, const std::vector<Eigen::Index>& active) {
  const auto n = static_cast<Eigen::Index>(active.size());
  Eigen::MatrixXd xx(n, n);
  Eigen::VectorXd xy(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    xy[i] = g.xy(active[static_cast<std::size_t>(i)], response);
    for (Eigen::Index j = 0; j < n; ++j)
      xx(i, j) = g.xx(active[static_cast<std::size_t>(i)], active[static_cast<std::size_t>(j)]);
  }
  constexpr double kRidge = 1;  // rows
  xx.diagonal().array() += kRidge;
  const Eigen::VectorXd own = xx.ldlt().solve(xy);
  Eigen::VectorXd all = Eigen::VectorXd::Zero(g.xx.rows());
  for (Eigen::Index i = 0; i < n; ++i) all[active[static_cast<std::size_t>(i)]] = own[i];
  return all;
}

/// Sequentially thresholded least squares. Base columns always stay; others if coefficient times spread is above the
/// threshold.
Eigen::VectorXd thresholded(const Gram& g, int response, const Eigen::VectorXd& spread, Eigen::Index base,
                            double threshold) {
  std::vector<Eigen::Index> active(static_cast<std::size_t>(g.xx.rows()));
  for (std::size_t i = 0; i < active.size(); ++i) active[i] = static_cast<Eigen::Index>(i);
  while (true) {
    const Eigen::VectorXd b = least_squares(g, response, active);
    std::vector<Eigen::Index> kept;
    for (const Eigen::Index i : active)
      if (i < base || std::abs(b[i]) * spread[i] > threshold) kept.push_back(i);
    if (kept.size() == active.size()) return b;
    active = std::move(kept);
  }
}

double error_of(const Gram& g, int response, const Eigen::VectorXd& b) {
  return g.yy[response] - 2 * b.dot(g.xy.col(response)) + b.dot(g.xx * b);
}

/// The largest threshold within a tenth of a standard error of the best in a cross-validation over tracks. `sd`: of the
/// residual of the base columns.
double threshold_of(const std::vector<Gram>& tracks, int response, const Eigen::VectorXd& spread, Eigen::Index base,
                    double sd) {
  constexpr double kThresholds[] = {0.01, 0.02, 0.04, 0.07, 0.1, 0.15, 0.2, 0.3, 0.5, 1e9};
  constexpr std::size_t kFolds = 6;
  const Gram none{Eigen::MatrixXd::Zero(spread.size(), spread.size()), Eigen::MatrixXd::Zero(spread.size(), 3)};
  double means_of[std::size(kThresholds)], se_of_best = 0, best = INFINITY;
  for (std::size_t t = 0; t < std::size(kThresholds); ++t) {
    stats::Moments errors;
    for (std::size_t fold = 0; fold < kFolds; ++fold) {
      Gram train = none, test = none;
      for (std::size_t i = 0; i < tracks.size(); ++i) (i % kFolds == fold ? test : train) += tracks[i];
      const Eigen::VectorXd b = thresholded(train, response, spread, base, kThresholds[t] * sd);
      errors.add(error_of(test, response, b) / std::max(test.rows, 1.0));
    }
    means_of[t] = errors.mean();
    if (means_of[t] >= best) continue;
    best = means_of[t];
    se_of_best = errors.standard_error();
  }
  double threshold = kThresholds[0];
  for (std::size_t t = 0; t < std::size(kThresholds); ++t)
    if (means_of[t] <= best + 0.1 * se_of_best) threshold = kThresholds[t];
  return threshold * sd;
}

}  // namespace

Rival sparse_regression(const std::vector<RateRow>& rows, int robots) {
  const Eigen::Index base = base_columns(robots), columns = base + 3 * kFunctions;
  const Eigen::MatrixXd x = means(rows, columns,
                                  [&](const Instant&at, Eigen::VectorXd&to) { columns_of(at, robots, to); }),
                        y = rates_of(rows);
  std::vector<Gram> tracks(static_cast<std::size_t>(rows.back().track) + 1);
  const Gram none{Eigen::MatrixXd::Zero(columns, columns), Eigen::MatrixXd::Zero(columns, 3)};
  for (std::size_t first = 0, last = 0; first < rows.size(); first = last) {
    while (last < rows.size() && rows[last].track == rows[first].track) ++last;
    const auto from = static_cast<Eigen::Index>(first), count = static_cast<Eigen::Index>(last - first);
    Gram g = none;
    g.xx = x.middleRows(from, count).transpose() * x.middleRows(from, count);
    g.xy = x.middleRows(from, count).transpose() * y.middleRows(from, count);
    for (int k = 0; k < 3; ++k) g.yy[k] = y.col(k).segment(from, count).squaredNorm();
    g.rows = static_cast<double>(count);
    tracks[static_cast<std::size_t>(rows[first].track)] = std::move(g);
  }
  std::erase_if(tracks, [](const Gram& g) { return g.rows == 0; });
  Gram all = none;
  for (const Gram& g : tracks) all += g;
  // Spread of each column about its mean under its command.
  Eigen::VectorXd spread(columns);
  for (Eigen::Index i = 0; i < columns; ++i) {
    const Eigen::Index command = i < base ? 0 : (i - base) / kFunctions;
    const double of_command = std::max(all.xx(command, command), 1.0), mean = all.xx(i, command) / of_command;
    spread[i] = i < base ? 1 : std::sqrt(std::max(0.0, all.xx(i, i) / of_command - mean * mean));
  }

  auto coefficients = std::make_shared<Eigen::MatrixXd>(columns, 3);
  std::set<std::string> found;
  Dice dice(20220801);
  for (int k = 0; k < 3; ++k) {
    const double threshold = threshold_of(
        tracks, k, spread, base, std::sqrt(error_of(all, k, thresholded(all, k, spread, base, 1e9)) / all.rows));
    // The ensemble: tracks drawn with replacement. A term stays if 60 % of the members have it.
    constexpr int kMembers = 60;
    constexpr double kIncluded = 0.6;
    Eigen::VectorXd held = Eigen::VectorXd::Zero(columns);
    for (int m = 0; m < kMembers; ++m) {
      Gram drawn = none;
      for (std::size_t i = 0; i < tracks.size(); ++i)
        drawn += tracks[static_cast<std::size_t>(dice.pick(static_cast<int>(tracks.size())))];
      const Eigen::VectorXd b = thresholded(drawn, k, spread, base, threshold);
      for (Eigen::Index i = 0; i < columns; ++i) held[i] += b[i] != 0 ? 1.0 / kMembers : 0;
    }
    std::vector<Eigen::Index> active;
    for (Eigen::Index i = 0; i < columns; ++i) {
      if (i >= base && held[i] < kIncluded) continue;
      active.push_back(i);
      if (i >= base) found.insert(kLibrary[(i - base) % kFunctions].covariate);
    }
    coefficients->col(k) = least_squares(all, k, active);
  }
  // Left and right turns that are no mirror images.
  constexpr double kUnlike = 0.05;
  const Eigen::MatrixXd& c = *coefficients;
  if (std::abs(c(1, 2) + c(2, 2)) > kUnlike * std::abs(c(1, 2))) found.insert("command");
  Rival rival;
  rival.names = true;
  rival.straight_mm_s = straight_of(c, robots);
  rival.covariates.assign(found.begin(), found.end());
  rival.rates = [coefficients, columns, robots](const Instant& at) -> Eigen::Vector3d {
    Eigen::VectorXd one(columns);
    columns_of(at, robots, one);
    return coefficients->transpose() * one;
  };
  return rival;
}

}  // namespace kilotwin::truth
