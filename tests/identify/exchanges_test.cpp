// Look-alikes, on small scenes: the one that the search takes, by exchanges of terms; errors of the camera.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>

#include "tests/identify/small_set.hpp"

namespace kilotwin {
namespace {

/// An effect on the motion.
truth::Effect effect(std::function<void(const truth::Situation&, truth::Push&)> push) {
  truth::Effect out;
  out.name = "effect";
  out.push = std::move(push);
  return out;
}

truth::Scene without_headings(const truth::Effect& one) {
  truth::Scene scene = small({one});
  scene.heading = false;
  scene.robots = 20;
  scene.train_runs = 3;
  scene.train_s = 200;
  return scene;
}

TEST(Exchanges, ALargeEffectOfACommandIsNoInertia) {
  // Without headings, the base model of robots whose left turns are slower by 65 % is far off. About it, inertia has more evidence.
  const truth::Effect slow = effect([](const truth::Situation& at, truth::Push& push) {
    if (at.motion != truth::Motion::kLeft) return;
    push.gain.left *= 0.35;
    push.gain.right *= 0.35;
  });
  // One wheel drives a turn: its speed and its turn rate are the same number.
  const std::string found = found_in(without_headings(slow), 5);
  EXPECT_TRUE(found == "speed-by-command" || found == "turning-by-command") << found;
}

TEST(Exchanges, RobotsThatSlipHaveNoMarkersBesideTheirMiddles) {
  // A slip to the left and a marker that is not in the middle look alike to the linear test.
  const truth::Effect slip = effect([](const truth::Situation& at, truth::Push& push) {
    if (at.driven() && at.robot % 5 < 2) push.slip_mm_s.y -= 2.8;
  });
  EXPECT_EQ(found_in(without_headings(slip), 5), "slip-by-robot");
}

TEST(Camera, ShiftsByTheHeadingAreNamed) {
  // The marker is lit from one side and seen elsewhere, by what it shows to the light.
  truth::Effect lit;
  lit.name = "lit marker";
  lit.see = [](const truth::Situation& at, truth::View& view) {
    view.point.x += 10 * (0.5 + 0.5 * std::cos(2 * at.heading_rad));
  };
  EXPECT_EQ(found_in(small({lit}), 5), "camera-by-heading");
}

}  // namespace
}  // namespace kilotwin
