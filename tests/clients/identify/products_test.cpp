// Sums of products are those of the plain loop, to the bit, for all sizes about those of registers.
#include <gtest/gtest.h>

#include "clients/identify/fit/products.hpp"
#include "core/random/random.hpp"

namespace kilotwin::identify {
namespace {

TEST(Products, AreThoseOfThePlainLoop) {
  std::uint32_t drawn = 0;
  const auto draw = [&] {
    return static_cast<double>(philox4x32({++drawn, 0, 0, 0}, {1, 2})[0]) / 4294967296.0 - 0.5;
  };
  for (const Eigen::Index n : {1, 2, 7, 8, 15, 16, 17, 31, 36, 64, 101}) {
    for (const Eigen::Index count : {0, 1, 5, 96}) {
      RowMajorMatrix rows = RowMajorMatrix::NullaryExpr(96, n, draw);
      Eigen::MatrixXd sums = Eigen::MatrixXd::NullaryExpr(n, n, draw), plain = sums;
      add_products(rows, count, sums);
      for (Eigen::Index j = 0; j < n; ++j) {
        for (Eigen::Index i = j; i < n; ++i) {
          for (Eigen::Index k = 0; k < count; ++k) plain(i, j) += rows(k, i) * rows(k, j);
          ASSERT_EQ(sums(i, j), plain(i, j)) << n << " columns, " << count << " rows, at " << i << ", " << j;
        }
      }
    }
  }
}

}  // namespace
}  // namespace kilotwin::identify
