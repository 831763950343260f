// Cost of a model in ns per robot and tick: the drive alone ("none"), and with effects of each kind. 1000 robots in the open
// with the kinematic engine, so that nothing else varies.
#include <benchmark/benchmark.h>

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "services/physics/engine.hpp"
#include "tests/support/scenes.hpp"

namespace {

using namespace kilotwin;

constexpr std::uint32_t kRobots = 1000;
constexpr std::int64_t kTicks = 200;

void run(benchmark::State& state, const std::string& model) {
  const RunPlan plan =
      testing::make_plan("arena { width_mm: 10000 height_mm: 10000 } physics { engine: KINEMATIC } " + model,
                         testing::grid_crowd(kRobots, 50, testing::Facing::kRandom));
  ActuationFrame frame =
      testing::motors(Tick{0}, std::vector<std::uint8_t>(kRobots, 70), std::vector<std::uint8_t>(kRobots, 70));
  const ActuationFrame* const frames[] = {&frame};
  for (auto _ : state) {
    state.PauseTiming();
    const auto engine = physics::make_engine(plan, PartitionId{0});
    state.ResumeTiming();
    for (std::int64_t k = 0; k < kTicks; ++k) {
      frame.tick = Tick{k};
      engine->step(Tick{k}, {{}, frames, {}});
    }
    benchmark::DoNotOptimize(engine->hash_part());
  }
  const double steps = static_cast<double>(state.iterations()) * static_cast<double>(kTicks) * kRobots;
  state.counters["ns_per_robot_tick"] =
      benchmark::Counter(steps / 1e9, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

const std::map<std::string, std::string> kModels = {
    {"00 none", ""},
    {"01 factor noise", "motion { factor_variance_s: 0.001 }"},
    {"10 constant gain", "effect { name: 'e' acts_on: WHEEL_GAIN function { constant: -0.1 } }"},
    {"11 linear in time", "effect { name: 'e' acts_on: WHEEL_GAIN function { of: TIME linear { slope: -0.01 } } }"},
    {"12 exponential",
     "effect { name: 'e' acts_on: WHEEL_GAIN function { of: TIME exponential { at_zero: -0.1 scale: 9 } } }"},
    {"13 harmonic of heading",
     "effect { name: 'e' acts_on: WHEEL_GAIN function { of: HEADING harmonic { cosine: 0.1 } } }"},
    {"14 spline of 5 knots",
     "effect { name: 'e' acts_on: WHEEL_GAIN function { of: X spline { knot: [-900, -200, 0, 300, 900] value: [0, "
     "0.1, -0.1, 0.2, 0] } } }"},
    {"15 spline_2d of 3 x 3 knots",
     "effect { name: 'e' acts_on: WHEEL_GAIN function { of: X and_of: Y spline_2d { knot: [-500, 0, 500] and_knot: "
     "[-500, 0, 500] value: [0, 0.1, 0, 0.1, 0, 0.1, 0, 0.1, 0] } } }"},
    {"16 table by robot",
     "effect { name: 'e' acts_on: WHEEL_GAIN function { of: ROBOT table { key: [0, 999] value: [0.1, 0.2] } } }"},
    {"17 independent noise", "effect { name: 'e' acts_on: TURN_RATE function { noise { sd: 0.01 } } }"},
    {"18 correlated noise",
     "effect { name: 'e' acts_on: TURN_RATE function { noise { sd: 0.01 correlation_s: 10 } } }"},
    {"20 motor times",
     "effect { name: 'e' acts_on: WHEEL_GAIN function { of: MOTOR_TIME linear { slope: -0.001 } } }"},
    {"21 previous motion",
     "effect { name: 'e' acts_on: TURN_RATE function { of: PREVIOUS_TURN linear { slope: 0.1 } } }"},
    {"22 neighbours in 100 mm",
     "effect { name: 'e' acts_on: WHEEL_GAIN function { of: DENSITY radius_mm: 100 linear { slope: -0.01 } } }"},
    {"23 place",
     "field { name: 'f' } effect { name: 'e' acts_on: WHEEL_GAIN function { of: PLACE field: 'f' linear { slope: "
     "-0.01 } } }"},
    {"24 place that forgets",
     "field { name: 'f' forget_s: 60 } effect { name: 'e' acts_on: WHEEL_GAIN function { of: PLACE field: 'f' "
     "linear { slope: -0.01 } } }"},
    {"30 world drift", "effect { name: 'e' acts_on: WORLD_DRIFT direction_deg: 30 function { constant: 1 } }"},
};

}  // namespace

int main(int argc, char** argv) {
  for (const auto& [name, model] : kModels) {
    benchmark::RegisterBenchmark(name.c_str(), [&text = model](benchmark::State& state) { run(state, text); });
  }
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}
