/// Matrix products of the linearisation, where the identification spends most of its time.
#pragma once

#include <Eigen/Core>
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

  /// Columns that are multiplied at once.
  static constexpr Eigen::Index kPanel = 8;
  /// Strips of rows of `sums` that are computed at once.
  static constexpr Eigen::Index kStrip = 16;
  /// First rows of the needed strips of a panel, ascending: j, j + kStrip, ..., as far as whole strips fit; j: its first column.
  [[nodiscard]] const std::vector<Eigen::Index>& strips(Eigen::Index panel) const {
    return strips_[static_cast<std::size_t>(panel)];
  }

 private:
  std::vector<std::vector<Eigen::Index>> strips_;
};

/// Adds rows' * rows of the first `count` rows to the lower triangle of `sums` (n x n; n: columns of `rows`).
/// Leaves the part above the diagonal undefined, and further sums may be left as they are if they are not needed. Each sum runs
/// over the rows in order and rounds after each product and each sum, so the result has the same bits on every instruction set.
void add_products(const RowMajorMatrix& rows, Eigen::Index count, const NeededProducts&, Eigen::MatrixXd& sums);

/// Derivatives of a pose (x, y, heading) by all columns.
using PoseRows = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor>;

/// Writes the first `count` columns of by * from to `to`, n numbers per row. Same bits as the plain loop.
void put_combined(const Eigen::Matrix3d& by, const PoseRows& from, Eigen::Index count, double* to);
/// Subtracts by * from from `to`. Only the first `count` columns of `from` are not 0.
void take_combined(const Eigen::Matrix3d& by, const PoseRows& from, Eigen::Index count, PoseRows& to);
/// Adds times * row to `n` columns of `to` from `first` on.
void add_row(const Eigen::Vector3d& times, const double* row, Eigen::Index n, PoseRows& to, Eigen::Index first);

}  // namespace kilotwin::identify
