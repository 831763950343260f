// Effects of two covariates of which a search sees one first: it takes the other as an amplitude of what it has found. Effects on one
// wheel, and drifts after commands.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>

#include "tests/identify/small_set.hpp"
#include "tests/identify/truth/random_effects.hpp"

namespace kilotwin {
namespace {

truth::Scene large(void (*push)(const truth::Situation&, truth::Push&)) {
  truth::Effect one;
  one.name = "effect";
  one.push = push;
  truth::Scene scene = small({one});
  scene.robots = 20;
  scene.train_runs = 3;
  scene.train_s = 200;
  return scene;
}

/// Half of the robots and three quarters of the time, at nearly the same density.
truth::Scene smaller(truth::Scene scene) {
  scene.robots /= 2;
  scene.width_mm *= 0.75;
  scene.height_mm *= 0.75;
  scene.train_s *= 0.75;
  scene.test_runs = 0;
  return scene;
}

TEST(Pairs, APatchThatActsOnOneWheelByItsMotorTime) {
  const truth::Scene scene = large([](const truth::Situation& at, truth::Push& push) {
    const double wave = 0.5 + 0.5 * std::sin((at.driven_s.left + at.driven_s.right) / 14);
    push.gain.left *= 1 + 0.35 * wave / (1 + std::pow(std::hypot(at.disc.x, at.disc.y - 100) / 200, 6));
  });
  EXPECT_EQ(found_in(scene), "speed-by-position-and-motor-time");
}

TEST(Pairs, StartsAfterAStopByTheHeading) {
  const truth::Scene scene = large([](const truth::Situation& at, truth::Push& push) {
    if (at.before != truth::Motion::kStop) return;
    const double gain = 1 - 0.55 * (0.5 + 0.5 * std::cos(at.heading_rad - 1)) * std::exp(-at.since_change_s / 3.5);
    push.gain.left *= gain;
    push.gain.right *= gain;
  });
  EXPECT_NE(found_in(scene).find("speed-by-history-and-heading-and-time-since-command"), std::string::npos);
}

TEST(Pairs, APartOfTheRoomThatIsLitAtOnce) {
  // Effects of place and of time are found first. A moving circle explains more than both together, their product still more.
  EXPECT_EQ(found_in(smaller(truth::scenario("lamp")), 1), "speed-by-time-and-position");
}

TEST(WithoutHeadings, ACameraThatSwaysIsNoDrift) {
  // The walls of the base model do not sway. Beside them, a drift explains more.
  constexpr std::uint64_t kSeed = 3001;
  EXPECT_EQ(found_in(smaller(truth::random_effects(kSeed)), kSeed), "camera-by-time");
}

TEST(Wheels, OneThatGainsSpeedInARun) {
  const truth::Scene scene =
      large([](const truth::Situation& at, truth::Push& push) { push.gain.left *= 1 + 0.25 * at.time_s / 200; });
  EXPECT_EQ(found_in(scene), "speed-by-time");
}

TEST(Drifts, AfterOneKindOfCommand) {
  const truth::Scene scene = large([](const truth::Situation& at, truth::Push& push) {
    if (at.driven() && at.before == truth::Motion::kRight)
      push.drift_mm_s.x += 2.5 * std::exp(-at.since_change_s / 3);
  });
  EXPECT_EQ(found_in(scene), "drift-by-previous-command");
}

TEST(Slips, FadeAfterOneKindOfCommand) {
  const truth::Scene scene = large([](const truth::Situation& at, truth::Push& push) {
    if (at.driven() && at.before == truth::Motion::kLeft)
      push.slip_mm_s.y -= 1.8 * std::exp(-at.since_change_s / 3);
  });
  EXPECT_EQ(found_in(scene), "slip-by-previous-command");
}

}  // namespace
}  // namespace kilotwin
