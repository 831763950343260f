// Products equal those of the plain loop bit by bit, for all sizes around those of registers, on all instruction sets of the machine.
#include <gtest/gtest.h>

#include <algorithm>

#include "clients/identify/fit/products.hpp"
#include "core/random/random.hpp"

namespace kilotwin::identify {
namespace {

TEST(Products, EqualThePlainLoop) {
  std::uint32_t drawn = 0;
  const auto draw = [&] {
    return static_cast<double>(philox4x32({++drawn, 0, 0, 0}, {1, 2})[0]) / 4294967296.0 - 0.5;
  };
  for (const Eigen::Index n : {1, 2, 7, 8, 15, 16, 17, 31, 36, 64, 101}) {
    for (const Eigen::Index count : {0, 1, 5, 96}) {
      const RowMajorMatrix rows = RowMajorMatrix::NullaryExpr(96, n, draw);
      const Eigen::MatrixXd start = Eigen::MatrixXd::NullaryExpr(n, n, draw);
      Eigen::MatrixXd plain = start;
      for (Eigen::Index j = 0; j < n; ++j)
        for (Eigen::Index i = j; i < n; ++i)
          for (Eigen::Index k = 0; k < count; ++k) plain(i, j) += rows(k, i) * rows(k, j);
      for (std::size_t set = 0; set < instruction_sets(); ++set) {
        Eigen::MatrixXd sums = start;
        add_products(rows, count, NeededProducts(n), sums, set);
        for (Eigen::Index j = 0; j < n; ++j)
          for (Eigen::Index i = j; i < n; ++i)
            ASSERT_EQ(sums(i, j), plain(i, j))
                << n << " columns, " << count << " rows, instruction set " << set << ", at " << i << ", " << j;
      }
    }
  }
}

TEST(Products, NeededOnesEqualThePlainLoop) {
  std::uint32_t drawn = 0;
  const auto draw = [&] {
    return static_cast<double>(philox4x32({++drawn, 0, 0, 0}, {5, 6})[0]) / 4294967296.0 - 0.5;
  };
  for (const Eigen::Index n : {20, 64, 101, 120}) {
    constexpr Eigen::Index kCount = 40, kFirst = 5, kLast = 2;
    std::vector<std::vector<Eigen::Index>> groups{{9, 10, n - 3}, {}};
    for (Eigen::Index c = 6; c < n; c += 5) groups[1].push_back(c);
    const RowMajorMatrix rows = RowMajorMatrix::NullaryExpr(kCount, n, draw);
    Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(n, n), plain = sums;
    add_products(rows, kCount, NeededProducts(n, groups, kFirst, kLast), sums);
    for (Eigen::Index j = 0; j < n; ++j)
      for (Eigen::Index i = j; i < n; ++i)
        for (Eigen::Index k = 0; k < kCount; ++k) plain(i, j) += rows(k, i) * rows(k, j);
    const auto expect_equal = [&](Eigen::Index a, Eigen::Index b) {
      const Eigen::Index i = std::max(a, b), j = std::min(a, b);
      EXPECT_EQ(sums(i, j), plain(i, j)) << n << " columns, at " << i << ", " << j;
    };
    for (const std::vector<Eigen::Index>& group : groups)
      for (const Eigen::Index a : group)
        for (const Eigen::Index b : group) expect_equal(a, b);
    for (Eigen::Index c = 0; c < n; ++c) {
      for (Eigen::Index f = 0; f < kFirst; ++f) expect_equal(f, c);
      for (Eigen::Index l = n - kLast; l < n; ++l) expect_equal(l, c);
    }
  }
}

TEST(Products, OfThreeRowsEqualThePlainLoop) {
  std::uint32_t drawn = 0;
  const auto draw = [&] {
    return static_cast<double>(philox4x32({++drawn, 0, 0, 0}, {3, 4})[0]) / 4294967296.0 - 0.5;
  };
  for (const Eigen::Index n : {1, 7, 8, 9, 16, 33, 100}) {
    for (const Eigen::Index count : {2, 3}) {
      const Eigen::Matrix3d by = Eigen::Matrix3d::NullaryExpr(draw);
      const PoseRows from = PoseRows::NullaryExpr(3, n, draw), had = PoseRows::NullaryExpr(3, n, draw);
      PoseRows put = had, taken = had, added = had;
      put_combined(by, from, count, put.data());
      take_combined(by, from, count, taken);
      const Eigen::Index first = n / 3, width = n - first;
      add_row({by(0, 0), 0, by(1, 1)}, from.data(), width, added, first);
      for (Eigen::Index c = 0; c < n; ++c) {
        for (Eigen::Index i = 0; i < 3; ++i) {
          double sum = 0, less = had(i, c);
          for (Eigen::Index k = 0; k < 3; ++k) sum += by(i, k) * from(k, c);
          for (Eigen::Index k = 0; k < count; ++k) less += -by(i, k) * from(k, c);
          ASSERT_EQ(put(i, c), i < count ? sum : had(i, c)) << n << " columns, at " << i << ", " << c;
          ASSERT_EQ(taken(i, c), less) << n << " columns, at " << i << ", " << c;
          const double times = i == 1 ? 0 : i == 0 ? by(0, 0) : by(1, 1);
          const double more = c < first ? had(i, c) : had(i, c) + times * from(0, c - first);
          ASSERT_EQ(added(i, c), more) << n << " columns, at " << i << ", " << c;
        }
      }
    }
  }
}

}  // namespace
}  // namespace kilotwin::identify
