#include "clients/identify/products.hpp"

#include <algorithm>
#include <cstring>

namespace kilotwin::identify {
namespace {

constexpr Eigen::Index kLanes = 8, kStrip = 2 * kLanes, kColumns = 4;
using Lanes = double __attribute__((vector_size(kLanes * sizeof(double))));

/// One strip of rows of `sums` by some of its columns, in registers.
template <std::size_t columns>
inline __attribute__((always_inline)) void strip(const double* rows, Eigen::Index count, Eigen::Index n,
                                                 Eigen::Index i, Eigen::Index j, double* sums) {
  Lanes low[columns], high[columns];
  for (std::size_t c = 0; c < columns; ++c) {
    std::memcpy(&low[c], sums + (j + static_cast<Eigen::Index>(c)) * n + i, sizeof(Lanes));
    std::memcpy(&high[c], sums + (j + static_cast<Eigen::Index>(c)) * n + i + kLanes, sizeof(Lanes));
  }
  for (Eigen::Index k = 0; k < count; ++k) {
    const double* const row = rows + k * n;
    Lanes a, b;
    std::memcpy(&a, row + i, sizeof(Lanes));
    std::memcpy(&b, row + i + kLanes, sizeof(Lanes));
    for (std::size_t c = 0; c < columns; ++c) {
      const double by = row[j + static_cast<Eigen::Index>(c)];
      low[c] += a * by;
      high[c] += b * by;
    }
  }
  for (std::size_t c = 0; c < columns; ++c) {
    std::memcpy(sums + (j + static_cast<Eigen::Index>(c)) * n + i, &low[c], sizeof(Lanes));
    std::memcpy(sums + (j + static_cast<Eigen::Index>(c)) * n + i + kLanes, &high[c], sizeof(Lanes));
  }
}

inline __attribute__((always_inline)) void add(const double* rows, Eigen::Index count, Eigen::Index n,
                                               double* sums) {
  for (Eigen::Index j = 0; j < n; j += kColumns) {
    const Eigen::Index columns = std::min(kColumns, n - j);
    Eigen::Index i = j;
    for (; i + kStrip <= n; i += kStrip) {
      if (columns == kColumns) {
        strip<kColumns>(rows, count, n, i, j, sums);
      } else {
        for (Eigen::Index c = 0; c < columns; ++c) strip<1>(rows, count, n, i, j + c, sums);
      }
    }
    for (Eigen::Index c = 0; c < columns; ++c) {
      for (Eigen::Index rest = i; rest < n; ++rest) {
        double sum = sums[(j + c) * n + rest];
        for (Eigen::Index k = 0; k < count; ++k) sum += rows[k * n + rest] * rows[k * n + j + c];
        sums[(j + c) * n + rest] = sum;
      }
    }
  }
}

#if defined(__x86_64__)
__attribute__((target("avx512f"))) void add_avx512(const double* rows, Eigen::Index count, Eigen::Index n,
                                                   double* sums) {
  add(rows, count, n, sums);
}
__attribute__((target("avx2"))) void add_avx2(const double* rows, Eigen::Index count, Eigen::Index n,
                                              double* sums) {
  add(rows, count, n, sums);
}
#endif
void add_baseline(const double* rows, Eigen::Index count, Eigen::Index n, double* sums) {
  add(rows, count, n, sums);
}

using Add = void (*)(const double*, Eigen::Index, Eigen::Index, double*);

Add fastest() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx512f") != 0) return add_avx512;
  if (__builtin_cpu_supports("avx2") != 0) return add_avx2;
#endif
  return add_baseline;
}

}  // namespace

void add_products(const RowMajorMatrix& rows, Eigen::Index count, Eigen::MatrixXd& sums) {
  static const Add add = fastest();
  add(rows.data(), count, rows.cols(), sums.data());
}

}  // namespace kilotwin::identify
