// Pushing: friction thresholds, chains, moments, symmetry, walls; and movable bodies over partitions.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>

#include "idl/experiment.pb.h"
#include "tests/services/physics/swarm.hpp"

namespace kilotwin {
namespace {

using testing::make_plan;
using testing::ScenePose;
using testing::Swarm;

using testing::kTick_s;
constexpr std::int64_t k40_s = 1221;
using testing::kQuiet;
const std::string kBox = "movable { box { width_mm: 100 length_mm: 100 } mass_g: 18 x_mm: 50 } ";
const std::string kWide = "movable { box { width_mm: 100 length_mm: 300 } mass_g: 18 x_mm: 50 } ";

/// k robots in columns of 33.2 mm pitch, at most 3 side by side, 1 mm from the face at x = 0.
std::vector<ScenePose> columns(int k) {
  std::vector<ScenePose> poses;
  for (int first = 0, row = 0; first < k; first += 3, ++row) {
    const int abreast = std::min(3, k - first);
    for (int i = 0; i < abreast; ++i) poses.push_back({-17.5 - 33.5 * row, (i - (abreast - 1) / 2.0) * 33.2, 0});
  }
  return poses;
}
std::vector<ScenePose> abreast(int k) {
  std::vector<ScenePose> poses;
  for (int i = 0; i < k; ++i) poses.push_back({-17.5, (i - (k - 1) / 2.0) * 36, 0});
  return poses;
}

struct Shift {
  double x_mm, y_mm, turn_rad, creep_mm;  ///< creep: displacement in the second half
};
Shift shift_of_box(const std::string& text, const std::vector<ScenePose>& poses, std::int64_t ticks = k40_s) {
  const RunPlan plan = make_plan(kQuiet + text, poses);
  Swarm swarm(plan);
  swarm.set_all_motors(70, 70);
  const auto start = swarm.movables()[0];
  swarm.run(ticks / 2);
  const auto middle = swarm.movables()[0];
  swarm.run(ticks - ticks / 2);
  const auto end = swarm.movables()[0];
  return {end.x_mm - start.x_mm, end.y_mm - start.y_mm, end.heading_rad - start.heading_rad,
          std::hypot(end.x_mm - middle.x_mm, end.y_mm - middle.y_mm)};
}

class Robots : public ::testing::TestWithParam<int> {};

TEST_P(Robots, FourDoNotMoveTheBoxOf18GramsAndFiveDriveIt) {
  const int k = GetParam();
  for (const bool in_columns : {false, true}) {
    const Shift s = shift_of_box(in_columns ? kBox : kWide, in_columns ? columns(k) : abreast(k));
    std::printf("%d robots %s: %.4f mm, creep %.3g mm, turn %.2g rad\n", k, in_columns ? "in columns" : "abreast",
                s.x_mm, s.creep_mm, s.turn_rad);
    if (k <= 4) {
      EXPECT_GE(s.x_mm, 0);
      EXPECT_LT(s.x_mm, 2);
      EXPECT_EQ(s.creep_mm, 0);
    } else {
      EXPECT_GT(s.x_mm, 0.95 * 10 * 40);
    }
    EXPECT_NEAR(s.y_mm, 0, 1e-6);
  }
}

INSTANTIATE_TEST_SUITE_P(Push, Robots, ::testing::Values(1, 2, 3, 4, 5, 6));

TEST(Push, OpposedPushesCancel) {
  const RunPlan plan = make_plan(kQuiet + "movable { box { width_mm: 100 length_mm: 300 } mass_g: 18 }", [] {
    std::vector<ScenePose> poses;
    for (int i = 0; i < 6; ++i) {
      poses.push_back({-67.5, (i - 2.5) * 36, 0});
      poses.push_back({67.5, (i - 2.5) * 36, -kPi});
    }
    return poses;
  }());
  Swarm swarm(plan);
  swarm.set_all_motors(70, 70);
  swarm.run(k40_s);
  const ScenePose box = swarm.movables()[0];
  EXPECT_NEAR(box.x_mm, 0, 1e-9);
  EXPECT_NEAR(box.y_mm, 0, 1e-9);
  EXPECT_NEAR(box.heading_rad, 0, 1e-9);
}

TEST(Push, AColumnOfTenAddsUpItsThrusts) {
  std::vector<ScenePose> column;
  for (int i = 0; i < 10; ++i) column.push_back({-17.5 - 33.5 * i, 0, 0});
  // Friction of 9.5 and of 10.5 thrusts.
  const auto box = [](double thrusts) {
    return "movable { box { width_mm: 100 length_mm: 100 } x_mm: 50 mass_g: " +
           std::to_string(thrusts * 0.01177 / (0.3 * 9.80665) * 1000) + " } ";
  };
  const Shift light = shift_of_box(box(9.5), column), heavy = shift_of_box(box(10.5), column);
  std::printf("column of ten: %.3f mm below its thrust, %.4f mm above\n", light.x_mm, heavy.x_mm);
  EXPECT_GT(light.x_mm, 0.85 * 400);
  EXPECT_LT(heavy.x_mm, 2);
  EXPECT_EQ(heavy.creep_mm, 0);
}

TEST(Push, ARestingRobotYieldsToMoreThanItsFriction) {
  // Friction of 0.8 and of 1.2 thrusts: thrust / (mass g) is 0.12.
  for (const double thrusts : {0.8, 1.2}) {
    const RunPlan plan =
        make_plan(kQuiet + "physics { rim_friction: 0 robot_friction: " + std::to_string(thrusts * 0.12002) + " }",
                  {{0, 0, 0}, {40, 0, 1}});
    Swarm swarm(plan);
    swarm.set_motors(0, 70, 70);
    swarm.run(300);
    const double before_mm = swarm.poses()[1].x_mm;
    swarm.run(100);
    const double speed_mm_s = (swarm.poses()[1].x_mm - before_mm) / (100 * kTick_s);
    EXPECT_NEAR(speed_mm_s, thrusts < 1 ? 10 : 0, thrusts < 1 ? 1e-3 : 0);
    EXPECT_EQ(swarm.poses()[1].heading_rad, 1);
  }
}

TEST(Push, AnOffCentrePushTurnsTheBox) {
  // Far from the centre, the moment decides. Friction holds |f|^2 + (M / rho)^2 <= (mu m g)^2. So F moves the box if
  // F sqrt(1 + (d / rho)^2) > mu m g. For a square of 100 mm, rho is 38.26 mm.
  const double rho_mm = 100 * (std::sqrt(2.0) + std::log(1 + std::sqrt(2.0))) / 6, offset_mm = 40;
  const double ratio = std::sqrt(1 + std::pow(offset_mm / rho_mm, 2));
  for (const double part : {0.95, 1.05}) {
    const std::string text = "movable { box { width_mm: 100 length_mm: 100 } x_mm: 50 mass_g: " +
                             std::to_string(ratio / part * 0.01177 / (0.3 * 9.80665) * 1000) + " } ";
    const Shift s = shift_of_box(text, {{-17.5, offset_mm, 0}}, 300);
    if (part < 1) {
      EXPECT_NEAR(s.turn_rad, 0, 0.02);  // caused by the impact
      EXPECT_EQ(s.creep_mm, 0);
    } else {
      EXPECT_LT(s.turn_rad, -0.05);  // Clockwise: pushed along x on the side of positive y.
    }
  }
}

TEST(Push, MirroredPushesMirror) {
  std::vector<ScenePose> poses = testing::random_crowd(30, 250, 250, 34, 5), mirrored;
  for (ScenePose& p : poses) p.x_mm -= 250;
  for (const ScenePose& p : poses) mirrored.push_back({p.x_mm, -p.y_mm, -p.heading_rad});
  const std::string text =
      kQuiet + "movable { polygon { x_mm: [0, 80, 60] y_mm: [0, 10, 70] } mass_g: 4 x_mm: -60 y_mm: -30 }";
  const std::string other =
      kQuiet + "movable { polygon { x_mm: [0, 80, 60] y_mm: [0, -10, -70] } mass_g: 4 x_mm: -60 y_mm: 30 }";
  const RunPlan a = make_plan(text, poses), b = make_plan(other, mirrored);
  Swarm first(a), second(b);
  first.set_all_motors(70, 70);
  second.set_all_motors(70, 70);
  first.run(600);
  second.run(600);
  const ScenePose p = first.movables()[0], q = second.movables()[0];
  EXPECT_GT(std::hypot(p.x_mm - a.world.movables[0].pose.x_mm, p.y_mm - a.world.movables[0].pose.y_mm), 0.5);
  EXPECT_NEAR(p.x_mm, q.x_mm, 1e-6);
  EXPECT_NEAR(p.y_mm, -q.y_mm, 1e-6);
  EXPECT_NEAR(p.heading_rad, -q.heading_rad, 1e-8);
}

TEST(Push, ForcesPassThroughARowOfBoxes) {
  // Two boxes with a friction of 4.5 thrusts each, 5 mm apart: eight robots push the first one against the second, which holds;
  // ten move both. The second part has a lighter box between them, and a cylinder at the end.
  const std::string two =
      "movable { box { width_mm: 60 length_mm: 400 } mass_g: 18 x_mm: 30 } "
      "movable { box { width_mm: 60 length_mm: 400 } mass_g: 18 x_mm: 95 } ";
  const std::string three =
      "movable { box { width_mm: 40 length_mm: 400 } mass_g: 18 x_mm: 20 } "
      "movable { box { width_mm: 40 length_mm: 400 } mass_g: 2 x_mm: 65 } "
      "movable { cylinder { radius_mm: 50 } mass_g: 16 x_mm: 140 } ";
  for (const std::string& row : {two, three}) {
    for (const int k : {8, 10}) {
      const RunPlan plan = make_plan(kQuiet + row, abreast(k));
      Swarm swarm(plan);
      const auto start = swarm.movables();
      swarm.set_all_motors(70, 70);
      swarm.run(k40_s / 2);
      const auto middle = swarm.movables();
      swarm.run(k40_s - k40_s / 2);
      const auto end = swarm.movables();
      std::printf("%d robots against %zu bodies in a row: %.3f mm, the last %.3f mm\n", k, end.size(),
                  end[0].x_mm - start[0].x_mm, end.back().x_mm - start.back().x_mm);
      for (std::size_t m = 0; m < end.size(); ++m) {
        if (k == 8) {
          // The remaining creep of a light body between heavy ones is the solver's error.
          EXPECT_NEAR(end[m].x_mm, middle[m].x_mm, row == two ? 0 : 1e-3) << "it creeps";
          EXPECT_LT(end[m].x_mm - start[m].x_mm, 15);
        } else {
          EXPECT_GT(end[m].x_mm - start[m].x_mm, 380);
        }
        if (m > 0 && row == two) {
          EXPECT_GE(end[m].x_mm - end[m - 1].x_mm, 60 - 1e-6);
        }
      }
    }
  }
}

/// Random robots, movable bodies of each shape, obstacles and beacons.
std::string mixed_world(const std::string& arena) {
  return "arena { " + arena +
         " } robots { count: 70 } robots { count: 3 immobile: true } "
         "movable { box { width_mm: 120 length_mm: 60 } mass_g: 6 heading_deg: 20 } "
         "movable { cylinder { radius_mm: 30 } mass_g: 3 x_mm: 130 y_mm: 20 } "
         "movable { polygon { x_mm: [0, 80, 40] y_mm: [0, 0, 60] } mass_g: 3 x_mm: -180 y_mm: 60 } "
         "obstacle { box { width_mm: 60 length_mm: 60 } x_mm: 30 y_mm: -150 heading_deg: 45 } "
         "obstacle { cylinder { radius_mm: 25 } x_mm: 30 y_mm: 160 } ";
}
std::vector<ScenePose> mixed_robots(const std::string& text, std::uint64_t seed) {
  // Candidates are accepted in order if they overlap no body.
  proto::Experiment experiment;
  const RunPlan world =
      make_plan("robots { count: 1 } " + text.substr(0, text.find("robots")) + text.substr(text.find("movable")),
                {{0, 0, 0}});
  std::vector<ScenePose> poses;
  for (const ScenePose& p : testing::random_crowd(160, 540, 540, 33.5, seed)) {
    bool free = world.world.arena.clearance_mm({p.x_mm, p.y_mm}) > 17;
    for (const MovableBodyModel& m : world.world.movables)
      free =
          free &&
          m.shape.nearest(Place::at(m.pose.x_mm, m.pose.y_mm, m.pose.heading_rad), {p.x_mm, p.y_mm}).distance_mm >
              17;
    for (const ObstacleBody& o : world.world.obstacles)
      free = free && o.shape.nearest(o.place, {p.x_mm, p.y_mm}).distance_mm > 17;
    if (free && poses.size() < 73) poses.push_back(p);
  }
  return poses;
}

class Mixed : public ::testing::TestWithParam<const char*> {};

TEST_P(Mixed, NothingOverlapsOrTunnelsAndAllPartitionsAgree) {
  const std::string text = mixed_world(GetParam());
  for (const std::uint64_t seed : {3u, 8u}) {
    const std::vector<ScenePose> poses = mixed_robots(text, seed);
    ASSERT_EQ(poses.size(), 73u);
    std::vector<RunPlan> plans;
    for (const auto& [columns, rows] : {std::pair{1u, 1u}, {2u, 1u}, {3u, 3u}, {5u, 2u}})
      plans.push_back(make_plan(text, poses, columns, rows));
    std::vector<std::unique_ptr<Swarm>> swarms;
    for (const RunPlan& plan : plans) swarms.push_back(std::make_unique<Swarm>(plan));
    std::mt19937 random(static_cast<unsigned>(seed));
    double deepest_mm = 0;
    for (int k = 0; k < 360; ++k) {
      if (k % 60 == 0) {
        for (std::uint32_t r = 0; r < 73; ++r) {
          const auto motion = random() % 4;
          for (auto& swarm : swarms)
            swarm->set_motors(r,
                              motion == 0   ? 0
                              : motion == 1 ? 70
                                            : 255,
                              motion == 0   ? 0
                              : motion == 3 ? 70
                                            : 255);
        }
      }
      for (auto& swarm : swarms) swarm->step();
      for (std::size_t s = 1; s < swarms.size(); ++s)
        ASSERT_EQ(swarms[s]->hash(), swarms[0]->hash()) << s << " at " << k;
      const auto now = swarms[0]->poses();
      const auto bodies = swarms[0]->movables();
      const World& world = plans[0].world;
      deepest_mm = std::max(deepest_mm, largest_overlap_mm(now));
      for (std::size_t m = 0; m < bodies.size(); ++m) {
        const Convex& shape = world.movables[m].shape;
        const Place place = Place::at(bodies[m].x_mm, bodies[m].y_mm, bodies[m].heading_rad);
        deepest_mm = std::max(deepest_mm, -world.arena.clearance_mm(shape, place));
        for (const ScenePose& p : now)
          deepest_mm = std::max(deepest_mm, kRobotRadius_mm - shape.nearest(place, {p.x_mm, p.y_mm}).distance_mm);
        for (const ObstacleBody& o : world.obstacles)
          deepest_mm = std::max(deepest_mm, -separation_mm(shape, place, o.shape, o.place));
        for (std::size_t other = 0; other < m; ++other) {
          const Place at = Place::at(bodies[other].x_mm, bodies[other].y_mm, bodies[other].heading_rad);
          deepest_mm = std::max(deepest_mm, -separation_mm(shape, place, world.movables[other].shape, at));
        }
      }
      for (const ScenePose& p : now) {
        deepest_mm = std::max(deepest_mm, kRobotRadius_mm - world.arena.clearance_mm({p.x_mm, p.y_mm}));
        for (const ObstacleBody& o : world.obstacles)
          deepest_mm =
              std::max(deepest_mm, kRobotRadius_mm - o.shape.nearest(o.place, {p.x_mm, p.y_mm}).distance_mm);
      }
      ASSERT_LT(deepest_mm, 0.1) << "at " << k;
    }
    std::printf("deepest overlap %.3g mm\n", deepest_mm);
    const auto now = swarms[0]->poses();
    for (std::size_t r = 70; r < 73; ++r) {
      EXPECT_EQ(now[r].x_mm, poses[r].x_mm);
      EXPECT_EQ(now[r].y_mm, poses[r].y_mm);
    }
    bool moved = false;
    for (std::size_t m = 0; m < 3; ++m) {
      const Pose& start = plans[0].world.movables[m].pose;
      moved |=
          std::hypot(swarms[0]->movables()[m].x_mm - start.x_mm, swarms[0]->movables()[m].y_mm - start.y_mm) > 3;
    }
    EXPECT_TRUE(moved);
    // The state of nine partitions continues unchanged on one and on two.
    const auto saved = swarms[2]->save();
    for (auto& swarm : swarms) swarm->load(swarm->tick(), saved);
    for (int k = 0; k < 50; ++k) {
      for (auto& swarm : swarms) swarm->step();
      for (std::size_t s = 1; s < swarms.size(); ++s)
        ASSERT_EQ(swarms[s]->hash(), swarms[0]->hash()) << s << " after load, at " << k;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    Arenas, Mixed,
    ::testing::Values("width_mm: 600 height_mm: 600", "circle { radius_mm: 330 }",
                      "polygon { x_mm: [-300, 300, 320, 0, -320] y_mm: [-300, -300, 200, 330, 200] }"));

TEST(Push, TheTightestPackingDrivenToTheCentreForAMinute) {
  std::vector<ScenePose> poses;
  for (int row = 0; poses.size() < 1000; ++row) {
    for (int column = 0; column < 32 && poses.size() < 1000; ++column) {
      const double x = (column - 15.5 + (row % 2) * 0.5) * 33, y = (row - 15.5) * 33 * std::sqrt(3.0) / 2;
      poses.push_back({x, y, std::atan2(-y, -x)});
    }
  }
  const RunPlan plan = make_plan("", poses);
  Swarm swarm(plan);
  swarm.set_all_motors(70, 70);
  swarm.run(1831);
  const auto now = swarm.poses();
  std::vector<double> overlaps;
  for (std::size_t i = 0; i < now.size(); ++i) {
    for (std::size_t j = i + 1; j < now.size(); ++j) {
      const double distance_mm = std::hypot(now[i].x_mm - now[j].x_mm, now[i].y_mm - now[j].y_mm);
      if (distance_mm < 34) overlaps.push_back(std::max(0.0, 33 - distance_mm));
    }
  }
  std::sort(overlaps.begin(), overlaps.end());
  std::printf("tightest packing inwards: overlap %.3g mm at most, %.3g mm at the 99th percentile of %zu contacts\n",
              overlaps.back(), overlaps[overlaps.size() * 99 / 100], overlaps.size());
  EXPECT_GT(overlaps.size(), 800u);  // Biases dissolve the lattice; the crowd stays dense.
  EXPECT_LT(overlaps.back(), 1e-6);
}

TEST(Push, ACrowdAgainstAWallComesToRest) {
  std::vector<ScenePose> poses;
  for (int i = 0; i < 25; ++i) poses.push_back({i % 5 * 34.0, (i / 5 - 2) * 34.0, 0});
  const RunPlan plan = make_plan(kQuiet + "arena { width_mm: 400 height_mm: 200 }", poses);
  Swarm swarm(plan);
  swarm.set_all_motors(70, 70);
  swarm.run(3000);
  const auto before = swarm.poses();
  swarm.run(300);
  const auto after = swarm.poses();
  double farthest_mm = 0;
  for (std::size_t r = 0; r < after.size(); ++r)
    farthest_mm = std::max(farthest_mm, std::hypot(after[r].x_mm - before[r].x_mm, after[r].y_mm - before[r].y_mm));
  std::printf("crowd against a wall: %.3g mm in 10 s\n", farthest_mm);
  EXPECT_LT(farthest_mm, 1e-3);
}

}  // namespace
}  // namespace kilotwin
