/// Sums of products of columns and of rows, where identification spends most of its time.
#pragma once

#include <Eigen/Core>

namespace kilotwin::identify {

using RowMajorMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Adds rows' * rows of the first `count` rows to the lower triangle of `sums` (n x n, n columns of `rows`); above the diagonal
/// `sums` is undefined afterwards. Each sum runs over the rows in their order, with a rounding after each product and each
/// sum, so that the bits are those of the plain loop whatever instructions the processor has.
void add_products(const RowMajorMatrix& rows, Eigen::Index count, Eigen::MatrixXd& sums);

/// A pose's derivatives by all columns: x, y, heading.
using PoseRows = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor>;

/// Puts the first `count` rows of by * from into `to`, n numbers each, one row after the other. The bits are those of the plain loop.
void put_combined(const Eigen::Matrix3d& by, const PoseRows& from, Eigen::Index count, double* to);
/// Takes by * from off `to`, the first `count` rows of `from` being other than 0.
void take_combined(const Eigen::Matrix3d& by, const PoseRows& from, Eigen::Index count, PoseRows& to);
/// Adds, to `n` columns from `first` on, the same row as many times as each of the three is pushed.
void add_row(const Eigen::Vector3d& times, const double* row, Eigen::Index n, PoseRows& to, Eigen::Index first);

}  // namespace kilotwin::identify
