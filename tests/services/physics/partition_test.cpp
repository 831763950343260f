// Results do not depend on the partition grid, on the number of hosts, or on a checkpoint.
#include <gtest/gtest.h>

#include <cmath>

#include "core/base/error.hpp"
#include "idl/checkpoint.pb.h"
#include "services/physics/planar_engine.hpp"
#include "tests/services/physics/swarm.hpp"

namespace kilotwin {
namespace {

using testing::make_plan;
using testing::ScenePose;
using testing::Swarm;

struct Grid {
  std::uint32_t columns, rows;
};
constexpr Grid kGrids[] = {{2, 1}, {1, 2}, {2, 2}, {3, 2}, {5, 1}, {4, 4}, {9, 7}};

void expect_same(const Swarm& a, const Swarm& b) {
  const auto p = a.poses(), q = b.poses();
  for (std::size_t r = 0; r < p.size(); ++r) {
    ASSERT_EQ(p[r].x_mm, q[r].x_mm) << "robot " << r;
    ASSERT_EQ(p[r].y_mm, q[r].y_mm) << "robot " << r;
    ASSERT_EQ(p[r].heading_rad, q[r].heading_rad) << "robot " << r;
  }
  ASSERT_EQ(a.hash(), b.hash());
}

struct Case {
  std::uint64_t seed;
  std::uint32_t robots;
  double side_mm, spacing_mm;
  std::uint32_t sub_steps;
};

class Partitions : public ::testing::TestWithParam<Case> {};

TEST_P(Partitions, AnyGridGivesTheSameBits) {
  const Case c = GetParam();
  // The spacing may be less than a diameter: overlaps must separate in the same way, too.
  const auto crowd = testing::random_crowd(c.robots, c.side_mm - 34, c.side_mm - 34, c.spacing_mm, c.seed);
  const std::string text = "seed: " + std::to_string(c.seed) + " arena { width_mm: " + std::to_string(c.side_mm) +
                           " height_mm: " + std::to_string(c.side_mm) +
                           " } physics { sub_steps: " + std::to_string(c.sub_steps) +
                           " } motion { factor_variance_s: 0.0001 }";
  for (const Grid grid : kGrids) {
    const RunPlan whole = make_plan(text, crowd),
                  cut = make_plan(text, crowd, grid.columns, grid.rows, grid.columns);
    Swarm a(whole), b(cut);
    for (std::uint32_t k = 0; k < 300; ++k) {
      drive(a, c.robots, k);
      drive(b, c.robots, k);
      a.step();
      b.step();
      ASSERT_EQ(a.hash(), b.hash()) << grid.columns << "x" << grid.rows << " tick " << k;
    }
    expect_same(a, b);
  }
}

INSTANTIATE_TEST_SUITE_P(RandomCrowds, Partitions,
                         ::testing::Values(Case{1, 150, 600, 33, 4}, Case{2, 200, 640, 33, 4},
                                           Case{3, 80, 600, 33, 3}, Case{4, 150, 600, 33, 2},
                                           Case{5, 150, 600, 33, 1}, Case{6, 120, 500, 20, 4},
                                           Case{7, 60, 300, 28, 4}));

TEST(Partition, ATightGridDrivenInwardsGivesTheSameBits) {
  const auto crowd = testing::grid_crowd(400, 33, testing::Facing::kInwards);
  const std::string text = "arena { width_mm: 800 height_mm: 800 }";
  const RunPlan whole = make_plan(text, crowd), cut = make_plan(text, crowd, 6, 5);
  Swarm a(whole), b(cut);
  a.set_all_motors(70, 70);
  b.set_all_motors(70, 70);
  for (int k = 0; k < 200; ++k) {
    a.step();
    b.step();
    ASSERT_EQ(a.hash(), b.hash()) << k;
  }
}

TEST(Partition, PartitionsSmallerThanTheMarginExchangeBeyondTheirNeighbours) {
  const std::string text = "arena { width_mm: 600 height_mm: 600 }";
  const RunPlan plan = make_plan(text, {{0, 0, 0}}, 12, 1);
  EXPECT_GT(physics::ghost_margin_mm(plan), 2 * 50);
  const physics::PlanarEngine engine(plan, PartitionId{5});
  EXPECT_EQ(engine.neighbours(), plan.grid.neighbours(PartitionId{5}, physics::ghost_margin_mm(plan)));
  EXPECT_GT(engine.neighbours().size(), 4u);
}

TEST(Partition, ARobotIsHandedOverAndBack) {
  const std::string text = "motion { noise: false }";
  const std::vector<ScenePose> start = {{-1, 0, 0}, {500, 500, 0}};
  const RunPlan whole = make_plan(text, start), cut = make_plan(text, start, 2, 1);
  Swarm a(whole), b(cut);
  std::vector<std::uint32_t> by;
  static_cast<void>(b.poses(&by));
  EXPECT_EQ(by[0], 0u);
  int changes = 0;
  for (int k = 0; k < 1200; ++k) {
    // It drives in circles across the border.
    for (Swarm* s : {&a, &b}) {
      s->set_motors(0, 70, 0);
      s->step();
    }
    const std::uint32_t previous = by[0];
    const auto poses = b.poses(&by);
    changes += by[0] != previous;
    ASSERT_EQ(a.hash(), b.hash());
    EXPECT_EQ(by[1], 1u);
  }
  EXPECT_GE(changes, 8);
}

TEST(Partition, TheOldOwnerListsARobotInTheTickInWhichItLeaves) {
  const RunPlan plan = make_plan("motion { noise: false }", {{-0.1, 0, 0}}, 2, 1);
  Swarm swarm(plan);
  swarm.set_all_motors(70, 70);
  swarm.step();
  std::vector<std::uint32_t> by;
  EXPECT_GT(swarm.poses(&by)[0].x_mm, 0);
  EXPECT_EQ(by[0], 0u);
  swarm.step();
  static_cast<void>(swarm.poses(&by));
  EXPECT_EQ(by[0], 1u);
}

TEST(Partition, RobotsExactlyOnBordersHaveOneOwner) {
  // Borders at x = 0, and at y = 0: half-open rectangles.
  const std::vector<ScenePose> start = {
      {0, 0, 0}, {0, 100, kPi}, {-100, 0, -kPi / 2}, {0, -100, kPi / 2}, {100, 0, 1}};
  const RunPlan whole = make_plan("", start), cut = make_plan("", start, 2, 2);
  Swarm a(whole), b(cut);
  std::vector<std::uint32_t> by;
  static_cast<void>(b.poses(&by));
  EXPECT_EQ(by, (std::vector<std::uint32_t>{3, 3, 2, 1, 3}));
  a.set_all_motors(70, 70);
  b.set_all_motors(70, 70);
  for (int k = 0; k < 400; ++k) {
    a.step();
    b.step();
    ASSERT_EQ(a.hash(), b.hash());
    ASSERT_NO_THROW(static_cast<void>(b.poses()));
  }
}

TEST(Partition, SavedOnManyPartitionsContinuesOnOthers) {
  const auto crowd = testing::random_crowd(150, 560, 560, 33, 21);
  const std::string text = "arena { width_mm: 600 height_mm: 600 }";
  const RunPlan four = make_plan(text, crowd, 2, 2), one = make_plan(text, crowd),
                six = make_plan(text, crowd, 3, 2);
  Swarm a(four), b(one), c(six);
  std::uint32_t k = 0;
  for (; k < 157; ++k) {
    drive(a, 150, k);
    a.step();
  }
  b.load(a.tick(), a.save());
  c.load(a.tick(), a.save());
  expect_same(a, b);
  expect_same(a, c);
  for (; k < 300; ++k) {
    for (Swarm* s : {&a, &b, &c}) {
      drive(*s, 150, k);
      s->step();
    }
    ASSERT_EQ(a.hash(), b.hash());
    ASSERT_EQ(a.hash(), c.hash());
  }
  expect_same(a, c);
}

TEST(Partition, DamagedCheckpointsAreRefused) {
  const RunPlan plan = make_plan("", {{0, 0, 0}, {50, 0, 0}});
  Swarm swarm(plan);
  auto parts = swarm.save();
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

TEST(Partition, TrackedRobotsJumpBetweenPartitions) {
  const std::string text =
      "arena { width_mm: 1000 height_mm: 1000 } robots { count: 60 } robots { count: 2 body: TRACKED }";
  auto crowd = testing::random_crowd(62, 500, 500, 34, 8);
  crowd[60] = {480, 480, 0};
  crowd[61] = {-480, 480, 0};
  const RunPlan whole = make_plan(text, crowd), cut = make_plan(text, crowd, 4, 3);
  Swarm a(whole), b(cut);
  std::vector<std::uint32_t> by;
  for (std::uint32_t k = 0; k < 300; ++k) {
    std::vector<testing::TrackedPlace> tracked;
    if (k % 50 == 20) tracked.push_back({60, k % 100 == 20 ? -200.0 : 230.0, 30.0 - k / 10.0, 0.25});
    if (k % 7 == 0) tracked.push_back({61, -480.0 + 2.5 * k, 20, -0.5});
    for (Swarm* s : {&a, &b}) {
      drive(*s, 62, k);
      s->step(tracked);
    }
    ASSERT_EQ(a.hash(), b.hash()) << k;
    const auto poses = b.poses(&by);
    for (const testing::TrackedPlace& t : tracked) {
      EXPECT_EQ(poses[t.robot].x_mm, t.x_mm);
      EXPECT_EQ(by[t.robot], cut.grid.owner(t.x_mm, t.y_mm).value());
    }
  }
  // A checkpoint carries them as well.
  Swarm c(whole);
  c.load(b.tick(), b.save());
  expect_same(b, c);
  for (std::uint32_t k = 300; k < 350; ++k) {
    for (Swarm* s : {&b, &c}) {
      drive(*s, 62, k);
      s->step();
    }
    ASSERT_EQ(b.hash(), c.hash());
  }
}

/// Robots that leave and join again, alike for every grid; a checkpoint knows who is absent.
TEST(Partition, AbsentRobotsHaveNoBodyOnAnyGrid) {
  const std::string text =
      "arena { width_mm: 1000 height_mm: 1000 } robots { count: 60 } robots { count: 2 body: TRACKED }";
  auto crowd = testing::random_crowd(62, 500, 500, 34, 8);
  const RunPlan whole = make_plan(text, crowd), cut = make_plan(text, crowd, 4, 3);
  Swarm a(whole), b(cut);
  for (std::uint32_t k = 0; k < 300; ++k) {
    const std::vector<testing::TrackedPlace> tracked{{60, 3.0 * (k % 90) - 120, 0.5 * k - 70, 0.25}};
    std::vector<MembershipChange> memberships;
    if (k % 60 == 10) memberships.push_back({60, Membership::kLost});
    if (k % 60 == 40) memberships.push_back({60, Membership::kJoined});
    if (k == 100) memberships.push_back({61, Membership::kLeft});
    for (Swarm* s : {&a, &b}) {
      drive(*s, 62, k);
      s->step(tracked, memberships);
    }
    ASSERT_EQ(a.hash(), b.hash()) << k;
    if (k % 60 != 25) continue;
    Swarm c(whole);
    c.load(b.tick(), b.save());
    expect_same(b, c);
    Swarm d(cut);
    d.load(a.tick(), a.save());
    drive(c, 62, k + 1);
    drive(d, 62, k + 1);
    c.step(tracked);
    d.step(tracked);
    ASSERT_EQ(c.hash(), d.hash()) << k;
  }
}

TEST(Partition, OnlyPresentRobotsBlockTheWay) {
  const std::string text = "robots { count: 1 } robots { count: 1 body: TRACKED } motion { noise: false }";
  const RunPlan plan = make_plan(text, {{0, 0, 0}, {60, 0, 0}});
  for (const bool present : {true, false}) {
    Swarm swarm(plan);
    swarm.set_motors(0, 255, 255);
    swarm.step({}, {{1, present ? Membership::kJoined : Membership::kLost}});
    swarm.run(400);
    const double x_mm = swarm.poses()[0].x_mm;
    if (present) {
      EXPECT_LT(x_mm, 60 - 2 * kRobotRadius_mm + 1);
    } else {
      EXPECT_GT(x_mm, 100);
    }
    EXPECT_EQ(swarm.engine(0).bodies_without_space(), 0u);
    // One that joins on occupied ground is counted, and the simulated robot makes way.
    const double on_mm = swarm.poses()[0].x_mm + 10;
    swarm.set_motors(0, 0, 0);
    swarm.step({{1, on_mm, swarm.poses()[0].y_mm, 0}}, {{1, Membership::kJoined}});
    swarm.run(100);
    EXPECT_EQ(swarm.engine(0).bodies_without_space(), 1u);
    EXPECT_LT(swarm.poses()[0].x_mm, on_mm - 2 * kRobotRadius_mm + 1);
  }
}

TEST(Partition, GhostsAreExactlyTheRobotsWithinTheMargin) {
  const auto crowd = testing::random_crowd(100, 900, 900, 34, 4);
  const RunPlan plan = make_plan("", crowd, 2, 2);
  Swarm swarm(plan);
  const double margin_mm = physics::ghost_margin_mm(plan);
  for (std::uint32_t p = 0; p < 4; ++p) {
    BodyFrame all, ghosts;
    swarm.engine(p).emit_bodies(all);
    for (const PartitionId q : swarm.engine(p).neighbours()) {
      swarm.engine(p).emit_ghosts(q, ghosts);
      std::vector<std::uint32_t> expected;
      for (std::size_t i = 0; i < all.robot.size(); ++i) {
        if (plan.grid.rectangle(q).distance_mm(all.x_mm[i], all.y_mm[i]) <= margin_mm)
          expected.push_back(all.robot[i]);
      }
      EXPECT_EQ(ghosts.robot, expected);
      EXPECT_EQ(ghosts.tick, Tick{0});
    }
  }
}

}  // namespace
}  // namespace kilotwin
