// Cost of the physics engines per robot and tick on one core, sub-steps included; planar unless the name says otherwise. The
// result is the counter ns_per_robot_tick. For several partitions it is their sum, with the exchange of ghosts. Each iteration
// runs a scene for some ticks from the same start.
#include <benchmark/benchmark.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "services/physics/engine.hpp"
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
    const auto engine = physics::make_engine(plan, PartitionId{0});
    state.ResumeTiming();
    for (std::int64_t k = 0; k < ticks; ++k) {
      frame.tick = Tick{k};
      engine->step(Tick{k}, {{}, frames, {}});
    }
    benchmark::DoNotOptimize(engine->hash_part());
  }
  const double steps =
      static_cast<double>(state.iterations()) * static_cast<double>(ticks) * static_cast<double>(poses.size());
  state.counters["ns_per_robot_tick"] =
      benchmark::Counter(steps / 1e9, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

/// Disperses from a 40 mm grid over 2 x 2 partitions, stepped one after the other.
void run_partitions(benchmark::State& state, std::uint32_t robots, std::int64_t ticks) {
  const RunPlan plan = testing::make_plan("arena { width_mm: 10000 height_mm: 10000 }",
                                          testing::grid_crowd(robots, 40, Facing::kRandom), 2, 2);
  ActuationFrame frame =
      testing::motors(Tick{0}, std::vector<std::uint8_t>(robots, 70), std::vector<std::uint8_t>(robots, 70));
  const ActuationFrame* const frames[] = {&frame};
  BodyFrame ghosts[4][4];  // from, to
  for (auto _ : state) {
    state.PauseTiming();
    std::vector<std::unique_ptr<physics::Engine>> engines;
    for (std::uint32_t p = 0; p < 4; ++p) engines.push_back(physics::make_engine(plan, PartitionId{p}));
    state.ResumeTiming();
    for (std::int64_t k = 0; k < ticks; ++k) {
      frame.tick = Tick{k};
      for (std::uint32_t p = 0; p < 4; ++p) {
        for (const PartitionId q : engines[p]->neighbours()) engines[p]->emit_ghosts(q, ghosts[p][q.value()]);
      }
      for (std::uint32_t p = 0; p < 4; ++p) {
        const BodyFrame* in[3];
        for (std::uint32_t q = 0, n = 0; q < 4; ++q) {
          if (q != p) in[n++] = &ghosts[q][p];
        }
        engines[p]->step(Tick{k}, {in, frames, {}});
      }
    }
    for (const auto& engine : engines) benchmark::DoNotOptimize(engine->hash_part());
  }
  const double steps = static_cast<double>(state.iterations()) * static_cast<double>(ticks) * robots;
  state.counters["ns_per_robot_tick"] =
      benchmark::Counter(steps / 1e9, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

const std::string kArena = "arena { width_mm: 10000 height_mm: 10000 }";

void open_field(benchmark::State& state) {
  run(state, kArena, testing::grid_crowd(kRobots, 200, Facing::kRandom), 300, 70, 70);
}
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
  run(state, kArena + " motion { factor_variance_s: 0.001 }", testing::grid_crowd(kRobots, 200, Facing::kRandom),
      300, 70, 70);
}
void resting_cluster(benchmark::State& state) {
  run(state, kArena, testing::grid_crowd(kRobots, 33, Facing::kRandom), 300, 0, 0);
}
void partitions_2x2_of_100(benchmark::State& state) { run_partitions(state, 100, 1000); }
void partitions_2x2_of_1000(benchmark::State& state) { run_partitions(state, kRobots, 300); }
void whole_of_100(benchmark::State& state) {
  run(state, kArena, testing::grid_crowd(100, 40, Facing::kRandom), 1000, 70, 70);
}

void kinematic_cluster(benchmark::State& state) {
  run(state, kArena + " physics { engine: KINEMATIC }", testing::grid_crowd(kRobots, 40, Facing::kRandom), 300, 70,
      70);
}

const std::string kOde = kArena + " physics { engine: ODE }";

void ode_open_field(benchmark::State& state) {
  run(state, kOde, testing::grid_crowd(kRobots, 200, Facing::kRandom), 30, 70, 70);
}
void ode_cluster(benchmark::State& state) {
  run(state, kOde, testing::grid_crowd(kRobots, 40, Facing::kRandom), 30, 70, 70);
}
void ode_tightest_packing_inwards(benchmark::State& state) {
  run(state, kOde, testing::grid_crowd(kRobots, 33, Facing::kInwards), 30, 70, 70);
}

BENCHMARK(open_field);
BENCHMARK(disperse_cluster);
BENCHMARK(tightest_packing);
BENCHMARK(tightest_packing_inwards);
BENCHMARK(turning_cluster);
BENCHMARK(step_noise);
BENCHMARK(resting_cluster);
BENCHMARK(kinematic_cluster);
BENCHMARK(ode_open_field);
BENCHMARK(ode_cluster);
BENCHMARK(ode_tightest_packing_inwards);
BENCHMARK(whole_of_100);
BENCHMARK(partitions_2x2_of_100);
BENCHMARK(partitions_2x2_of_1000);

}  // namespace

BENCHMARK_MAIN();
