// Cost of the radio engine per robot and tick on one core: step, emit and hash, plus 2 to 3 ns for the fake hosts. The result
// is the counter ns_per_robot_tick, of CPU time. All robots send as often as the firmware allows.
#include <benchmark/benchmark.h>

#include <cstdint>
#include <string>

#include "tests/services/comm/fake_hosts.hpp"

namespace {

using namespace kilotwin;
using testing::Facing;

/// 128 ticks are 4.2 s: eight messages of each robot.
constexpr int kWarmUp = 64, kTicks = 128;

/// `moving`: all robots move forward in every tick, and back again after a while.
void run(benchmark::State& state, const std::string& experiment, double pitch_mm, bool broadcast,
         bool moving = false) {
  const auto robots = static_cast<std::uint32_t>(state.range(0));
  const RunPlan plan = testing::make_plan(experiment, testing::grid_crowd(robots, pitch_mm, Facing::kRandom));
  testing::Swarm swarm(plan);
  if (broadcast) swarm.hosts.overhead.packets.push_back({OverheadCommand::kRepeat, {}});
  for (int k = 0; k < kWarmUp; ++k) swarm.step();
  const auto before = swarm.radio.counters();
  std::uint64_t sum = 0;
  for (auto _ : state) {
    for (int k = 0; k < kTicks; ++k) {
      if (moving) {
        state.PauseTiming();
        for (auto& pose : swarm.hosts.poses) pose.x_mm += k < kTicks / 2 ? 0.3 : -0.3;
        swarm.hosts.place();
        state.ResumeTiming();
      }
      swarm.step();
      sum += swarm.radio.hash_part();
    }
  }
  benchmark::DoNotOptimize(sum);
  const double steps = static_cast<double>(state.iterations()) * kTicks * robots;
  state.counters["ns_per_robot_tick"] =
      benchmark::Counter(steps / 1e9, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
  const auto after = swarm.radio.counters();
  state.counters["received_per_robot_tick"] = static_cast<double>(after.received - before.received) / steps;
}

const std::string kArena = "arena { width_mm: 10000 height_mm: 10000 } radio { range_mm: 100 }";

/// The same with model PROPAGATION and the default range: a robot has about twice as many robots in reach.
const std::string kStrength =
    "arena { width_mm: 10000 height_mm: 10000 } radio { model: PROPAGATION range_mm: 100 }";
const std::string kStrengthFar = "arena { width_mm: 10000 height_mm: 10000 } radio { model: PROPAGATION }";
const std::string kFar = "arena { width_mm: 10000 height_mm: 10000 }";

void disperse_cluster(benchmark::State& state) { run(state, kArena, 40, false); }
void disperse_cluster_propagation(benchmark::State& state) { run(state, kStrength, 40, false); }
void disperse_cluster_130_mm(benchmark::State& state) { run(state, kFar, 40, false); }
void disperse_cluster_130_mm_propagation(benchmark::State& state) { run(state, kStrengthFar, 40, false); }
void moving_cluster(benchmark::State& state) { run(state, kArena, 40, false, true); }
void moving_cluster_propagation(benchmark::State& state) { run(state, kStrength, 40, false, true); }
void open_field(benchmark::State& state) { run(state, kArena, 200, false); }
void overhead_broadcast(benchmark::State& state) { run(state, kArena, 40, true); }

BENCHMARK(disperse_cluster)->Arg(100)->Arg(1000)->Arg(10000);
BENCHMARK(disperse_cluster_propagation)->Arg(100)->Arg(1000)->Arg(10000);
BENCHMARK(disperse_cluster_130_mm)->Arg(1000);
BENCHMARK(disperse_cluster_130_mm_propagation)->Arg(1000);
BENCHMARK(moving_cluster)->Arg(1000);
BENCHMARK(moving_cluster_propagation)->Arg(1000);
BENCHMARK(open_field)->Arg(1000);
BENCHMARK(overhead_broadcast)->Arg(1000);

}  // namespace

BENCHMARK_MAIN();
