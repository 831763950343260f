// The fast swarm equals the engine's at low density, and nearly in a crowd.
#include <gtest/gtest.h>

#include <cmath>

#include "clients/identify/kilogrid/fast_swarm.hpp"
#include "clients/identify/kilogrid/floor_statistics.hpp"

namespace kilotwin::kilogrid {
namespace {

/// Robots in rows of eight, `apart_mm` between rows.
FloorScene rows(std::uint32_t robots, double apart_mm, double duration_s) {
  FloorScene scene{"rows", duration_s, {}, {}};
  for (std::uint32_t i = 0; i < robots; ++i) {
    scene.x_mm.push_back(150 + 100 * (i % 8));
    scene.y_mm.push_back(200 + apart_mm * (i / 8));
  }
  return scene;
}

FloorSettings settings_of(double bias_sd_mm_s) {
  FloorModel model;
  model.add(base_term());
  model.values[2] = bias_sd_mm_s;
  return model.settings();
}

struct Both {
  FloorStatistics engine, quick;
};

Both play(const FloorScene& scene, const FloorSettings& settings, int repeats) {
  std::vector<RobotSums> engine, quick;
  for (int r = 0; r < repeats; ++r) {
    const auto seed = static_cast<std::uint64_t>(r + 1);
    const auto a = robot_sums(simulate(scene, {}, settings.model, settings.times, settings.radio, seed), {}),
               b = robot_sums(simulate_fast(scene, {}, settings, seed + 100), {});
    engine.insert(engine.end(), a.begin(), a.end());
    quick.insert(quick.end(), b.begin(), b.end());
  }
  return {statistics_of(engine), statistics_of(quick)};
}

TEST(FastSwarm, IsDeterministic) {
  const FloorScene scene = rows(24, 200, 200);
  const FloorSettings settings = settings_of(1.2);
  const FloorRun a = simulate_fast(scene, {}, settings, 5), b = simulate_fast(scene, {}, settings, 5),
                 c = simulate_fast(scene, {}, settings, 6);
  ASSERT_EQ(a.tracks.size(), b.tracks.size());
  bool differs = a.tracks.size() != c.tracks.size();
  for (std::size_t i = 0; i < a.tracks.size(); ++i) {
    EXPECT_EQ(a.tracks[i].x_mm, b.tracks[i].x_mm);
    EXPECT_EQ(a.tracks[i].time_s, b.tracks[i].time_s);
    differs = differs || a.tracks[i].x_mm != c.tracks[i].x_mm;
  }
  EXPECT_TRUE(differs);
}

TEST(FastSwarm, FewRobotsMoveAsInTheEngine) {
  const Both both = play(rows(8, 0, 1500), settings_of(0.3), 4);
  for (const char* name : {"speed", "msd", "occupancy", "turn"}) {
    const StatisticGroup& group = statistic_group(name);
    const std::size_t count = std::string(name) == "speed" ? 1 : std::min<std::size_t>(group.size(), 5);
    for (std::size_t s = group.first; s < group.first + count; ++s) {
      const double chance = std::sqrt(both.engine.variance[s] + both.quick.variance[s]);
      // Four standard errors for about twenty statistics, and the effect of few encounters.
      EXPECT_NEAR(both.quick.value[s], both.engine.value[s], 4 * chance + 0.03 * both.engine.value[s])
          << name << ' ' << group.labels[s - group.first];
    }
  }
}

TEST(FastSwarm, ACrowdIsSlowerNearlyAsInTheEngine) {
  const FloorSettings settings = settings_of(1.2);
  const std::size_t speed = statistic_group("speed").first;
  const Both few = play(rows(8, 0, 1000), settings, 3), crowd = play(rows(96, 130, 1000), settings, 1);
  EXPECT_LT(crowd.quick.value[speed], 0.95 * few.quick.value[speed]);
  EXPECT_NEAR(crowd.quick.value[speed] / crowd.engine.value[speed], 1.05, 0.07);
}

}  // namespace
}  // namespace kilotwin::kilogrid
