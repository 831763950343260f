/// Sums of products of columns, where identification spends most of its time.
#pragma once

#include <Eigen/Core>

namespace kilotwin::identify {

using RowMajorMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Adds rows' * rows of the first `count` rows to the lower triangle of `sums` (n x n, n columns of `rows`); above the diagonal
/// `sums` is undefined afterwards. Each sum runs over the rows in their order, with a rounding after each product and each
/// sum, so that the bits are those of the plain loop whatever instructions the processor has.
void add_products(const RowMajorMatrix& rows, Eigen::Index count, Eigen::MatrixXd& sums);

}  // namespace kilotwin::identify
