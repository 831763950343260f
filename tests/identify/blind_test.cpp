// Base model without measured headings: walls, disc centres, and pushes without rotation.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>

#include "clients/identify/fit/fitter.hpp"
#include "tests/identify/truth/files.hpp"
#include "tests/identify/truth/play.hpp"
#include "tests/identify/truth/scenarios.hpp"

namespace kilotwin {
namespace {

identify::MotionModel fitted(const truth::Scene& scene, std::uint64_t seed) {
  const auto folder =
      std::filesystem::path(testing::TempDir()) / ("blind-" + std::to_string(getpid()) + "-" + scene.name);
  truth::write_data(scene, truth::play(scene, seed).train, folder);
  const identify::MeasuredSet set = identify::load_measured_set(folder);
  std::filesystem::remove_all(folder);
  identify::FitState state(set);
  identify::Fitter(set, 2).fit_base(state);
  return state.model;
}

void expect_room_of(const truth::Scene& scene, const identify::Walls& walls, double within_mm) {
  const double x = scene.width_mm / 2 - 16.5, y = scene.height_mm / 2 - 16.5;
  EXPECT_NEAR(walls.x_low_mm, -x, within_mm);
  EXPECT_NEAR(walls.x_high_mm, x, within_mm);
  EXPECT_NEAR(walls.y_low_mm, -y, within_mm);
  EXPECT_NEAR(walls.y_high_mm, y, within_mm);
}

TEST(WithoutHeadings, APushDoesNotTurnARobot) {
  // Robots of the test data displace each other without rotation.
  truth::Scene scene = truth::scenario("nothing-blind");
  scene.train_runs = 2;
  scene.train_s = 150;
  scene.test_runs = 0;
  scene.width_mm = scene.height_mm = 600;
  const identify::MotionModel model = fitted(scene, 3);
  // Within 3 s of a contact, 3 degrees at most.
  EXPECT_LT(std::sqrt(3 * model.noise.contact_rad2_s) * 180 / M_PI, 3);
  expect_room_of(scene, model.walls, 1);
}

TEST(WithoutHeadings, WallsOfASmallArenaAreFitted) {
  // Ten robots in an arena of 300 mm, nearly always in contact.
  truth::Scene scene = truth::nothing_to_find(8043);
  scene.test_runs = 0;
  const identify::MotionModel model = fitted(scene, 8043);
  // The wall lies between the line of the disc centres and that of the tracked points.
  expect_room_of(scene, model.walls, 9.2);
  EXPECT_NEAR(model.base.centre_mm, scene.disc_ahead_mm, 0.5);
  EXPECT_NEAR(model.base.ahead_mm, scene.tracked_ahead_mm, 0.5);
}

}  // namespace
}  // namespace kilotwin
