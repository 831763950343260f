#include "clients/identify/fit/products.hpp"

#include <algorithm>
#include <cstring>
#include <numeric>
#include <utility>

namespace kilotwin::identify {
namespace {

constexpr Eigen::Index kPanel = NeededProducts::kPanel;

/// Contents of a register of so many numbers. An alias in place of the typedef loses the size (GCC 12).
template <int lanes> struct Register {
  // NOLINTNEXTLINE(modernize-use-using)
  typedef double Lanes __attribute__((vector_size(lanes * sizeof(double))));
};

/// Sums of the kPanel columns at `rows` by some columns of the panel at `by`, in 8 registers. `stride`: between columns of `sums`.
/// Unrolled by hand, since compilers keep arrays in memory.
template <int lanes, int... vector, int... sum>
inline __attribute__((always_inline)) void add_tile(const double* rows, const double* by, Eigen::Index count,
                                                    double* sums, Eigen::Index stride,
                                                    std::integer_sequence<int, vector...>,
                                                    std::integer_sequence<int, sum...>) {
  using Lanes = typename Register<lanes>::Lanes;
  constexpr int kVectors = sizeof...(vector);
  static_assert(kVectors * lanes == kPanel);
  Lanes kept[sizeof...(sum)], row[sizeof...(vector)];
  const auto place = [=](int n) { return sums + n / kVectors * stride + n % kVectors * lanes; };
  (std::memcpy(&kept[sum], place(sum), sizeof(Lanes)), ...);
  for (Eigen::Index k = 0; k < count; ++k, rows += kPanel, by += kPanel) {
    (std::memcpy(&row[vector], rows + vector * lanes, sizeof(Lanes)), ...);
    ((kept[sum] += row[sum % kVectors] * by[sum / kVectors]), ...);
  }
  (std::memcpy(place(sum), &kept[sum], sizeof(Lanes)), ...);
}

/// All sums of two panels.
template <int lanes>
inline __attribute__((always_inline)) void add_panels(const double* rows, const double* by, Eigen::Index count,
                                                      double* sums, Eigen::Index stride) {
  // Sums in registers, as in add_tile.
  constexpr int kSums = 8, kVectors = kPanel / lanes, kColumns = kSums / kVectors;
  for (Eigen::Index c = 0; c < kPanel; c += kColumns)
    add_tile<lanes>(rows, by + c, count, sums + c * stride, stride, std::make_integer_sequence<int, kVectors>(),
                    std::make_integer_sequence<int, kSums>());
}

/// The columns panel by panel, those of a panel beside each other, filled up with zeros. Otherwise each row of a panel would lie in a
/// memory page of its own.
const std::vector<double>& in_panels(const double* rows, Eigen::Index count, Eigen::Index n) {
  thread_local std::vector<double> packed;
  const Eigen::Index panels = (n + kPanel - 1) / kPanel;
  packed.assign(static_cast<std::size_t>(panels * count * kPanel), 0);
  for (Eigen::Index k = 0; k < count; ++k)
    for (Eigen::Index p = 0; p < panels; ++p)
      std::copy_n(rows + k * n + p * kPanel, std::min(kPanel, n - p * kPanel),
                  packed.data() + (p * count + k) * kPanel);
  return packed;
}

template <int lanes>
inline __attribute__((always_inline)) void add(const double* panels, Eigen::Index count, Eigen::Index n,
                                               const NeededProducts& needed, double* sums) {
  for (Eigen::Index j = 0; j * kPanel < n; ++j) {
    const Eigen::Index columns = std::min(kPanel, n - j * kPanel);
    for (const Eigen::Index i : needed.with(j)) {
      const double *const rows = panels + i * count * kPanel, *const by = panels + j * count * kPanel;
      double* const to = sums + j * kPanel * n + i * kPanel;
      if ((i + 1) * kPanel <= n) {
        add_panels<lanes>(rows, by, count, to, n);
        continue;
      }
      // The last panel may have fewer columns.
      const Eigen::Index rest = n - i * kPanel;
      double own[kPanel * kPanel] = {};
      for (Eigen::Index c = 0; c < columns; ++c) std::copy_n(to + c * n, rest, own + c * kPanel);
      add_panels<lanes>(rows, by, count, own, kPanel);
      for (Eigen::Index c = 0; c < columns; ++c) std::copy_n(own + c * kPanel, rest, to + c * n);
    }
  }
}

/// to = start + by[0] * from[0] + ... over `terms` rows of n numbers. `start` is `to` or 0.
template <int lanes, int terms, bool onto>
inline __attribute__((always_inline)) void combine(const double* by, const double* from, Eigen::Index stride,
                                                   Eigen::Index n, double* to) {
  using Lanes = typename Register<lanes>::Lanes;
  Eigen::Index i = 0;
  for (; i + lanes <= n; i += lanes) {
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

// NOLINTBEGIN(bugprone-macro-parentheses): an attribute cannot stand in any
#define KILOTWIN_KERNELS(name, lanes, instructions)                                                             \
  struct name {                                                                                                 \
    instructions static void add(const double* panels, Eigen::Index count, Eigen::Index n,                      \
                                 const NeededProducts& needed, double* sums) {                                  \
      identify::add<(lanes)>(panels, count, n, needed, sums);                                                   \
    }                                                                                                           \
    template <int terms, bool onto>                                                                             \
    instructions static void combine(const double* by, const double* from, Eigen::Index stride, Eigen::Index n, \
                                     double* to) {                                                              \
      identify::combine<(lanes), terms, onto>(by, from, stride, n, to);                                         \
    }                                                                                                           \
    static constexpr Kernels kernels() {                                                                        \
      return {add, combine<3, false>, combine<3, true>, combine<2, true>, combine<1, true>};                    \
    }                                                                                                           \
  }

#if defined(__x86_64__)
KILOTWIN_KERNELS(Avx512, 8, __attribute__((target("avx512f"))));
KILOTWIN_KERNELS(Avx2, 4, __attribute__((target("avx2"))));
#endif
KILOTWIN_KERNELS(Baseline, 2, );
#undef KILOTWIN_KERNELS
// NOLINTEND(bugprone-macro-parentheses)

/// Those of this machine, the slowest first, as instruction_sets() counts them.
std::vector<Kernels> kernels_of_machine() {
  std::vector<Kernels> all{Baseline::kernels()};
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2") != 0) all.push_back(Avx2::kernels());
  if (__builtin_cpu_supports("avx512f") != 0) all.push_back(Avx512::kernels());
#endif
  return all;
}
const std::vector<Kernels> kKernels = kernels_of_machine();
const Kernels kFastest = kKernels.back();

using RowMajor3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

}  // namespace

NeededProducts::NeededProducts(Eigen::Index n) {
  const Eigen::Index panels = (n + kPanel - 1) / kPanel;
  for (Eigen::Index j = 0; j < panels; ++j) {
    std::vector<Eigen::Index>& with = with_.emplace_back(static_cast<std::size_t>(panels - j));
    std::iota(with.begin(), with.end(), j);
  }
}

NeededProducts::NeededProducts(Eigen::Index n, const std::vector<std::vector<Eigen::Index>>& groups,
                               Eigen::Index first, Eigen::Index last) {
  const Eigen::Index panels = (n + kPanel - 1) / kPanel;
  Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic> needed =
      Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic>::Constant(panels, panels, false);
  for (const std::vector<Eigen::Index>& group : groups) {
    std::vector<Eigen::Index> own(group.size());
    std::transform(group.begin(), group.end(), own.begin(), [](Eigen::Index column) { return column / kPanel; });
    std::sort(own.begin(), own.end());
    own.erase(std::unique(own.begin(), own.end()), own.end());
    for (const Eigen::Index a : own)
      for (const Eigen::Index b : own) needed(a, b) = true;
  }
  if (first > 0) needed.leftCols((first - 1) / kPanel + 1).setConstant(true);
  if (last > 0) needed.bottomRows(panels - (n - last) / kPanel).setConstant(true);
  for (Eigen::Index j = 0; j < panels; ++j) {
    std::vector<Eigen::Index>& with = with_.emplace_back();
    for (Eigen::Index i = j; i < panels; ++i)
      if (needed(i, j)) with.push_back(i);
  }
}

std::size_t instruction_sets() { return kKernels.size(); }

void add_products(const RowMajorMatrix& rows, Eigen::Index count, const NeededProducts& needed,
                  Eigen::MatrixXd& sums, std::optional<std::size_t> instruction_set) {
  const Eigen::Index n = rows.cols();
  const Kernels& kernels = instruction_set ? kKernels[*instruction_set] : kFastest;
  kernels.add(in_panels(rows.data(), count, n).data(), count, n, needed, sums.data());
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
