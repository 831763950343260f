#include "clients/identify/fit/products.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

namespace kilotwin::identify {
namespace {

constexpr Eigen::Index kLanes = 8, kStrip = 2 * kLanes, kColumns = 8;
using Lanes = double __attribute__((vector_size(kLanes * sizeof(double))));

/// One strip of rows of `sums` by some of its columns, in registers: written out, or a compiler keeps them in memory.
template <Eigen::Index... column>
inline __attribute__((always_inline)) void strip(const double* rows, Eigen::Index count, Eigen::Index n,
                                                 double* sums, const double* by,
                                                 std::integer_sequence<Eigen::Index, column...>) {
  Lanes low[sizeof...(column)], high[sizeof...(column)];
  (std::memcpy(&low[column], sums + column * n, sizeof(Lanes)), ...);
  (std::memcpy(&high[column], sums + column * n + kLanes, sizeof(Lanes)), ...);
  for (Eigen::Index k = 0; k < count; ++k, rows += n, by += n) {
    Lanes a, b;
    std::memcpy(&a, rows, sizeof(Lanes));
    std::memcpy(&b, rows + kLanes, sizeof(Lanes));
    ((low[column] += a * by[column], high[column] += b * by[column]), ...);
  }
  (std::memcpy(sums + column * n, &low[column], sizeof(Lanes)), ...);
  (std::memcpy(sums + column * n + kLanes, &high[column], sizeof(Lanes)), ...);
}

inline __attribute__((always_inline)) void add(const double* rows, Eigen::Index count, Eigen::Index n,
                                               double* sums) {
  for (Eigen::Index j = 0; j < n; j += kColumns) {
    const Eigen::Index columns = std::min(kColumns, n - j);
    Eigen::Index i = j;
    for (; i + kStrip <= n; i += kStrip) {
      if (columns == kColumns) {
        strip(rows + i, count, n, sums + j * n + i, rows + j, std::make_integer_sequence<Eigen::Index, kColumns>());
      } else {
        for (Eigen::Index c = j; c < n; ++c)
          strip(rows + i, count, n, sums + c * n + i, rows + c, std::make_integer_sequence<Eigen::Index, 1>());
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
