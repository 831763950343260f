#include "clients/identify/unexplained/random_forest.hpp"

#include <algorithm>
#include <numeric>

#include "core/os/worker_pool.hpp"
#include "core/random/random.hpp"

namespace kilotwin::identify {
namespace {

/// Deep trees, averaged; nodes of fewer than 12 examples are leaves. More trees change the error by less than a percent.
constexpr std::size_t kTrees = 80;
constexpr int kDepth = 12;
constexpr std::ptrdiff_t kFewestToSplit = 12;
/// Splits are tried at these many quantiles of a covariate.
constexpr std::size_t kQuantiles = 64;
constexpr std::uint32_t kSeed = 20180729;

/// Covariates as numbers of bins with about equally many examples.
struct CovariateBins {
  std::vector<std::vector<float>> upper;  ///< end of each bin but the last, by covariate
  Eigen::Matrix<std::uint8_t, Eigen::Dynamic, Eigen::Dynamic> codes;  ///< as the covariates

  explicit CovariateBins(const Eigen::MatrixXf& covariates) : codes(covariates.rows(), covariates.cols()) {
    for (Eigen::Index c = 0; c < covariates.cols(); ++c) {
      std::vector<float> sorted(covariates.col(c).begin(), covariates.col(c).end());
      std::sort(sorted.begin(), sorted.end());
      std::vector<float>& ends = upper.emplace_back();
      for (std::size_t b = 1; b < kQuantiles; ++b) {
        // Between two different values; examples of one value share a bin.
        const float below = sorted[b * (sorted.size() - 1) / kQuantiles];
        const auto next = std::upper_bound(sorted.begin(), sorted.end(), below);
        if (next != sorted.end() && (ends.empty() || below > ends.back()))
          ends.push_back(below + (*next - below) / 2);
      }
      for (Eigen::Index r = 0; r < covariates.rows(); ++r)
        codes(r, c) =
            static_cast<std::uint8_t>(std::lower_bound(ends.begin(), ends.end(), covariates(r, c)) - ends.begin());
    }
  }
};

}  // namespace

/// Grows one tree on a bootstrap sample of the examples.
class RandomForest::Grower {
 public:
  Grower(const CovariateBins& bins, const Eigen::VectorXf& targets, std::array<std::uint32_t, 2> key)
      : bins_(bins),
        targets_(targets),
        key_(key),
        order_(bins.upper.size()),
        rows_(static_cast<std::size_t>(targets.size())) {
    std::iota(order_.begin(), order_.end(), 0U);
    for (Eigen::Index& row : rows_) row = static_cast<Eigen::Index>(below(rows_.size()));
  }
  Tree grown() {
    grow(rows_.begin(), rows_.end(), 0);
    return std::move(tree_);
  }

 private:
  using Row = std::vector<Eigen::Index>::iterator;
  struct Split {
    double gain = 0;  ///< of the sum of squares
    std::uint32_t covariate = 0;
    std::size_t bin = 0;  ///< the last one on the left
  };

  std::size_t below(std::size_t count) {
    return static_cast<std::size_t>(std::uint64_t{philox4x32({draw_++, 0, 0, 0}, key_)[0]} * count >> 32);
  }
  void grow(Row first, Row last, int depth) {
    double sum = 0;
    for (Row row = first; row != last; ++row) sum += static_cast<double>(targets_[*row]);
    const std::size_t here = tree_.size();
    tree_.push_back({0, 0, 0, static_cast<float>(sum / static_cast<double>(last - first))});
    if (depth == kDepth || last - first < kFewestToSplit) return;
    const Split split = best_split(first, last, sum);
    if (split.gain <= 0) return;
    const auto column = bins_.codes.col(static_cast<Eigen::Index>(split.covariate));
    const Row middle =
        std::stable_partition(first, last, [&](Eigen::Index row) { return column[row] <= split.bin; });
    grow(first, middle, depth + 1);
    tree_[here].covariate = split.covariate;
    tree_[here].most = bins_.upper[split.covariate][split.bin];
    tree_[here].right = static_cast<std::uint32_t>(tree_.size());
    grow(middle, last, depth + 1);
  }
  /// The best of all splits in half of the covariates, drawn at random.
  Split best_split(Row first, Row last, double sum) {
    const auto count = static_cast<double>(last - first);
    Split best;
    for (std::size_t i = 0; i < order_.size() / 2 + 1; ++i) {
      std::swap(order_[i], order_[i + below(order_.size() - i)]);
      const auto column = bins_.codes.col(static_cast<Eigen::Index>(order_[i]));
      std::array<double, kQuantiles> sums{};
      std::array<std::uint32_t, kQuantiles> counts{};
      for (Row row = first; row != last; ++row) {
        sums[column[*row]] += static_cast<double>(targets_[*row]);
        ++counts[column[*row]];
      }
      double left_sum = 0, left = 0;
      for (std::size_t b = 0; b < bins_.upper[order_[i]].size(); ++b) {
        left_sum += sums[b];
        left += counts[b];
        if (counts[b] == 0 || left == count) continue;
        const double rest = sum - left_sum;
        const double gain = left_sum * left_sum / left + rest * rest / (count - left) - sum * sum / count;
        if (gain > best.gain) best = {gain, order_[i], b};
      }
    }
    return best;
  }

  const CovariateBins& bins_;
  const Eigen::VectorXf& targets_;
  const std::array<std::uint32_t, 2> key_;
  std::uint32_t draw_ = 0;
  std::vector<std::uint32_t> order_;  ///< of the covariates
  std::vector<Eigen::Index> rows_;
  Tree tree_;
};

RandomForest::RandomForest(const Eigen::MatrixXf& covariates, const Eigen::MatrixX2f& targets,
                           std::uint32_t threads) {
  const CovariateBins bins(covariates);
  const std::array<Eigen::VectorXf, 2> components{targets.col(0), targets.col(1)};
  for (std::vector<Tree>& trees : trees_) trees.resize(kTrees);
  os::in_parallel(2 * kTrees, threads, [&](std::size_t i) {
    trees_[i % 2][i / 2] = Grower(bins, components[i % 2], {static_cast<std::uint32_t>(i), kSeed}).grown();
  });
}

Eigen::MatrixX2f RandomForest::predict(const Eigen::MatrixXf& covariates) const {
  Eigen::MatrixX2f out = Eigen::MatrixX2f::Zero(covariates.rows(), 2);
  for (Eigen::Index row = 0; row < covariates.rows(); ++row) {
    for (std::size_t component = 0; component < trees_.size(); ++component) {
      for (const Tree& tree : trees_[component]) {
        std::size_t at = 0;
        while (tree[at].right != 0)
          at = covariates(row, tree[at].covariate) <= tree[at].most ? at + 1 : tree[at].right;
        out(row, static_cast<Eigen::Index>(component)) += tree[at].mean / static_cast<float>(kTrees);
      }
    }
  }
  return out;
}

}  // namespace kilotwin::identify
