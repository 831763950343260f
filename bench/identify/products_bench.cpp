// Cost of the products of the linearisation, on each instruction set of this machine (0: SSE2, 1: AVX2, 2: AVX-512). The result is
// the counter products_per_ns, on one core, to be compared with that of Eigen's product of matrices ("Eigen"), which rounds otherwise.
#include <benchmark/benchmark.h>

#include <string>

#include "clients/identify/fit/products.hpp"

namespace {

using namespace kilotwin::identify;

/// Rows that are summed at once, as in the linearisation.
constexpr Eigen::Index kRows = 96;

template <class Add> void run(benchmark::State& state, Add&& add) {
  const Eigen::Index n = state.range(0);
  const RowMajorMatrix rows = RowMajorMatrix::Constant(kRows, n, 1e-3);
  Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(n, n);
  for (auto _ : state) {
    add(rows, sums);
    benchmark::DoNotOptimize(sums.data());
  }
  const auto products = static_cast<double>(kRows * n * (n + 1) / 2);
  state.counters["products_per_ns"] =
      benchmark::Counter(1e-9 * products * static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
}

}  // namespace

int main(int argc, char** argv) {
  const auto at_sizes = [](benchmark::internal::Benchmark* of) { of->Arg(100)->Arg(500)->Arg(1500); };
  for (std::size_t set = 0; set < instruction_sets(); ++set) {
    at_sizes(benchmark::RegisterBenchmark(("products/" + std::to_string(set)).c_str(), [set](auto& state) {
      const NeededProducts all(state.range(0));
      run(state,
          [&](const RowMajorMatrix& rows, Eigen::MatrixXd& sums) { add_products(rows, kRows, all, sums, set); });
    }));
  }
  at_sizes(benchmark::RegisterBenchmark("products/Eigen", [](auto& state) {
    run(state, [](const RowMajorMatrix& rows, Eigen::MatrixXd& sums) {
      sums.selfadjointView<Eigen::Lower>().rankUpdate(rows.transpose());
    });
  }));
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
}
