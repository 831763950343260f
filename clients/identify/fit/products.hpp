/// Matrix products of the linearisation, where the identification spends most of its time.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

namespace kilotwin::identify {

using RowMajorMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// The products of columns that are needed: all, or few of them. In a dictionary most pairs of columns belong to different
/// hypotheses, and nothing reads their products.
class NeededProducts {
 public:
  /// All products of n columns.
  explicit NeededProducts(Eigen::Index n);
  /// The products within each group of columns (indices below n), and those of the first `first` and the last `last`
  /// columns with all.
  NeededProducts(Eigen::Index n, const std::vector<std::vector<Eigen::Index>>& groups, Eigen::Index first,
                 Eigen::Index last);

  /// Columns that are multiplied at once: a panel. The last panel may have fewer.
  static constexpr Eigen::Index kPanel = 8;
  /// The panels whose products with this panel are needed, from itself on, ascending.
  [[nodiscard]] const std::vector<Eigen::Index>& with(Eigen::Index panel) const {
    return with_[static_cast<std::size_t>(panel)];
  }

 private:
  std::vector<std::vector<Eigen::Index>> with_;  ///< by panel
};

/// Adds rows' * rows of the first `count` rows to the lower triangle of `sums` (n x n; n: columns of `rows`).
/// Leaves the part above the diagonal undefined, and further sums may be left as they are if they are not needed. Each sum runs
/// over the rows in order and rounds after each product and each sum, so the result has the same bits on every instruction set.
/// `instruction_set`: below instruction_sets(); the fastest if not given.
void add_products(const RowMajorMatrix& rows, Eigen::Index count, const NeededProducts&, Eigen::MatrixXd& sums,
                  std::optional<std::size_t> instruction_set = std::nullopt);
/// Number of instruction sets of this machine for which there are kernels (SSE2, AVX2, AVX-512), the slowest first.
[[nodiscard]] std::size_t instruction_sets();

/// Derivatives of a pose (x, y, heading) by all columns.
using PoseRows = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor>;

/// Writes the first `count` columns of by * from to `to`, n numbers per row. Same bits as the plain loop.
void put_combined(const Eigen::Matrix3d& by, const PoseRows& from, Eigen::Index count, double* to);
/// Subtracts by * from from `to`. Only the first `count` columns of `from` are not 0.
void take_combined(const Eigen::Matrix3d& by, const PoseRows& from, Eigen::Index count, PoseRows& to);
/// Adds times * row to `n` columns of `to` from `first` on.
void add_row(const Eigen::Vector3d& times, const double* row, Eigen::Index n, PoseRows& to, Eigen::Index first);

}  // namespace kilotwin::identify
