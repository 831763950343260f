// Laws that every physics engine obeys. kEngines describes each engine by its capabilities; each law is tested on all engines to
// which it applies. A further engine needs one more line in kEngines.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <ostream>

#include "core/base/error.hpp"
#include "idl/checkpoint.pb.h"
#include "services/physics/drive.hpp"
#include "tests/services/physics/swarm.hpp"

namespace kilotwin {
namespace {

using testing::make_plan;
using testing::ScenePose;
using testing::Swarm;

using testing::kQuiet;
using testing::kTick_s;

struct Tested {
  const char* name;
  bool contact;               ///< robots do not pass through each other
  bool any_partitions;        ///< the same bits over partition grids
  double relative_tolerance;  ///< of speeds and turn rates relative to the drive's closed form
  double place_tolerance_mm;  ///< of positions and overlaps
  double balance_mm;          ///< largest drift in 10 s of two robots that push against each other with equal force
  double rest_gap_mm;         ///< largest gap between robots that rest against each other
};
void PrintTo(const Tested& engine, std::ostream* out) { *out << engine.name; }

constexpr Tested kEngines[] = {
    {"PLANAR", true, true, 1e-9, 1e-6, 1e-6, 0.35},
    {"KINEMATIC", false, true, 1e-9, 1e-6, 0, 0},
    {"ODE", true, false, 1e-3, 0.01, 1, 0.01},
};

class Conformance : public ::testing::TestWithParam<Tested> {
 protected:
  [[nodiscard]] static std::string physics() { return std::string(" physics { engine: ") + GetParam().name + " }"; }
  [[nodiscard]] static RunPlan plan(const std::string& text, const std::vector<ScenePose>& poses,
                                    std::uint32_t columns = 1, std::uint32_t rows = 1, std::uint32_t hosts = 1) {
    return make_plan(text + physics(), poses, columns, rows, hosts);
  }
  [[nodiscard]] static double tolerance_mm() { return GetParam().place_tolerance_mm; }
};

INSTANTIATE_TEST_SUITE_P(Engines, Conformance, ::testing::ValuesIn(kEngines),
                         [](const auto& tested) { return std::string(tested.param.name); });

double distance_mm(const ScenePose& a, const ScenePose& b) { return std::hypot(a.x_mm - b.x_mm, a.y_mm - b.y_mm); }

TEST_P(Conformance, StraightIsSixHundredMillimetresInAMinute) {
  const RunPlan p = plan(kQuiet, {{-300, 20, 0}});
  Swarm swarm(p);
  swarm.set_all_motors(70, 70);
  constexpr int kTicks = 1831;
  swarm.run(kTicks);
  const ScenePose end = swarm.poses()[0];
  EXPECT_NEAR((end.x_mm + 300) / (10 * kTick_s * kTicks), 1, std::max(1e-9, GetParam().relative_tolerance));
  EXPECT_NEAR(end.y_mm, 20, tolerance_mm());
  EXPECT_NEAR(end.heading_rad, 0, GetParam().relative_tolerance);
}

TEST_P(Conformance, AFullTurnTakesWheelBaseTimesTwoPiOverSpeed) {
  // One wheel at 20 mm/s around the other, 25 mm away: 2 pi 25 / 20 = 7.854 s. Both directions.
  for (const bool left : {true, false}) {
    const RunPlan p = plan(kQuiet, {{0, 0, 0}});
    Swarm swarm(p);
    swarm.set_all_motors(left ? 70 : 0, left ? 0 : 70);
    double turned_rad = 0, heading_rad = 0;
    constexpr int kTicks = 479;  // Two turns.
    for (int k = 0; k < kTicks; ++k) {
      swarm.step();
      const double now_rad = swarm.poses()[0].heading_rad;
      turned_rad += std::remainder(now_rad - heading_rad, 2 * kPi);
      heading_rad = now_rad;
    }
    const double turn_s = kTicks * kTick_s * 2 * kPi / std::abs(turned_rad);
    EXPECT_NEAR(turn_s / 7.853981633974483, 1, GetParam().relative_tolerance);
    EXPECT_EQ(turned_rad > 0, left);
    // It went round the opposite leg and returns to its start.
    EXPECT_NEAR(distance_mm(swarm.poses()[0], {0, 0, 0}), 0,
                17.0 * std::abs(std::abs(turned_rad) - 4 * kPi) + tolerance_mm());
  }
}

TEST_P(Conformance, BiasesActOnDrivenRobotsAlone) {
  const std::string text =
      "motion { bias_sd_mm_s: 0 bias_mean_mm_s: 0 } robot_model { robot: 0 bias_left_mm_s: 2 bias_right_mm_s: 2 } "
      "robot_model { robot: 1 bias_left_mm_s: 2 bias_right_mm_s: 2 } "
      "robot_model { robot: 2 bias_left_mm_s: -1 bias_right_mm_s: 1 }";
  const RunPlan p = plan(text, {{0, 0, 0}, {0, 200, 0}, {0, -200, 0}});
  Swarm swarm(p);
  swarm.set_motors(0, 70, 70);
  swarm.set_motors(2, 70, 70);
  constexpr int kTicks = 610;
  swarm.run(kTicks);
  const auto end = swarm.poses();
  EXPECT_NEAR(end[0].x_mm / (12 * kTick_s * kTicks), 1, GetParam().relative_tolerance);
  EXPECT_NEAR(distance_mm(end[1], {0, 200, 0}), 0, tolerance_mm());
  EXPECT_NEAR(std::remainder(end[2].heading_rad - 2.0 / 25 * kTick_s * kTicks, 2 * kPi), 0,
              GetParam().relative_tolerance * 10 + 1e-12);
}

TEST_P(Conformance, RobotsAtRestDoNotMove) {
  // Robots in contact, robots at walls, robots in no frame.
  auto crowd = testing::grid_crowd(36, 33, testing::Facing::kRandom);
  crowd.push_back({483.5, 0, 1});
  crowd.push_back({-483.5, -483.5, 2});
  const RunPlan p = plan("arena { width_mm: 1000 height_mm: 1000 }", crowd);
  Swarm swarm(p);
  swarm.run(300);
  const auto end = swarm.poses();
  for (std::size_t r = 0; r < crowd.size(); ++r) {
    EXPECT_NEAR(distance_mm(end[r], crowd[r]), 0, tolerance_mm()) << r;
    EXPECT_NEAR(std::remainder(end[r].heading_rad - crowd[r].heading_rad, 2 * kPi), 0, tolerance_mm()) << r;
  }
}

TEST_P(Conformance, RobotsInNoFrameRest) {
  const RunPlan p = plan(kQuiet, {{-200, 0, 0}, {200, 0, 0}});
  const auto engine = physics::make_engine(p, PartitionId{0});
  for (std::int64_t k = 0; k < 60; ++k) {
    const ActuationFrame second = testing::motors(Tick{k}, {70}, {70}, 1);
    const ActuationFrame* const frames[] = {&second};
    engine->step(Tick{k}, {{}, frames, {}});
  }
  BodyFrame end;
  engine->emit_bodies(end);
  EXPECT_NEAR(end.x_mm[0], -200, tolerance_mm());
  EXPECT_GT(end.x_mm[1], 215);
}

TEST_P(Conformance, NothingLeavesTheArena) {
  const auto crowd = testing::random_crowd(30, 260, 260, 33, 5);
  const RunPlan p = plan("arena { width_mm: 300 height_mm: 300 }", crowd, 3, 2);
  Swarm swarm(p);
  const double limit_mm = 150 - kRobotRadius_mm;
  for (std::uint32_t k = 0; k < 900; ++k) {
    drive(swarm, 30, k / 4);
    swarm.step();
    for (const ScenePose& pose : swarm.poses()) {
      ASSERT_LE(std::abs(pose.x_mm), limit_mm + tolerance_mm());
      ASSERT_LE(std::abs(pose.y_mm), limit_mm + tolerance_mm());
      ASSERT_TRUE(pose.heading_rad >= -kPi && pose.heading_rad < kPi);
    }
  }
}

TEST_P(Conformance, ARobotSlidesAlongAWall) {
  const RunPlan p = plan(kQuiet + " arena { width_mm: 600 height_mm: 600 }", {{0, 283.5, 0.3}});
  Swarm swarm(p);
  swarm.set_all_motors(70, 70);
  swarm.run(300);
  const ScenePose end = swarm.poses()[0];
  EXPECT_NEAR(end.y_mm, 283.5, tolerance_mm());
  EXPECT_GT(end.x_mm, 40);
}

TEST_P(Conformance, RobotsHeadOnDoNotPassEachOther) {
  const RunPlan p = plan(kQuiet, {{-40, 0, 0}, {40, 0, kPi}});
  Swarm swarm(p);
  swarm.set_all_motors(70, 70);
  swarm.run(300);
  const auto end = swarm.poses();
  if (!GetParam().contact) {
    EXPECT_NEAR(end[0].x_mm, 98.304 - 40, tolerance_mm());
    return;
  }
  EXPECT_NEAR(distance_mm(end[0], end[1]), 33, GetParam().rest_gap_mm);
  EXPECT_NEAR(end[0].x_mm, -16.5, GetParam().balance_mm + GetParam().rest_gap_mm / 2);
  EXPECT_NEAR(end[1].x_mm, 16.5, GetParam().balance_mm + GetParam().rest_gap_mm / 2);
}

TEST_P(Conformance, ACrowdDrivenInwardsDoesNotOverlap) {
  if (!GetParam().contact) GTEST_SKIP() << "no contact";
  const RunPlan p = plan(kQuiet, testing::grid_crowd(64, 36, testing::Facing::kInwards));
  Swarm swarm(p);
  swarm.set_all_motors(70, 70);
  for (int k = 0; k < 300; ++k) {
    swarm.step();
    ASSERT_LE(testing::largest_overlap_mm(swarm.poses()), std::min(0.1, 1e3 * tolerance_mm())) << k;
  }
}

TEST_P(Conformance, TrackedRobotsKeepTheTrackersPoses) {
  const std::string text = kQuiet + " robots { count: 2 } robots { count: 1 body: TRACKED }";
  const RunPlan p = plan(text, {{-60, 0, 0}, {300, 300, 0}, {0, 0, 0}}, 2, 2);
  Swarm swarm(p);
  swarm.set_motors(0, 70, 70);
  swarm.set_motors(2, 70, 70);
  std::vector<std::uint32_t> by;
  for (int k = 0; k < 200; ++k) {
    swarm.step();
    ASSERT_EQ(swarm.poses()[2].x_mm, 0);
  }
  if (GetParam().contact) {
    EXPECT_NEAR(swarm.poses()[0].x_mm, -33, GetParam().rest_gap_mm);
  }
  // The robot jumps, its heading exceeds a turn, and its partition changes.
  swarm.step({{2, 200, -150, 7}});
  const ScenePose jumped = swarm.poses(&by)[2];
  EXPECT_EQ(jumped.x_mm, 200);
  EXPECT_EQ(jumped.y_mm, -150);
  EXPECT_EQ(jumped.heading_rad, wrapped(7));
  EXPECT_EQ(by[2], p.grid.owner(200, -150).value());
  // The last pose of a robot within a tick counts.
  swarm.step({{2, 0, 0, 0}, {2, -200, 150, 1}});
  EXPECT_EQ(swarm.poses()[2].x_mm, -200);
}

TEST_P(Conformance, EachRobotIsListedOnceWhileItCrossesBorders) {
  const auto crowd = testing::random_crowd(80, 500, 500, 36, 11);
  const RunPlan p = plan("arena { width_mm: 600 height_mm: 600 }", crowd, 4, 3, 2);
  Swarm swarm(p);
  std::vector<std::uint32_t> by, previous;
  std::vector<ScenePose> before = swarm.poses(&previous);
  int handed_over = 0;
  for (std::uint32_t k = 0; k < 600; ++k) {
    drive(swarm, 80, k);
    swarm.step();
    const auto poses = swarm.poses(&by);  // Throws where one is listed twice or not at all.
    for (std::size_t r = 0; r < poses.size(); ++r) {
      ASSERT_EQ(by[r], p.grid.owner(before[r].x_mm, before[r].y_mm).value());
      handed_over += by[r] != previous[r];
    }
    before = poses;
    previous = by;
  }
  EXPECT_GT(handed_over, 20);
}

TEST_P(Conformance, GhostsAreTheRobotsWithinTheMargin) {
  const auto crowd = testing::random_crowd(100, 900, 900, 34, 4);
  const RunPlan p = plan("arena { width_mm: 1000 height_mm: 1000 }", crowd, 6, 4);
  Swarm swarm(p);
  const double margin_mm = physics::ghost_margin_mm(p);
  EXPECT_GT(margin_mm, 0);
  for (int k = 0; k < 40; ++k) {
    drive(swarm, 100, static_cast<std::uint32_t>(k));
    swarm.step();
  }
  for (std::uint32_t from = 0; from < p.grid.size(); ++from) {
    BodyFrame all, ghosts;
    swarm.engine(from).emit_bodies(all);
    EXPECT_EQ(swarm.engine(from).neighbours(), p.grid.neighbours(PartitionId{from}, margin_mm));
    for (const PartitionId to : swarm.engine(from).neighbours()) {
      swarm.engine(from).emit_ghosts(to, ghosts);
      std::vector<std::uint32_t> expected;
      for (std::size_t i = 0; i < all.robot.size(); ++i) {
        if (p.grid.rectangle(to).distance_mm(all.x_mm[i], all.y_mm[i]) <= margin_mm)
          expected.push_back(all.robot[i]);
      }
      EXPECT_EQ(ghosts.robot, expected);
    }
  }
}

TEST_P(Conformance, TheSameRunGivesTheSameBitsForAnyHosts) {
  const auto crowd = testing::random_crowd(100, 460, 460, 33, 9);
  const std::string text = "arena { width_mm: 500 height_mm: 500 } motion { factor_variance_s: 0.0001 }";
  const RunPlan one = plan(text, crowd, 2, 2, 1), five = plan(text, crowd, 2, 2, 5);
  Swarm a(one), b(five);
  for (std::uint32_t k = 0; k < 150; ++k) {
    for (Swarm* s : {&a, &b}) {
      drive(*s, 100, k);
      s->step();
    }
    ASSERT_EQ(a.hash(), b.hash()) << k;
  }
}

TEST_P(Conformance, TheSameRunGivesTheSameBitsForAnyPartitions) {
  if (!GetParam().any_partitions) GTEST_SKIP() << "not promised";
  const auto crowd = testing::random_crowd(100, 460, 460, 33, 9);
  const std::string text = "arena { width_mm: 500 height_mm: 500 } motion { factor_variance_s: 0.0001 }";
  const RunPlan whole = plan(text, crowd), cut = plan(text, crowd, 5, 4);
  Swarm a(whole), b(cut);
  for (std::uint32_t k = 0; k < 300; ++k) {
    for (Swarm* s : {&a, &b}) {
      drive(*s, 100, k);
      s->step();
    }
    ASSERT_EQ(a.hash(), b.hash()) << k;
  }
}

/// All frames that the swarms emit at the current tick, and their hash.
void expect_same_frames(Swarm& a, Swarm& b, std::uint32_t partitions) {
  ASSERT_EQ(a.hash(), b.hash());
  for (std::uint32_t p = 0; p < partitions; ++p) {
    BodyFrame of_a, of_b;
    for (const PartitionId q : a.engine(p).neighbours()) {
      a.engine(p).emit_ghosts(q, of_a);
      b.engine(p).emit_ghosts(q, of_b);
      ASSERT_EQ(of_a.robot, of_b.robot);
      ASSERT_EQ(of_a.x_mm, of_b.x_mm);
    }
    a.engine(p).emit_bodies(of_a);
    b.engine(p).emit_bodies(of_b);
    ASSERT_EQ(of_a.tick, of_b.tick);
    ASSERT_EQ(of_a.robot, of_b.robot);
    ASSERT_EQ(of_a.x_mm, of_b.x_mm);
    ASSERT_EQ(of_a.y_mm, of_b.y_mm);
    ASSERT_EQ(of_a.heading_rad, of_b.heading_rad);
  }
}

TEST_P(Conformance, ACheckpointContinuesWithTheSameBits) {
  const auto crowd = testing::random_crowd(100, 460, 460, 33, 21);
  const RunPlan p = plan("arena { width_mm: 500 height_mm: 500 }", crowd);
  Swarm a(p), b(p);
  std::uint32_t k = 0;
  for (const std::uint32_t until : {1u, 50u, 157u, 158u}) {
    for (; k < until; ++k) {
      drive(a, 100, k);
      a.step();
    }
    b.load(a.tick(), a.save());
    expect_same_frames(a, b, 1);
    for (; k < until + 20; ++k) {
      for (Swarm* s : {&a, &b}) {
        drive(*s, 100, k);
        s->step();
      }
      ASSERT_EQ(a.hash(), b.hash()) << k;
    }
  }
}

TEST_P(Conformance, SavedOnManyPartitionsContinuesOnOthers) {
  const auto crowd = testing::random_crowd(120, 560, 560, 34, 21);
  const std::string text = "arena { width_mm: 600 height_mm: 600 }";
  const RunPlan four = plan(text, crowd, 2, 2), one = plan(text, crowd), six = plan(text, crowd, 3, 2);
  Swarm a(four), b(one), c(six), d(six);
  std::uint32_t k = 0;
  for (; k < 157; ++k) {
    drive(a, 120, k);
    a.step();
  }
  for (Swarm* s : {&b, &c, &d}) s->load(a.tick(), a.save());
  EXPECT_EQ(a.hash(), b.hash());
  EXPECT_EQ(a.hash(), c.hash());
  expect_same_frames(c, d, 6);
  for (; k < 220; ++k) {
    for (Swarm* s : {&a, &b, &c, &d}) {
      drive(*s, 120, k);
      s->step();
    }
    ASSERT_EQ(c.hash(), d.hash());
    if (!GetParam().any_partitions) continue;
    ASSERT_EQ(a.hash(), b.hash());
    ASSERT_EQ(a.hash(), c.hash());
  }
}

TEST_P(Conformance, BeaconsDoNotMoveAndBlockRobots) {
  if (!GetParam().contact) GTEST_SKIP() << "no immobile robots";
  const RunPlan p =
      plan(kQuiet + " robots { count: 1 } robots { count: 1 immobile: true }", {{-60, 0, 0}, {0, 0, 1}}, 2, 1);
  Swarm swarm(p);
  swarm.set_all_motors(70, 70);
  swarm.run(200);
  const auto end = swarm.poses();
  EXPECT_EQ(end[1].x_mm, 0);
  EXPECT_EQ(end[1].y_mm, 0);
  EXPECT_LE(end[0].x_mm, -33 + tolerance_mm());
  EXPECT_GT(end[0].x_mm, -33.5);
}

TEST_P(Conformance, FiveRobotsDriveTheBoxOf18GramsAndFourDoNot) {
  if (!GetParam().contact) GTEST_SKIP() << "no movable bodies";
  const std::string box = " movable { box { width_mm: 100 length_mm: 300 } mass_g: 18 }";
  for (const int robots : {4, 5}) {
    std::vector<ScenePose> abreast;
    for (int i = 0; i < robots; ++i) abreast.push_back({-67.5, (i - (robots - 1) / 2.0) * 36, 0});
    const RunPlan p = plan(kQuiet + box, abreast, 2, 2);
    Swarm swarm(p);
    swarm.set_all_motors(70, 70);
    swarm.run(305);
    const double way_mm = swarm.movables()[0].x_mm;  // Throws if it is not listed exactly once.
    if (robots == 4) {
      EXPECT_LT(way_mm, 1);
    } else {
      EXPECT_NEAR(way_mm, 98.5, 2);
    }
  }
}

TEST_P(Conformance, MovableBodiesAreSavedOnManyPartitionsAndContinue) {
  if (!GetParam().contact) GTEST_SKIP() << "no movable bodies";
  const std::string bodies =
      kQuiet +
      " arena { width_mm: 600 height_mm: 600 } movable { box { width_mm: 60 length_mm: 80 } mass_g: 5 heading_deg: "
      "20 } "
      "movable { cylinder { radius_mm: 30 } mass_g: 5 x_mm: 100 } "
      "movable { polygon { x_mm: [0, 60, 0] y_mm: [0, 0, 80] } mass_g: 5 x_mm: -130 y_mm: 40 }";
  const std::vector<ScenePose> robots = {{-60, 0, 0},  {-150, 0, 0.5}, {100, -60, 1.5},
                                         {30, 80, -2}, {160, 20, kPi}, {0, -80, 1.6}};
  const RunPlan one = plan(bodies, robots), four = plan(bodies, robots, 2, 2);
  Swarm a(one), b(four), c(four);
  std::uint32_t k = 0;
  for (; k < 90; ++k) {
    for (Swarm* s : {&a, &b}) {
      drive(*s, 6, k);
      s->step();
    }
    // With few bodies, no engine cuts a group.
    ASSERT_EQ(a.hash(), b.hash()) << k;
  }
  EXPECT_GT(distance_mm(b.movables()[0], {0, 0, 0}), 1);
  c.load(a.tick(), a.save());
  expect_same_frames(b, c, 4);
  for (; k < 130; ++k) {
    for (Swarm* s : {&b, &c}) {
      drive(*s, 6, k);
      s->step();
    }
    ASSERT_EQ(b.hash(), c.hash()) << k;
  }
}

TEST_P(Conformance, DamagedCheckpointsAreRefused) {
  const RunPlan p = plan("", {{0, 0, 0}, {50, 0, 0}});
  Swarm swarm(p);
  const auto parts = swarm.save();
  const auto twice = std::vector<proto::PhysicsState>{parts[0], parts[0]};
  EXPECT_THROW(swarm.load(Tick{0}, twice), RunError);
  EXPECT_THROW(swarm.load(Tick{0}, {}), RunError);
  auto unknown = parts;
  unknown[0].set_robot(1, 7);
  EXPECT_THROW(swarm.load(Tick{0}, unknown), RunError);
  auto short_column = parts;
  short_column[0].mutable_y_mm()->RemoveLast();
  EXPECT_THROW(swarm.load(Tick{0}, short_column), RunError);
  EXPECT_NO_THROW(swarm.load(Tick{0}, parts));
}

}  // namespace
}  // namespace kilotwin
