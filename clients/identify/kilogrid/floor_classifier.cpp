#include "clients/identify/kilogrid/floor_classifier.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "clients/identify/kilogrid/floor_program.hpp"
#include "core/stats/moments.hpp"
#include "core/stats/quantiles.hpp"
#include "core/stats/resampling.hpp"

namespace kilotwin::kilogrid {
namespace {

/// Samples as rows, standardised by the training set.
struct Samples {
  Eigen::MatrixXd x;
  Eigen::VectorXd y;               ///< 0 or 1
  std::vector<std::size_t> robot;  ///< of each row; robots of both classes are numbered consecutively
  std::size_t robots = 0;
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
                  Eigen::VectorXd(static_cast<Eigen::Index>(rows.size())),
                  {},
                  0};
  std::map<std::pair<bool, std::size_t>, std::size_t> numbers;
  for (const auto& [window, label] : rows)
    samples.robot.push_back(numbers.emplace(std::pair{label > 0.5, window->robot}, numbers.size()).first->second);
  samples.robots = numbers.size();
  for (Eigen::Index i = 0; i < samples.x.rows(); ++i) {
    const auto& [window, label] = rows[static_cast<std::size_t>(i)];
    for (Eigen::Index f = 0; f < features; ++f) samples.x(i, f) = window->feature[static_cast<std::size_t>(f)];
    samples.y(i) = label;
  }
  return samples;
}

/// Both classes have equal total weight.
Eigen::VectorXd class_weights(const Eigen::VectorXd& y) {
  const double ones = y.sum(), all = static_cast<double>(y.size());
  return y.unaryExpr([&](double label) { return label > 0.5 ? 0.5 * all / ones : 0.5 * all / (all - ones); });
}

/// Ridge logistic regression on the features, their squares and products.
class Logistic {
 public:
  explicit Logistic(const Samples& s) : mean_(s.x.colwise().mean()) {
    scale_ = ((s.x.rowwise() - mean_).array().square().colwise().mean()).sqrt().cwiseMax(1e-9);
    const Eigen::MatrixXd x = terms(s.x);
    const Eigen::VectorXd importance = class_weights(s.y);
    weights_ = Eigen::VectorXd::Zero(x.cols());
    const double ridge = 25;
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
  [[nodiscard]] Eigen::VectorXd validate(const Eigen::MatrixXd& x) const { return terms(x) * weights_; }

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

/// Boosted decision stumps: thresholds at sixteenths of single features, with shrinkage.
class Boosted {
 public:
  explicit Boosted(const Samples& s) {
    // Stumps, and thresholds of a feature; more follow the training windows closer, and cost time.
    constexpr int kRounds = 150, kThresholds = 15;
    const Eigen::Index rows = s.x.rows();
    std::vector<std::vector<double>> thresholds;
    for (Eigen::Index f = 0; f < s.x.cols(); ++f) {
      std::vector<double> v(s.x.col(f).data(), s.x.col(f).data() + rows);
      std::vector<double>& own = thresholds.emplace_back();
      for (int t = 1; t <= kThresholds; ++t)
        own.push_back(stats::lower_quantile(v, static_cast<double>(t) / (kThresholds + 1)));
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
          // Weight that pulls a stump's values to 0; a larger one shrinks those of few windows more.
          constexpr double kRidge = 5;
          const double low = below_g / (below_h + kRidge), high = (all_g - below_g) / (all_h - below_h + kRidge);
          const double gain = below_g * low + (all_g - below_g) * high;
          if (gain > best_gain) {
            best_gain = gain;
            best = {f, own[t], low, high};
          }
        }
      }
      // Share of a stump that counts; a smaller one needs more rounds, a larger one follows chance.
      constexpr double kRate = 0.3;
      best.low *= kRate;
      best.high *= kRate;
      stumps_.push_back(best);
      for (Eigen::Index i = 0; i < rows; ++i) margin(i) += s.x(i, best.feature) <= best.at ? best.low : best.high;
    }
  }
  [[nodiscard]] Eigen::VectorXd validate(const Eigen::MatrixXd& x) const {
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

/// Sorted scores of windows, with weights per robot for the bootstrap.
class Judgement {
 public:
  Judgement(const Eigen::VectorXd& scores, const Samples& s) : robots_(s.robots) {
    for (Eigen::Index i = 0; i < scores.size(); ++i)
      rows_.push_back({scores(i), s.robot[static_cast<std::size_t>(i)], s.y(i) > 0.5});
    std::sort(rows_.begin(), rows_.end(), [](const Row& a, const Row& b) { return a.score < b.score; });
  }
  [[nodiscard]] double area() const { return area(std::vector<double>(robots_, 1)); }
  /// One bootstrap sample over robots.
  [[nodiscard]] double area(Dice& dice) const {
    return area(stats::bootstrap_weights(robots_, [&](std::size_t) { return dice.bits() % robots_; }));
  }

 private:
  struct Row {
    double score;
    std::size_t robot;
    bool positive;
  };
  /// Share of pairs in the right order; ties count one half.
  [[nodiscard]] double area(const std::vector<double>& weight) const {
    double below = 0, positives = 0, right = 0;
    for (std::size_t i = 0; i < rows_.size();) {
      double negative = 0, positive = 0;
      const double score = rows_[i].score;
      for (; i < rows_.size() && rows_[i].score == score; ++i)
        (rows_[i].positive ? positive : negative) += weight[rows_[i].robot];
      right += positive * (below + negative / 2);
      below += negative;
      positives += positive;
    }
    return below > 0 && positives > 0 ? right / (below * positives) : 0.5;
  }

  std::vector<Row> rows_;
  std::size_t robots_;
};

/// Mean area of both folds, and its standard error.
std::pair<double, double> area_of(const std::vector<Judgement>& halves) {
  // Resamples of the standard error; more make it less random, and cost time in proportion.
  constexpr int kResamples = 200;
  Dice dice(1);
  double mean = 0;
  stats::Moments resampled;
  for (const Judgement& half : halves) mean += half.area() / static_cast<double>(halves.size());
  for (int i = 0; i < kResamples; ++i) {
    double area = 0;
    for (const Judgement& half : halves) area += half.area(dice) / static_cast<double>(halves.size());
    resampled.add(area);
  }
  return {mean, resampled.standard_deviation()};
}

}  // namespace

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

ClassifierResult classifier_test(const std::vector<TrackWindow>& a, const std::vector<TrackWindow>& b) {
  std::vector<Judgement> logistic, boosted;
  for (const std::size_t half : {std::size_t{0}, std::size_t{1}}) {
    const Samples learned = samples_of(a, b, half), judged = samples_of(a, b, 1 - half);
    const double ones = learned.y.sum(), others = judged.y.sum();
    if (ones < 1 || ones >= static_cast<double>(learned.y.size()) || others < 1 ||
        others >= static_cast<double>(judged.y.size()))
      return {};
    logistic.emplace_back(Logistic(learned).validate(judged.x), judged);
    boosted.emplace_back(Boosted(learned).validate(judged.x), judged);
  }
  ClassifierResult t;
  std::tie(t.logistic, t.logistic_sd) = area_of(logistic);
  std::tie(t.boosted, t.boosted_sd) = area_of(boosted);
  return t;
}

}  // namespace kilotwin::kilogrid
