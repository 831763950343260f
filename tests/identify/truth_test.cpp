// The test data against closed forms: the reference itself must be right.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "tests/identify/truth/oracle.hpp"
#include "tests/identify/truth/play.hpp"
#include "tests/identify/truth/scenarios.hpp"
#include "tests/identify/truth/world.hpp"

namespace kilotwin::truth {
namespace {

/// Single robots that drive straight.
Scene straight_ahead() {
  Scene s;
  s.robots = 200;
  s.train_runs = 0;
  s.test_runs = 1;
  s.test_s = 30;
  s.width_mm = s.height_mm = 0;
  s.contacts = false;
  s.straight_low_s = s.straight_high_s = 100;
  s.turn_low_s = s.turn_high_s = 0;
  s.stop_share = s.missing = 0;
  s.bias_mean_mm_s = s.bias_sd_mm_s = 0;
  return s;
}

TEST(Truth, SameSeedSameBits) {
  const Scene scene = scenario("vortex");
  const Play a = play(scene, 3), b = play(scene, 3), c = play(scene, 4);
  ASSERT_EQ(a.test.size(), b.test.size());
  ASSERT_EQ(a.test[0].samples.size(), b.test[0].samples.size());
  for (std::size_t i = 0; i < a.test[0].samples.size(); ++i) {
    EXPECT_EQ(a.test[0].samples[i].point.x, b.test[0].samples[i].point.x);
  }
  EXPECT_NE(a.test[0].samples[0].point.x, c.test[0].samples[0].point.x);
}

TEST(Truth, TurnsAboutTheWheelAtRest) {
  Scene scene = straight_ahead();
  Situation now;
  now.motion = Motion::kLeft;
  const Stance after = moved(scene, {}, {{0, 0}, 0}, now, 0.1, {1, 1});
  EXPECT_NEAR(after.heading_rad, 2.0 / 25, 1e-12);
  // The left wheel stays at (0, 12.5): the axle centre circles around it.
  EXPECT_NEAR(after.axle.x, 12.5 * std::sin(0.08), 1e-7);
  EXPECT_NEAR(after.axle.y, 12.5 - 12.5 * std::cos(0.08), 1e-7);
}

TEST(Truth, NoiseHasItsVariance) {
  // After T the distance has the variance v^2 s^2 h T / 2 and the heading 2 v^2 s^2 h T / w^2; h: the step.
  Scene scene = straight_ahead();
  scene.tracker_sd_mm = scene.heading_sd_rad = 0;
  const Play played = play(scene, 11);
  double square = 0;
  for (const std::vector<View>& marks : played.test[0].marks) {
    square += std::pow(std::remainder(marks[4].heading_rad - marks[0].heading_rad, 2 * 3.14159265358979), 2);
  }
  const double expected = 2 * 100 * scene.factor_sd * scene.factor_sd * scene.step_s * 20 / (25 * 25);
  // 200 robots estimate a variance to 10 %; three standard deviations.
  EXPECT_NEAR(square / 200 / expected, 1, 0.3);
}

TEST(Truth, TheOracleReachesTheTheoreticalError) {
  // A robot with known pose drives straight for T. Its expected position is the mean path; the error is that of
  // the integrated noise: along T v^2 q / 2, across v^2 T^3 (2 v^2 q / w^2) / 3, with q = s^2 h. The tracked point
  // at distance a ahead adds a times the heading error.
  Scene scene = straight_ahead();
  scene.tracker_sd_mm = 0.01;
  scene.heading_sd_rad = 0.001;
  scene.factor_sd = 0.05;
  const Play played = play(scene, 5);
  const double rmse = rmse_mm(predict(scene, played.individuals, played.test[0], 10, 60, 1));
  const double v = 10, T = 10, q = scene.factor_sd * scene.factor_sd * scene.step_s, a = scene.tracked_ahead_mm;
  const double turn = 2 * v * v * q / (25 * 25);
  const double across = v * v * T * T * T * turn / 3 + a * v * T * T * turn + a * a * T * turn;
  const double along = 0.5 * v * v * q * T;
  // 1000 predictions, of which five per robot overlap by half, estimate an RMSE to about 3 %; 1 % more for 60
  // samples.
  EXPECT_NEAR(rmse / std::sqrt(across + along), 1, 0.1);
}

TEST(Truth, DiscsNeverOverlapAndStayInTheArena) {
  const Scene scene = scenario("nothing-crowded");
  const Play played = play(scene, 2);
  for (const auto& run : played.train) {
    for (std::size_t mark = 1; mark < run.marks[0].size(); ++mark) {
      for (std::size_t i = 0; i < run.marks.size(); ++i) {
        const Vec a = run.marks[i][mark].point;
        EXPECT_LT(std::abs(a.x), 240 - 16.5 + 0.01);
        for (std::size_t j = i + 1; j < run.marks.size(); ++j) {
          const Vec b = run.marks[j][mark].point;
          EXPECT_GT(std::hypot(a.x - b.x, a.y - b.y), 33 - 2);
        }
      }
    }
  }
}

TEST(Truth, KnowledgeOfEffectsImprovesTheOracle) {
  // In every scene with an effect on means, knowledge of the effects reduces the error.
  for (const std::string& name : scenario_names()) {
    Scene scene = scenario(name);
    if (std::none_of(scene.effects.begin(), scene.effects.end(),
                     [](const Effect& effect) { return (effect.push || effect.see) && !effect.by_chance; }))
      continue;
    scene.train_runs = 0;
    const Play played = play(scene, 1);
    const double knows = rmse_mm(predict(scene, played.individuals, played.test[0], 10, 6, 1));
    Scene without = scene;
    without.effects.clear();
    const double blind = rmse_mm(predict(without, played.individuals, played.test[0], 10, 6, 1));
    EXPECT_GT(blind, knows) << name;
  }
}

TEST(Truth, EveryCovariateOfTheContractHasAScene) {
  std::set<std::string> named;
  for (const std::string& name : scenario_names()) {
    for (const Effect& effect : scenario(name).effects) {
      for (const Covariates& set : effect.named_by) named.insert(set.begin(), set.end());
    }
  }
  const std::set<std::string> contract = {
      "time",       "position",   "heading",     "command",     "time_since_command",
      "motor_time", "neighbours", "world_frame", "measurement", "robot",
      "history",    "episodes"};
  EXPECT_EQ(named, contract);
}

}  // namespace
TEST(RandomEffects, FollowTheirSeed) {
  std::set<std::string> kinds;
  int pairs = 0;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    const Scene scene = scenario("random:" + std::to_string(seed)),
                again = scenario("random:" + std::to_string(seed));
    EXPECT_EQ(scene.about, again.about);
    ASSERT_FALSE(scene.effects.empty());
    pairs += scene.effects.size() > 1 ? 1 : 0;
    Situation at;
    const std::vector<Vec> discs(static_cast<std::size_t>(scene.robots), Vec{40, 30});
    at.discs = &discs;
    at.motion = Motion::kStraight;
    at.robot = 39;  // of a scene that was made larger
    at.time_s = at.driven_s.left = at.driven_s.right = 50;
    for (const Effect& effect : scene.effects) {
      ASSERT_NE(static_cast<bool>(effect.push), static_cast<bool>(effect.see)) << scene.about;
      ASSERT_EQ(effect.named_by.size(), 1u);
      for (const std::string& c : effect.named_by.front()) kinds.insert(c);
      Push push;
      View view{{10, 20}, 0.5};
      if (effect.push) effect.push(at, push);
      if (effect.see) effect.see(at, view);
      // Speeds keep their sign; nothing is beyond what a laboratory would see.
      EXPECT_GT(push.gain.left, 0.25) << scene.about;
      EXPECT_LT(push.gain.left, 1.7) << scene.about;
      EXPECT_LE(std::hypot(push.drift_mm_s.x, push.drift_mm_s.y), 4) << scene.about;
      EXPECT_LE(std::abs(push.slip_mm_s.y), 4) << scene.about;
      EXPECT_LE(std::abs(push.turn_rad_s), 0.25) << scene.about;
      EXPECT_LE(std::hypot(view.point.x - 10, view.point.y - 20), 20.001) << scene.about;
      EXPECT_LE(std::abs(view.heading_rad - 0.5), 0.35) << scene.about;
    }
  }
  // One in three has two effects; 40 to 95 of 200 with a chance of more than 0.9999.
  EXPECT_GE(pairs, 40);
  EXPECT_LE(pairs, 95);
  for (const char* kind : {"time", "position", "heading", "robot", "command", "history", "motor_time",
                           "time_since_command", "neighbours", "measurement"})
    EXPECT_TRUE(kinds.contains(kind)) << kind;
}

}  // namespace kilotwin::truth
