// Cost of the planar engine per robot and tick, sub-steps included, 1000 robots on one core. The counter ns_per_robot_tick
// is what to watch. Each scene is run for `seconds` of simulated time per iteration from the same start.
#include <benchmark/benchmark.h>

#include <cstdint>
#include <string>
#include <vector>

#include "services/physics/planar_engine.hpp"
#include "tests/support/scenes.hpp"

namespace {

using namespace kilotwin;
using testing::Facing;

constexpr std::uint32_t kRobots = 1000;

void run(benchmark::State& state, const std::string& experiment, const std::vector<testing::ScenePose>& poses,
         std::int64_t ticks, std::uint8_t duty_left, std::uint8_t duty_right) {
  const RunPlan plan = testing::make_plan(experiment, poses);
  ActuationFrame frame = testing::motors(Tick{0}, std::vector<std::uint8_t>(poses.size(), duty_left),
                                         std::vector<std::uint8_t>(poses.size(), duty_right));
  const ActuationFrame* const frames[] = {&frame};
  for (auto _ : state) {
    state.PauseTiming();
    physics::PlanarEngine engine(plan, PartitionId{0});
    state.ResumeTiming();
    for (std::int64_t k = 0; k < ticks; ++k) {
      frame.tick = Tick{k};
      engine.step(Tick{k}, {{}, frames, {}});
    }
    benchmark::DoNotOptimize(engine.hash_part());
  }
  const double steps = static_cast<double>(state.iterations()) * static_cast<double>(ticks) * static_cast<double>(poses.size());
  state.counters["ns_per_robot_tick"] =
      benchmark::Counter(steps / 1e9, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

const std::string kArena = "arena { width_mm: 10000 height_mm: 10000 }";

void open_field(benchmark::State& state) { run(state, kArena, testing::grid_crowd(kRobots, 200, Facing::kRandom), 300, 70, 70); }
void disperse_cluster(benchmark::State& state) {
  run(state, kArena, testing::grid_crowd(kRobots, 40, Facing::kRandom), 300, 70, 70);
}
void tightest_packing(benchmark::State& state) {
  run(state, kArena, testing::grid_crowd(kRobots, 33, Facing::kRandom), 300, 70, 70);
}
void tightest_packing_inwards(benchmark::State& state) {
  run(state, kArena, testing::grid_crowd(kRobots, 33, Facing::kInwards), 300, 70, 70);
}
void turning_cluster(benchmark::State& state) {
  run(state, kArena, testing::grid_crowd(kRobots, 40, Facing::kRandom), 300, 70, 0);
}
void step_noise(benchmark::State& state) {
  run(state, kArena + " motion { factor_variance_s: 0.001 }", testing::grid_crowd(kRobots, 200, Facing::kRandom), 300, 70, 70);
}
void resting_cluster(benchmark::State& state) {
  run(state, kArena, testing::grid_crowd(kRobots, 33, Facing::kRandom), 300, 0, 0);
}

BENCHMARK(open_field);
BENCHMARK(disperse_cluster);
BENCHMARK(tightest_packing);
BENCHMARK(tightest_packing_inwards);
BENCHMARK(turning_cluster);
BENCHMARK(step_noise);
BENCHMARK(resting_cluster);

}  // namespace

BENCHMARK_MAIN();
