// Laws of the ODE engine: friction on a slope in closed form, limited thrust, partitions, threads.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <thread>

#include "services/physics/ode_engine.hpp"
#include "tests/services/physics/swarm.hpp"

namespace kilotwin {
namespace {

using testing::make_plan;
using testing::ScenePose;
using testing::Swarm;

using testing::kTick_s;
constexpr double kGravity_mm_s2 = 9806.65;
/// The experiment's defaults: friction of resting legs, and thrust over mass.
constexpr double kFriction = 0.3, kThrust_mm_s2 = 1177;

std::string tilted(double tilt_deg, double downhill_deg) {
  return "motion { noise: false } arena { width_mm: 20000 height_mm: 20000 } physics { engine: ODE tilt_deg: " +
         std::to_string(tilt_deg) + " downhill_deg: " + std::to_string(downhill_deg) + " }";
}

/// Robots with various headings, far from each other.
std::vector<ScenePose> compass() {
  std::vector<ScenePose> poses;
  for (int i = 0; i < 8; ++i) poses.push_back({200.0 * i, -100.0 * i, wrapped(i * 0.8)});
  return poses;
}

/// Displacement of a robot along the direction, mm.
double along_mm(const ScenePose& from, const ScenePose& to, double direction_deg) {
  const double direction = direction_deg * kPi / 180;
  return (to.x_mm - from.x_mm) * std::cos(direction) + (to.y_mm - from.y_mm) * std::sin(direction);
}

TEST(OdeSlope, BelowTheFrictionAngleRobotsRest) {
  const double angle_deg = std::atan(kFriction) * 180 / kPi;
  for (const double downhill_deg : {0.0, 50.0, 200.0}) {
    const auto start = compass();
    const RunPlan plan = make_plan(tilted(angle_deg - 0.3, downhill_deg), start);
    Swarm swarm(plan);
    swarm.run(200);
    const auto end = swarm.poses();
    for (std::size_t r = 0; r < start.size(); ++r) {
      EXPECT_NEAR(end[r].x_mm, start[r].x_mm, 0.02) << r;
      EXPECT_NEAR(end[r].y_mm, start[r].y_mm, 0.02) << r;
    }
  }
}

TEST(OdeSlope, AboveTheFrictionAngleRobotsSlideInClosedForm) {
  for (const double tilt_deg : {18.0, 25.0}) {
    for (const double downhill_deg : {0.0, 50.0, 200.0}) {
      const auto start = compass();
      const RunPlan plan = make_plan(tilted(tilt_deg, downhill_deg), start);
      Swarm swarm(plan);
      constexpr int kTicks = 40;
      swarm.run(kTicks);
      const auto end = swarm.poses();
      const double tilt = tilt_deg * kPi / 180, time_s = kTicks * kTick_s;
      // A sub-step uses the velocity at its end, so the displacement exceeds the closed form by half a sub-step.
      const double acceleration = kGravity_mm_s2 * (std::sin(tilt) - kFriction * std::cos(tilt));
      const double way_mm = acceleration * time_s * (time_s + kTick_s / 4) / 2;
      for (std::size_t r = 0; r < start.size(); ++r)
        EXPECT_NEAR(along_mm(start[r], end[r], downhill_deg) / way_mm, 1, 0.01) << r << " at " << tilt_deg;
    }
  }
}

TEST(OdeSlope, ThrustIsBounded) {
  // A robot climbs a slope as long as its thrust exceeds the component of its weight along it; on steeper slopes it slides down.
  const double steepest_deg = std::asin(kThrust_mm_s2 / kGravity_mm_s2) * 180 / kPi;
  const std::vector<ScenePose> start = {{0, 0, kPi}};
  const RunPlan easy = make_plan(tilted(steepest_deg - 1, 0), start),
                hard = make_plan(tilted(steepest_deg + 1, 0), start);
  Swarm up(easy), down(hard);
  constexpr int kTicks = 120;
  for (Swarm* s : {&up, &down}) {
    s->set_all_motors(70, 70);
    s->run(kTicks);
  }
  const double time_s = kTicks * kTick_s;
  EXPECT_NEAR(up.poses()[0].x_mm / (-10 * time_s), 1, 0.02);
  const double acceleration = kGravity_mm_s2 * std::sin((steepest_deg + 1) * kPi / 180) - kThrust_mm_s2;
  EXPECT_NEAR(down.poses()[0].x_mm / (acceleration * time_s * (time_s + kTick_s / 4) / 2), 1, 0.02);
}

TEST(OdeSlope, SlidingBodiesStopAtTheWall) {
  const RunPlan plan = make_plan(
      "motion { noise: false } arena { width_mm: 600 height_mm: 600 } physics { engine: ODE tilt_deg: 40 }",
      {{-200, 0, 1}, {-200, 100, 2}, {-240, 5, 0}}, 3, 1);
  Swarm swarm(plan);
  swarm.run(120);
  for (const ScenePose& pose : swarm.poses()) {
    EXPECT_LE(pose.x_mm, 283.6);
    EXPECT_GT(pose.x_mm, 200);
  }
  EXPECT_LE(testing::largest_overlap_mm(swarm.poses()), 0.1);
}

TEST(OdePartitions, SmallGroupsGiveTheSameBits) {
  const auto crowd = testing::random_crowd(60, 960, 960, 60, 3);
  const std::string text = "arena { width_mm: 1000 height_mm: 1000 } physics { engine: ODE }";
  const RunPlan whole = make_plan(text, crowd), cut = make_plan(text, crowd, 3, 2);
  Swarm a(whole), b(cut);
  for (std::uint32_t k = 0; k < 300; ++k) {
    for (Swarm* s : {&a, &b}) {
      drive(*s, 60, k);
      s->step();
    }
    ASSERT_EQ(a.hash(), b.hash()) << k;
  }
}

double rms_mm(const std::vector<ScenePose>& p, const std::vector<ScenePose>& q) {
  double sum = 0;
  for (std::size_t r = 0; r < p.size(); ++r)
    sum += (p[r].x_mm - q[r].x_mm) * (p[r].x_mm - q[r].x_mm) + (p[r].y_mm - q[r].y_mm) * (p[r].y_mm - q[r].y_mm);
  return std::sqrt(sum / static_cast<double>(p.size()));
}

struct Gathering {
  const char* name;
  double pitch_mm;
  testing::Facing facing;
  double most_rms_mm;
};

// At a cut group, the two sides of a border compute with their own forces, which the iterative solver finds only to a tolerance.
// In a compressed crowd such differences grow like those of another seed. The test prints them for
// docs/explanation/contact.md.
TEST(OdePartitions, CutGroupsGiveSimilarResults) {
  for (const Gathering& tested :
       {Gathering{"that disperses from a 36 mm grid", 36, testing::Facing::kRandom, 8},
        Gathering{"driven to its centre from a 33.5 mm grid", 33.5, testing::Facing::kInwards, 16}}) {
    const auto crowd = testing::grid_crowd(196, tested.pitch_mm, tested.facing);
    const std::string text =
        "motion { noise: false } arena { width_mm: 700 height_mm: 700 } physics { engine: ODE }";
    const RunPlan whole = make_plan(text, crowd), cut = make_plan(text, crowd, 4, 4),
                  other = make_plan(text + " seed: 2", crowd);
    Swarm a(whole), b(cut), c(other);
    for (Swarm* s : {&a, &b, &c}) {
      s->set_all_motors(70, 70);
      s->run(122);
    }
    const double by_cut_mm = rms_mm(a.poses(), b.poses()), by_seed_mm = rms_mm(a.poses(), c.poses());
    const double overlap_mm = testing::largest_overlap_mm(b.poses());
    std::printf(
        "196 robots %s, after 4 s: 4x4 instead of 1x1 partitions %.2g mm rms, another seed of the solver %.2g mm "
        "rms, "
        "overlap at most %.2g mm\n",
        tested.name, by_cut_mm, by_seed_mm, overlap_mm);
    EXPECT_LT(by_cut_mm, tested.most_rms_mm);
    EXPECT_LE(overlap_mm, 1);
  }
}

TEST(OdeThreads, WorldsOfSeveralThreadsDoNotDisturbEachOther) {
  // Crowds use the iterative solver and its random numbers; single robots use the exact solver.
  const auto crowd = testing::random_crowd(120, 700, 700, 33, 9);
  const std::string text = "arena { width_mm: 800 height_mm: 800 } physics { engine: ODE }";
  const auto hash_of = [&](std::uint64_t seed) {
    const RunPlan plan = make_plan(text + " seed: " + std::to_string(seed), crowd, 2, 1);
    Swarm swarm(plan);
    for (std::uint32_t k = 0; k < 60; ++k) {
      drive(swarm, 120, k);
      swarm.step();
    }
    return swarm.hash();
  };
  std::uint64_t alone[4], together[4];
  for (std::uint64_t seed = 0; seed < 4; ++seed) alone[seed] = hash_of(seed);
  std::vector<std::thread> threads;
  for (std::uint64_t seed = 0; seed < 4; ++seed)
    threads.emplace_back([&, seed] { together[seed] = hash_of(seed); });
  for (std::thread& thread : threads) thread.join();
  for (std::uint64_t seed = 0; seed < 4; ++seed) EXPECT_EQ(alone[seed], together[seed]);
}

}  // namespace
}  // namespace kilotwin
