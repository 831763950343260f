// Cost of light per robot and tick: with k sources, with and without shadows, and with an image.
#include <benchmark/benchmark.h>

#include "core/frames/swarm_view.hpp"
#include "core/senses/light_field.hpp"
#include "tests/support/scenes.hpp"

namespace kilotwin::senses {
namespace {

constexpr std::uint32_t kRobots = 1000;

/// Arguments: number of sources; 1 for shadows; height of the sources, mm.
void light(benchmark::State& state) {
  std::string text = "light { shadows: " + std::string(state.range(1) != 0 ? "true " : "false ");
  for (std::int64_t i = 0; i < state.range(0); ++i) {
    text += "source { x_mm: " + std::to_string(100 * i) + " height_mm: " + std::to_string(state.range(2)) +
            " circle { phase_deg: " + std::to_string(30 * i) + " } } ";
  }
  const RunPlan plan = testing::make_plan(text + "}", testing::grid_crowd(kRobots, 60, testing::Facing::kRandom));
  LightField field(plan, {0, kRobots});
  BodyFrame frame;
  for (std::uint32_t robot = 0; robot < kRobots; ++robot) {
    const Pose pose = plan.initial_pose(robot);
    frame.add(robot, pose.x_mm, pose.y_mm, pose.heading_rad);
  }
  const BodyFrame* const frames[] = {&frame};
  SwarmView swarm(kRobots, 0, 0);
  for (auto _ : state) {
    swarm.gather(frame.tick, frames);
    field.at(swarm);
    double sum = 0;
    for (std::uint32_t robot = 0; robot < kRobots; ++robot) sum += field.reading(robot);
    benchmark::DoNotOptimize(sum);
    ++frame.tick;
  }
  state.counters["ns_per_robot_tick"] =
      benchmark::Counter(static_cast<double>(state.iterations()) * kRobots / 1e9,
                         benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}
BENCHMARK(light)
    ->ArgNames({"sources", "shadows", "height"})
    ->Args({0, 0, 300})
    ->Args({1, 0, 300})
    ->Args({4, 0, 300})
    ->Args({16, 0, 300})
    ->Args({1, 1, 300})
    ->Args({4, 1, 300})
    ->Args({1, 1, 30})
    ->Args({4, 1, 30});

}  // namespace
}  // namespace kilotwin::senses
