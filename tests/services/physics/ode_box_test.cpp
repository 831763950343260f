// Movable bodies, obstacles, beacons and the arena's shapes in the ODE engine.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "tests/services/physics/swarm.hpp"

namespace kilotwin {
namespace {

using testing::make_plan;
using testing::ScenePose;
using testing::Swarm;

const std::string kOde = "motion { noise: false } physics { engine: ODE } ";

/// k robots 1 mm from the box's left face: side by side, or three side by side and the others behind.
std::vector<ScenePose> pushers(int k, bool columns, double face_mm) {
  std::vector<ScenePose> poses;
  for (int i = 0; i < k; ++i) {
    const int row = columns ? i / 3 : 0, in_row = columns ? std::min(3, k - 3 * row) : k,
              place = columns ? i % 3 : i;
    const double pitch_mm = columns ? 33.2 : 36;
    poses.push_back({face_mm - 17.5 - 33.5 * row, (place - (in_row - 1) / 2.0) * pitch_mm, 0});
  }
  return poses;
}

// The ARGoS paper (Pinciroli 2018, section 3.3): a box of 18 g needs five robots. ARGoS' displacements for this set-up: 0.04,
// 0.2, 0.6, 1.5 and 394 mm.
TEST(OdeBox, FourRobotsDoNotMoveItAndFiveDo) {
  for (const bool columns : {false, true}) {
    for (int k = 1; k <= 5; ++k) {
      const std::string box = columns ? "movable { box { width_mm: 100 length_mm: 100 } mass_g: 18 } "
                                      : "movable { box { width_mm: 100 length_mm: 300 } mass_g: 18 } ";
      const RunPlan plan = make_plan(kOde + box, pushers(k, columns, -50));
      Swarm swarm(plan);
      swarm.set_all_motors(70, 70);
      double way_mm[2];
      for (double& way : way_mm) {
        swarm.run(305);
        way = swarm.movables()[0].x_mm;
      }
      std::printf("%d robots %s: the box went %.3f mm in 10 s, %.3f mm in 20 s\n", k,
                  columns ? "in columns" : "abreast", way_mm[0], way_mm[1]);
      if (k < 5) {
        EXPECT_LT(way_mm[1], 2);
        EXPECT_NEAR(way_mm[1], way_mm[0], 0.005) << "it creeps";
      } else {
        EXPECT_GT(way_mm[1] - way_mm[0], 90);
      }
    }
  }
}

TEST(OdeBox, ObstaclesWallsAndBeaconsDoNotMove) {
  const RunPlan plan = make_plan(
      kOde +
          "arena { circle { radius_mm: 300 } } obstacle { box { width_mm: 40 length_mm: 200 } x_mm: 100 } "
          "robots { count: 2 } robots { count: 1 immobile: true }",
      {{0, 0, 0}, {-200, 0, kPi}, {0, 150, 0}});
  Swarm swarm(plan);
  swarm.set_all_motors(70, 70);
  swarm.run(400);
  const auto end = swarm.poses();
  EXPECT_NEAR(end[0].x_mm, 80 - 16.5, 0.05);
  EXPECT_NEAR(end[1].x_mm, -(300 - 16.5), 0.05);
  EXPECT_EQ(end[2].x_mm, 0);
  EXPECT_EQ(end[2].y_mm, 150);
}

TEST(OdeBox, ABoxSlidesDownASlopeInClosedFormAndStopsAtTheWall) {
  const std::string text =
      "arena { width_mm: 4000 height_mm: 4000 } physics { engine: ODE tilt_deg: 25 } "
      "movable { box { width_mm: 60 length_mm: 80 } mass_g: 30 friction: 0.2 } "
      "movable { cylinder { radius_mm: 30 } mass_g: 30 friction: 0.2 y_mm: 300 } "
      "movable { polygon { x_mm: [0, 60, 0] y_mm: [0, 0, 80] } mass_g: 30 friction: 0.6 y_mm: -300 }";
  const RunPlan plan = make_plan(text, {{-1500, 1500, 0}});
  Swarm swarm(plan);
  constexpr int kTicks = 30;
  const auto start = swarm.movables();
  swarm.run(kTicks);
  auto now = swarm.movables();
  const double tilt = 25 * kPi / 180, time_s = kTicks * 0.032768;
  const double way_mm = 9806.65 * (std::sin(tilt) - 0.2 * std::cos(tilt)) * time_s * (time_s + 0.032768 / 4) / 2;
  EXPECT_NEAR((now[0].x_mm - start[0].x_mm) / way_mm, 1, 0.02);
  EXPECT_NEAR((now[1].x_mm - start[1].x_mm) / way_mm, 1, 0.02);
  EXPECT_NEAR(now[2].x_mm, start[2].x_mm, 0.05);
  swarm.run(60);
  now = swarm.movables();
  EXPECT_NEAR(now[0].x_mm, 1970, 0.5);
  EXPECT_NEAR(now[1].x_mm, 1970, 0.5);
}

TEST(OdeBox, PartitionsAndCheckpointsKeepTheBits) {
  // Five robots push a box across the border of two partitions; no group is cut.
  const std::string box =
      "arena { width_mm: 1000 height_mm: 1000 } movable { box { width_mm: 100 length_mm: 300 } mass_g: 18 } ";
  const auto robots = pushers(5, false, -50);
  const RunPlan whole = make_plan(kOde + box, robots), cut = make_plan(kOde + box, robots, 4, 2);
  Swarm a(whole), b(cut), c(cut);
  for (Swarm* s : {&a, &b, &c}) s->set_all_motors(70, 70);
  for (int k = 0; k < 200; ++k) {
    a.step();
    b.step();
    ASSERT_EQ(a.hash(), b.hash()) << k;
  }
  EXPECT_GT(a.movables()[0].x_mm, 20);
  c.load(a.tick(), a.save());
  ASSERT_EQ(a.hash(), c.hash());
  for (int k = 0; k < 50; ++k) {
    a.step();
    c.step();
    ASSERT_EQ(a.hash(), c.hash()) << k;
  }
}

}  // namespace
}  // namespace kilotwin
