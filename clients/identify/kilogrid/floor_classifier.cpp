#include "clients/identify/kilogrid/floor_classifier.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <complex>
#include <numeric>

namespace kilotwin::kilogrid {
namespace {

constexpr std::size_t kWindow = 20;  // blocks
constexpr double kStill_mm = 16, kMoving_mm = 40, kBeside_mm = 60;

/// Samples as rows, standardised by those that are learned from.
struct Samples {
  Eigen::MatrixXd x;
  Eigen::VectorXd y;  ///< 0 or 1
};

Samples samples_of(const std::vector<TrackWindow>& a, const std::vector<TrackWindow>& b, std::size_t half) {
  std::vector<std::pair<const TrackWindow*, double>> rows;
  for (const auto& [windows, label] : {std::pair{&a, 0.0}, {&b, 1.0}}) {
    for (const TrackWindow& window : *windows) {
      if (window.robot % 2 == half) rows.emplace_back(&window, label);
    }
  }
  const auto features = static_cast<Eigen::Index>(feature_names().size());
  Samples samples{Eigen::MatrixXd(static_cast<Eigen::Index>(rows.size()), features),
                  Eigen::VectorXd(static_cast<Eigen::Index>(rows.size()))};
  for (Eigen::Index i = 0; i < samples.x.rows(); ++i) {
    const auto& [window, label] = rows[static_cast<std::size_t>(i)];
    for (Eigen::Index f = 0; f < features; ++f) samples.x(i, f) = window->feature[static_cast<std::size_t>(f)];
    samples.y(i) = label;
  }
  return samples;
}

/// Classes count alike, however many windows each has.
Eigen::VectorXd class_weights(const Eigen::VectorXd& y) {
  const double ones = y.sum(), all = static_cast<double>(y.size());
  return y.unaryExpr([&](double label) { return label > 0.5 ? 0.5 * all / ones : 0.5 * all / (all - ones); });
}

/// Logistic regression on the features and their squares and products, with a ridge.
class Logistic {
 public:
  explicit Logistic(const Samples& s) : mean_(s.x.colwise().mean()) {
    scale_ = ((s.x.rowwise() - mean_).array().square().colwise().mean()).sqrt().cwiseMax(1e-9);
    const Eigen::MatrixXd x = terms(s.x);
    const Eigen::VectorXd importance = class_weights(s.y);
    weights_ = Eigen::VectorXd::Zero(x.cols());
    const double ridge = 3;
    for (int iteration = 0; iteration < 12; ++iteration) {
      const Eigen::VectorXd p = (1 + (-(x * weights_).array()).exp()).inverse();
      const Eigen::VectorXd w = importance.array() * (p.array() * (1 - p.array())).max(1e-4);
      Eigen::MatrixXd hessian = x.transpose() * w.asDiagonal() * x;
      hessian.diagonal().array() += ridge;
      const Eigen::VectorXd gradient =
          x.transpose() * (importance.array() * (s.y - p).array()).matrix() - ridge * weights_;
      weights_ += hessian.ldlt().solve(gradient);
    }
  }
  [[nodiscard]] Eigen::VectorXd judge(const Eigen::MatrixXd& x) const { return terms(x) * weights_; }

 private:
  [[nodiscard]] Eigen::MatrixXd terms(const Eigen::MatrixXd& x) const {
    const Eigen::MatrixXd z = ((x.rowwise() - mean_).array().rowwise() / scale_.array()).cwiseMax(-4).cwiseMin(4);
    const Eigen::Index n = z.cols();
    Eigen::MatrixXd all(z.rows(), 1 + n + n * (n + 1) / 2);
    all.col(0).setOnes();
    all.middleCols(1, n) = z;
    Eigen::Index at = 1 + n;
    for (Eigen::Index i = 0; i < n; ++i) {
      for (Eigen::Index j = i; j < n; ++j) all.col(at++) = z.col(i).cwiseProduct(z.col(j));
    }
    return all;
  }

  Eigen::RowVectorXd mean_, scale_;
  Eigen::VectorXd weights_;
};

/// Boosted stumps: each a threshold on one feature, of its deciles, added with half of its best weight.
class Boosted {
 public:
  explicit Boosted(const Samples& s) {
    constexpr int kRounds = 150, kThresholds = 15;
    const Eigen::Index rows = s.x.rows();
    std::vector<std::vector<double>> thresholds;
    for (Eigen::Index f = 0; f < s.x.cols(); ++f) {
      std::vector<double> v(s.x.col(f).data(), s.x.col(f).data() + rows);
      std::sort(v.begin(), v.end());
      std::vector<double>& own = thresholds.emplace_back();
      for (int t = 1; t <= kThresholds; ++t)
        own.push_back(v[static_cast<std::size_t>(rows - 1) * static_cast<std::size_t>(t) / (kThresholds + 1)]);
      own.erase(std::unique(own.begin(), own.end()), own.end());
    }
    const Eigen::VectorXd importance = class_weights(s.y);
    Eigen::VectorXd margin = Eigen::VectorXd::Zero(rows);
    for (int round = 0; round < kRounds; ++round) {
      const Eigen::ArrayXd p = (1 + (-margin.array()).exp()).inverse();
      const Eigen::ArrayXd gradient = importance.array() * (s.y.array() - p);
      const Eigen::ArrayXd curve = importance.array() * p * (1 - p) + 1e-6;
      Stump best{0, 0, 0, 0};
      double best_gain = 0;
      const double all_g = gradient.sum(), all_h = curve.sum();
      for (Eigen::Index f = 0; f < s.x.cols(); ++f) {
        // Sums per bin between thresholds, then cumulated.
        const std::vector<double>& own = thresholds[static_cast<std::size_t>(f)];
        std::vector<double> g(own.size() + 1, 0), h(own.size() + 1, 0);
        for (Eigen::Index i = 0; i < rows; ++i) {
          const auto bin =
              static_cast<std::size_t>(std::lower_bound(own.begin(), own.end(), s.x(i, f)) - own.begin());
          g[bin] += gradient(i);
          h[bin] += curve(i);
        }
        double below_g = 0, below_h = 0;
        for (std::size_t t = 0; t < own.size(); ++t) {
          below_g += g[t];
          below_h += h[t];
          constexpr double kRidge = 5;
          const double low = below_g / (below_h + kRidge), high = (all_g - below_g) / (all_h - below_h + kRidge);
          const double gain = below_g * low + (all_g - below_g) * high;
          if (gain > best_gain) {
            best_gain = gain;
            best = {f, own[t], low, high};
          }
        }
      }
      constexpr double kRate = 0.3;
      best.low *= kRate;
      best.high *= kRate;
      stumps_.push_back(best);
      for (Eigen::Index i = 0; i < rows; ++i) margin(i) += s.x(i, best.feature) <= best.at ? best.low : best.high;
    }
  }
  [[nodiscard]] Eigen::VectorXd judge(const Eigen::MatrixXd& x) const {
    Eigen::VectorXd margin = Eigen::VectorXd::Zero(x.rows());
    for (const Stump& stump : stumps_) {
      for (Eigen::Index i = 0; i < x.rows(); ++i)
        margin(i) += x(i, stump.feature) <= stump.at ? stump.low : stump.high;
    }
    return margin;
  }

 private:
  struct Stump {
    Eigen::Index feature;
    double at, low, high;
  };
  std::vector<Stump> stumps_;
};

double area(const Eigen::VectorXd& scores, const Eigen::VectorXd& y) {
  std::vector<double> negatives, positives;
  for (Eigen::Index i = 0; i < y.size(); ++i) (y(i) > 0.5 ? positives : negatives).push_back(scores(i));
  return area_under_curve(negatives, positives);
}

}  // namespace

const std::vector<std::string>& feature_names() {
  static const std::vector<std::string> names = {"mean step", "spread of steps", "still",         "still in a row",
                                                 "mean turn", "sharp turns",     "side of turns", "way in the end",
                                                 "extent",    "beside a wall",   "wall distance", "unheard"};
  return names;
}

std::vector<TrackWindow> windows_of(const FloorRun& run, const Floor& floor) {
  const FloorBlocks blocks = blocks_of(run);
  std::vector<TrackWindow> windows;
  for (std::size_t robot = 0; robot < blocks.robots(); ++robot) {
    const std::vector<double>&x = blocks.x_mm[robot], &y = blocks.y_mm[robot];
    for (std::size_t begin = 0; begin + kWindow <= blocks.blocks; begin += kWindow) {
      std::vector<std::size_t> heard;
      for (std::size_t k = begin; k < begin + kWindow; ++k) {
        if (!std::isnan(x[k])) heard.push_back(k);
      }
      if (heard.size() < kWindow / 2) continue;
      double step = 0, square = 0, steps = 0, still = 0, row = 0, longest = 0, turn = 0, sharp = 0, side = 0,
             turns = 0;
      double wall = 0, beside = 0;
      std::complex<double> last = 0;
      std::size_t last_at = 0;
      for (std::size_t i = 0; i < heard.size(); ++i) {
        const std::size_t k = heard[i];
        const double wall_mm = wall_distance_mm(floor, x[k], y[k]);
        wall += wall_mm;
        beside += wall_mm < kBeside_mm ? 1 : 0;
        if (i == 0 || heard[i - 1] + 1 != k) continue;
        const std::complex<double> way(x[k] - x[k - 1], y[k] - y[k - 1]);
        const double way_mm = std::abs(way);
        step += way_mm;
        square += way_mm * way_mm;
        ++steps;
        row = way_mm < kStill_mm ? row + 1 : 0;
        longest = std::max(longest, row);
        still += way_mm < kStill_mm ? 1 : 0;
        if (way_mm > kMoving_mm && std::abs(last) > kMoving_mm && last_at + 1 == k) {
          const double angle = std::arg(way * std::conj(last));
          turn += std::abs(angle);
          side += angle;
          sharp += std::abs(angle) > 1.2 ? 1 : 0;
          ++turns;
        }
        last = way;
        last_at = k;
      }
      if (steps < 3) continue;
      const auto [low_x, high_x] =
          std::minmax_element(heard.begin(), heard.end(), [&](auto a, auto b) { return x[a] < x[b]; });
      const auto [low_y, high_y] =
          std::minmax_element(heard.begin(), heard.end(), [&](auto a, auto b) { return y[a] < y[b]; });
      const auto count = static_cast<double>(heard.size());
      const double mean = step / steps, some = std::max(turns, 1.0);
      windows.push_back({robot,
                         {mean, std::sqrt(std::max(square / steps - mean * mean, 0.0)), still / steps, longest,
                          turn / some, sharp / some, side / some,
                          std::hypot(x[heard.back()] - x[heard.front()], y[heard.back()] - y[heard.front()]),
                          std::hypot(x[*high_x] - x[*low_x], y[*high_y] - y[*low_y]), beside / count, wall / count,
                          static_cast<double>(kWindow) - count}});
    }
  }
  return windows;
}

double area_under_curve(const std::vector<double>& negatives, const std::vector<double>& positives) {
  if (negatives.empty() || positives.empty()) return 0.5;
  std::vector<double> sorted = negatives;
  std::sort(sorted.begin(), sorted.end());
  double right = 0;
  for (const double score : positives) {
    const auto [first, last] = std::equal_range(sorted.begin(), sorted.end(), score);
    right += static_cast<double>(first - sorted.begin()) + 0.5 * static_cast<double>(last - first);
  }
  return right / (static_cast<double>(negatives.size()) * static_cast<double>(positives.size()));
}

TellApart tell_apart(const std::vector<TrackWindow>& a, const std::vector<TrackWindow>& b) {
  TellApart sum{0, 0};
  for (const std::size_t half : {std::size_t{0}, std::size_t{1}}) {
    const Samples learned = samples_of(a, b, half), judged = samples_of(a, b, 1 - half);
    const double ones = learned.y.sum(), others = judged.y.sum();
    if (ones < 1 || ones >= static_cast<double>(learned.y.size()) || others < 1 ||
        others >= static_cast<double>(judged.y.size()))
      return {};
    sum.logistic += area(Logistic(learned).judge(judged.x), judged.y) / 2;
    sum.boosted += area(Boosted(learned).judge(judged.x), judged.y) / 2;
  }
  return sum;
}

}  // namespace kilotwin::kilogrid
