/// Matrix products of the linearisation, where the identification spends most of its time.
#pragma once

#include <Eigen/Core>

namespace kilotwin::identify {

using RowMajorMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Adds rows' * rows of the first `count` rows to the lower triangle of `sums` (n x n; n: columns of `rows`).
/// Leaves the part above the diagonal undefined. Each sum runs over the rows in order and rounds after each
/// product and each sum, so the result has the same bits on every instruction set.
void add_products(const RowMajorMatrix& rows, Eigen::Index count, Eigen::MatrixXd& sums);

/// Derivatives of a pose (x, y, heading) by all columns.
using PoseRows = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor>;

/// Writes the first `count` columns of by * from to `to`, n numbers per row. Same bits as the plain loop.
void put_combined(const Eigen::Matrix3d& by, const PoseRows& from, Eigen::Index count, double* to);
/// Subtracts by * from from `to`. Only the first `count` columns of `from` are not 0.
void take_combined(const Eigen::Matrix3d& by, const PoseRows& from, Eigen::Index count, PoseRows& to);
/// Adds times * row to `n` columns of `to` from `first` on.
void add_row(const Eigen::Vector3d& times, const double* row, Eigen::Index n, PoseRows& to, Eigen::Index first);

}  // namespace kilotwin::identify
