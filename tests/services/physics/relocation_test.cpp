// Robots and movable bodies that are placed elsewhere, as by hand.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/services/physics/swarm.hpp"

namespace kilotwin {
namespace {

using testing::make_plan;
using testing::ScenePose;
using testing::Swarm;

class Relocations : public ::testing::TestWithParam<std::string> {
 protected:
  [[nodiscard]] static std::string experiment(const std::string& more = "") {
    return "arena { width_mm: 640 height_mm: 640 } physics { engine: " + GetParam() + " } duration_s: 30 " + more;
  }
};

TEST_P(Relocations, ARobotStandsWhereItWasPlacedAndDrivesOnFromThere) {
  const RunPlan here = make_plan(experiment("motion { noise: false }"), {{0, 0, 0}, {100, 100, 1}}),
                elsewhere = make_plan(experiment("motion { noise: false }"), {{-200, 50, 2}, {100, 100, 1}});
  Swarm moved(here), there(elsewhere);
  moved.set_all_motors(70, 70);
  for (int k = 0; k < 20; ++k) moved.step();
  moved.step({}, {}, {{false, 0, {-200, 50, 2}}});
  const ScenePose placed = moved.poses()[0];
  EXPECT_EQ(placed.x_mm, -200);
  EXPECT_EQ(placed.y_mm, 50);
  EXPECT_NEAR(placed.heading_rad, 2, 1e-12);
  there.set_all_motors(70, 70);
  for (int k = 0; k < 50; ++k) {
    moved.step();
    there.step();
  }
  // A robot that started there, at rest, is at the same place by now.
  EXPECT_NEAR(moved.poses()[0].x_mm, there.poses()[0].x_mm, 1e-9);
  EXPECT_NEAR(moved.poses()[0].y_mm, there.poses()[0].y_mm, 1e-9);
}

TEST_P(Relocations, AnyGridGivesTheSameBits) {
  // ODE solves whole groups alike in any grid; long chains of robots are cut (services/physics/ode_engine.hpp).
  const bool is_ode = GetParam() == "ODE";
  const std::uint32_t robots = is_ode ? 16 : 60;
  const auto crowd = testing::random_crowd(robots, 560, 400, is_ode ? 70 : 34, 11);
  const bool pushes = GetParam() != "KINEMATIC";
  const std::string text = experiment(
      "effect { name: 'worn' acts_on: WHEEL_GAIN function { of: DRIVEN_TIME linear { slope: -0.01 } } } " +
      std::string(pushes ? "movable { box { width_mm: 40 length_mm: 60 } mass_g: 18 x_mm: 0 y_mm: 270 } "
                           "movable { cylinder { radius_mm: 20 } mass_g: 10 x_mm: -100 y_mm: 270 } "
                         : ""));
  for (const auto& [columns, rows] : {std::pair{2u, 1u}, {3u, 2u}, {6u, 5u}}) {
    const RunPlan whole = make_plan(text, crowd), cut = make_plan(text, crowd, columns, rows, columns);
    Swarm a(whole), b(cut);
    std::mt19937 random(7);
    std::uniform_real_distribution<double> place(-300, 300), heading(-kPi, kPi);
    std::vector<std::uint32_t> by;
    for (std::uint32_t k = 0; k < 120; ++k) {
      std::vector<Relocation> relocations;
      // Some jump far, some onto others, some by a hair, one twice.
      if (k % 3 == 0) {
        const auto robot = static_cast<std::uint32_t>(random() % robots);
        relocations.push_back({false, robot, {place(random), place(random), heading(random)}});
        if (k % 9 == 0) relocations.push_back({false, robot, {place(random), place(random), heading(random)}});
        const ScenePose other = a.poses()[(robot + 1) % robots];
        relocations.push_back({false, (robot + 2) % robots, {other.x_mm * 0.9, other.y_mm * 0.9, heading(random)}});
        const ScenePose self = a.poses()[(robot + 3) % robots];
        relocations.push_back({false, (robot + 3) % robots, {self.x_mm, self.y_mm, heading(random)}});
      }
      if (pushes && k % 20 == 7)
        relocations.push_back({true, k / 20 % 2, {place(random) * 0.8, place(random) * 0.8, heading(random)}});
      for (Swarm* s : {&a, &b}) {
        for (std::uint32_t r = 0; r < robots; ++r) s->set_motors(r, (r + k / 30) % 3 == 0 ? 0 : 70, 70);
        s->step({}, {}, relocations);
      }
      ASSERT_EQ(a.hash(), b.hash()) << columns << "x" << rows << " tick " << k;
      ASSERT_NO_THROW(static_cast<void>(b.poses(&by)));
    }
    const auto p = a.poses(), q = b.poses();
    for (std::uint32_t r = 0; r < robots; ++r) ASSERT_EQ(p[r].x_mm, q[r].x_mm) << r;
  }
}

TEST_P(Relocations, ASavedStateHoldsThem) {
  const auto crowd = testing::random_crowd(30, 560, 560, 34, 3);
  const RunPlan columns = make_plan(experiment(), crowd, 3, 1), rows = make_plan(experiment(), crowd, 1, 2);
  Swarm a(columns), b(rows);
  a.set_all_motors(70, 60);
  b.set_all_motors(70, 60);
  for (int k = 0; k < 30; ++k) a.step();
  a.step({}, {}, {{false, 4, {-280, -280, 0}}, {false, 5, {280, 280, 1}}});
  b.load(a.tick(), a.save());
  ASSERT_EQ(a.hash(), b.hash());
  for (int k = 0; k < 30; ++k) {
    a.step();
    b.step();
    ASSERT_EQ(a.hash(), b.hash()) << k;
  }
}

INSTANTIATE_TEST_SUITE_P(Engines, Relocations, ::testing::Values("PLANAR", "KINEMATIC", "ODE"),
                         [](const auto& of) { return of.param; });

}  // namespace
}  // namespace kilotwin
