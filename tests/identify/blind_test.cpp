// What the base model finds where headings are not measured: rooms, discs, and that a push does not turn a robot.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "clients/identify/fit/fitter.hpp"
#include "tests/identify/truth/files.hpp"
#include "tests/identify/truth/play.hpp"
#include "tests/identify/truth/scenarios.hpp"

namespace kilotwin {
namespace {

identify::MotionModel fitted(const truth::Scene& scene, std::uint64_t seed) {
  const auto folder = std::filesystem::path(testing::TempDir()) / ("blind-" + scene.name);
  truth::write_data(scene, truth::play(scene, seed).train, folder);
  const identify::MeasuredSet set = identify::load_measured_set(folder);
  std::filesystem::remove_all(folder);
  identify::PreparedSet prepared(set);
  const identify::Fitter fitter(prepared, 2);
  identify::MotionModel model;
  fitter.fit_base(model);
  return model;
}

void expect_room_of(const truth::Scene& scene, const identify::Room& room, double within_mm) {
  const double x = scene.width_mm / 2 - 16.5, y = scene.height_mm / 2 - 16.5;
  EXPECT_NEAR(room.x_low_mm, -x, within_mm);
  EXPECT_NEAR(room.x_high_mm, x, within_mm);
  EXPECT_NEAR(room.y_low_mm, -y, within_mm);
  EXPECT_NEAR(room.y_high_mm, y, within_mm);
}

TEST(Blind, APushIsNoTurn) {
  // Robots of the test data push each other aside and never turn each other.
  truth::Scene scene = truth::scenario("nothing-blind");
  scene.train_runs = 2;
  scene.train_s = 150;
  scene.test_runs = 0;
  scene.width_mm = scene.height_mm = 600;
  const identify::MotionModel model = fitted(scene, 3);
  // Within 3 s of touching, 3 degrees at most.
  EXPECT_LT(std::sqrt(3 * model.noise.contact_rad2_s) * 180 / M_PI, 3);
  expect_room_of(scene, model.room, 1);
}

TEST(Blind, ATinyRoomIsSeen) {
  // Ten robots in a room of a foot, which are hardly ever free.
  truth::Scene scene = truth::nothing_to_find(8043);
  scene.test_runs = 0;
  const identify::MotionModel model = fitted(scene, 8043);
  // The wall is between the line that discs keep to and the one that the tracked point does.
  expect_room_of(scene, model.room, 9.2);
  EXPECT_NEAR(model.base.centre_mm, scene.disc_ahead_mm, 0.5);
  EXPECT_NEAR(model.base.ahead_mm, scene.tracked_ahead_mm, 0.5);
}

}  // namespace
}  // namespace kilotwin
