#include "clients/identify/fit/products.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

namespace kilotwin::identify {
namespace {

constexpr Eigen::Index kLanes = 8, kStrip = NeededProducts::kStrip, kColumns = NeededProducts::kPanel;
static_assert(kStrip == 2 * kLanes && kColumns == kLanes);
using Lanes = double __attribute__((vector_size(kLanes * sizeof(double))));

/// One strip of rows of `sums` by some columns, in registers. Unrolled by hand, since compilers keep the array in
/// memory.
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

/// Some rows of `sums` by the columns of a panel, which lie in the lanes.
template <Eigen::Index... row>
inline __attribute__((always_inline)) void single_rows(const double* rows, Eigen::Index count, Eigen::Index n,
                                                       double* sums, const double* by,
                                                       std::integer_sequence<Eigen::Index, row...>) {
  Lanes sum[sizeof...(row)];
  for (Eigen::Index c = 0; c < kColumns; ++c) ((sum[row][c] = sums[c * n + row]), ...);
  for (Eigen::Index k = 0; k < count; ++k, rows += n, by += n) {
    Lanes panel;
    std::memcpy(&panel, by, sizeof(Lanes));
    ((sum[row] += panel * rows[row]), ...);
  }
  for (Eigen::Index c = 0; c < kColumns; ++c) ((sums[c * n + row] = sum[row][c]), ...);
}

inline __attribute__((always_inline)) void add(const double* rows, Eigen::Index count, Eigen::Index n,
                                               const NeededProducts& needed, double* sums) {
  using std::make_integer_sequence;
  for (Eigen::Index j = 0; j + kColumns <= n; j += kColumns) {
    double* const panel = sums + j * n;
    for (const Eigen::Index i : needed.strips(j / kColumns))
      strip(rows + i, count, n, panel + i, rows + j, make_integer_sequence<Eigen::Index, kColumns>());
    // The rows after the last whole strip.
    Eigen::Index i = n - (n - j) % kStrip;
    for (; i + 4 <= n; i += 4)
      single_rows(rows + i, count, n, panel + i, rows + j, make_integer_sequence<Eigen::Index, 4>());
    for (; i < n; ++i)
      single_rows(rows + i, count, n, panel + i, rows + j, make_integer_sequence<Eigen::Index, 1>());
  }
  for (Eigen::Index c = n - n % kColumns; c < n; ++c) {
    for (Eigen::Index i = c; i < n; ++i) {
      double sum = sums[c * n + i];
      for (Eigen::Index k = 0; k < count; ++k) sum += rows[k * n + i] * rows[k * n + c];
      sums[c * n + i] = sum;
    }
  }
}

/// to = start + by[0] * from[0] + ... over `terms` rows of n numbers. `start` is `to` or 0.
template <int terms, bool onto>
inline __attribute__((always_inline)) void combine(const double* by, const double* from, Eigen::Index stride,
                                                   Eigen::Index n, double* to) {
  Eigen::Index i = 0;
  for (; i + kLanes <= n; i += kLanes) {
    Lanes sum = {}, next;
    if (onto) std::memcpy(&sum, to + i, sizeof(Lanes));
    for (int k = 0; k < terms; ++k) {
      std::memcpy(&next, from + k * stride + i, sizeof(Lanes));
      sum += by[k] * next;
    }
    std::memcpy(to + i, &sum, sizeof(Lanes));
  }
  for (; i < n; ++i) {
    double sum = onto ? to[i] : 0;
    for (int k = 0; k < terms; ++k) sum += by[k] * from[k * stride + i];
    to[i] = sum;
  }
}

using Add = void (*)(const double*, Eigen::Index, Eigen::Index, const NeededProducts&, double*);
using Combine = void (*)(const double*, const double*, Eigen::Index, Eigen::Index, double*);

/// The kernels for one instruction set.
struct Kernels {
  Add add;
  Combine put3, onto3, onto2, onto1;
};

#define KILOTWIN_KERNELS(name, instructions)                                                                    \
  struct name {                                                                                                 \
    instructions static void add(const double* rows, Eigen::Index count, Eigen::Index n,                        \
                                 const NeededProducts& needed, double* sums) {                                  \
      identify::add(rows, count, n, needed, sums);                                                              \
    }                                                                                                           \
    template <int terms, bool onto>                                                                             \
    instructions static void combine(const double* by, const double* from, Eigen::Index stride, Eigen::Index n, \
                                     double* to) {                                                              \
      identify::combine<terms, onto>(by, from, stride, n, to);                                                  \
    }                                                                                                           \
    static constexpr Kernels kernels() {                                                                        \
      return {add, combine<3, false>, combine<3, true>, combine<2, true>, combine<1, true>};                    \
    }                                                                                                           \
  }

#if defined(__x86_64__)
KILOTWIN_KERNELS(Avx512, __attribute__((target("avx512f"))));
KILOTWIN_KERNELS(Avx2, __attribute__((target("avx2"))));
#endif
KILOTWIN_KERNELS(Baseline, );
#undef KILOTWIN_KERNELS

Kernels fastest() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx512f") != 0) return Avx512::kernels();
  if (__builtin_cpu_supports("avx2") != 0) return Avx2::kernels();
#endif
  return Baseline::kernels();
}
const Kernels kFastest = fastest();

using RowMajor3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

}  // namespace

NeededProducts::NeededProducts(Eigen::Index n) {
  for (Eigen::Index j = 0; j + kPanel <= n; j += kPanel) {
    std::vector<Eigen::Index>& strips = strips_.emplace_back();
    for (Eigen::Index i = j; i + kStrip <= n; i += kStrip) strips.push_back(i);
  }
}

NeededProducts::NeededProducts(Eigen::Index n, const std::vector<std::vector<Eigen::Index>>& groups,
                               Eigen::Index first, Eigen::Index last) {
  // Panels are needed with panels: those before and including the diagonal.
  const Eigen::Index panels = (n + kPanel - 1) / kPanel;
  Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic> with =
      Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic>::Constant(panels, panels, false);
  for (const std::vector<Eigen::Index>& group : groups) {
    std::vector<Eigen::Index> own(group.size());
    std::transform(group.begin(), group.end(), own.begin(), [](Eigen::Index column) { return column / kPanel; });
    std::sort(own.begin(), own.end());
    own.erase(std::unique(own.begin(), own.end()), own.end());
    for (const Eigen::Index a : own)
      for (const Eigen::Index b : own) with(a, b) = true;
  }
  if (first > 0) with.leftCols((first - 1) / kPanel + 1).setConstant(true);
  if (last > 0) with.bottomRows(panels - (n - last) / kPanel).setConstant(true);
  for (Eigen::Index j = 0; j + kPanel <= n; j += kPanel) {
    std::vector<Eigen::Index>& strips = strips_.emplace_back();
    for (Eigen::Index i = j; i + kStrip <= n; i += kStrip)
      if (with(i / kPanel, j / kPanel) || with(i / kPanel + 1, j / kPanel)) strips.push_back(i);
  }
}

void add_products(const RowMajorMatrix& rows, Eigen::Index count, const NeededProducts& needed,
                  Eigen::MatrixXd& sums) {
  kFastest.add(rows.data(), count, rows.cols(), needed, sums.data());
}

void put_combined(const Eigen::Matrix3d& by, const PoseRows& from, Eigen::Index count, double* to) {
  const RowMajor3 rows = by;
  for (Eigen::Index i = 0; i < count; ++i)
    kFastest.put3(rows.row(i).data(), from.data(), from.cols(), from.cols(), to + i * from.cols());
}

void take_combined(const Eigen::Matrix3d& by, const PoseRows& from, Eigen::Index count, PoseRows& to) {
  const RowMajor3 rows = -by;
  const Combine onto = count == 3 ? kFastest.onto3 : kFastest.onto2;
  for (Eigen::Index i = 0; i < 3; ++i)
    onto(rows.row(i).data(), from.data(), from.cols(), from.cols(), to.data() + i * to.cols());
}

void add_row(const Eigen::Vector3d& times, const double* row, Eigen::Index n, PoseRows& to, Eigen::Index first) {
  for (Eigen::Index i = 0; i < 3; ++i)
    if (times[i] != 0) kFastest.onto1(&times[i], row, n, n, to.data() + i * to.cols() + first);
}

}  // namespace kilotwin::identify
