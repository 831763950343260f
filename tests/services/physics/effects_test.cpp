// Effects through the engines: targets, functions and covariates against closed forms.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/base/error.hpp"
#include "services/physics/drive.hpp"
#include "tests/services/physics/swarm.hpp"

namespace kilotwin {
namespace {

using testing::make_plan;
using testing::ScenePose;
using testing::Swarm;

using testing::kBase_mm;
using testing::kOffset_mm;
using testing::kQuiet;
using testing::kTick_s;

std::string effect(const std::string& what, const std::string& function) {
  return "effect { name: \"e\" " + what + " function { " + function + " } } ";
}

/// An effect that moves a robot along x in any state, with its function as the speed in mm/s.
std::string shown(const std::string& function, const std::string& more = "") {
  return kQuiet + more + effect("acts_on: WORLD_DRIFT during: [STOP, STRAIGHT, LEFT, RIGHT]", function);
}

TEST(Effects, AGainScalesTheWheelsItNames) {
  for (const auto& [wheel, left, right] :
       {std::tuple{"", 8.0, 8.0}, {"wheel: LEFT_WHEEL", 8.0, 10.0}, {"wheel: RIGHT_WHEEL", 10.0, 8.0}}) {
    const RunPlan plan =
        make_plan(kQuiet + effect(std::string("acts_on: WHEEL_GAIN ") + wheel, "constant: -0.2"), {{0, 0, 0}});
    Swarm swarm(plan);
    swarm.set_all_motors(70, 70);
    swarm.run(100);
    const double rate = (right - left) / kBase_mm, t = 100 * kTick_s;
    const ScenePose pose = swarm.poses()[0];
    EXPECT_NEAR(pose.heading_rad, rate * t, 1e-12);
    const double run_mm = rate == 0 ? left * t : (left + right) / 2 / rate * std::sin(rate * t);
    EXPECT_NEAR(pose.x_mm, -kOffset_mm + run_mm + kOffset_mm * std::cos(rate * t), 1e-9);
  }
}

TEST(Effects, GainsMultiplyAndOffsetsAdd) {
  const std::string text =
      "motion { noise: true } robot_model { robot: 0 bias_left_mm_s: 2 bias_right_mm_s: 2 } "
      "effect { name: 'a' acts_on: WHEEL_GAIN function { constant: 0.5 } } effect { name: 'b' acts_on: WHEEL_GAIN "
      "function { constant: -0.5 } } "
      "effect { name: 'c' acts_on: WHEEL_OFFSET function { constant: 3 } function { constant: -0.5 } }";
  const RunPlan plan = make_plan(text, {{0, 0, 0}});
  Swarm swarm(plan);
  swarm.set_all_motors(70, 70);
  swarm.run(10);
  EXPECT_NEAR(swarm.poses()[0].x_mm, (12 * 1.5 * 0.5 - 1.5) * 10 * kTick_s, 1e-11);
}

TEST(Effects, GainsOfASumAddUpBeforeTheyMultiply) {
  const auto gain = [](const char* name, const char* more, double value) {
    return "effect { name: '" + std::string(name) + "' acts_on: WHEEL_GAIN " + more +
           " function { constant: " + std::to_string(value) + " } } ";
  };
  // (1 + 0.5 - 0.25) (1 + 0.2 + 0.2) (1 - 0.5). Members of a sum need not follow each other.
  const std::string text = kQuiet + gain("a", "sum: 's'", 0.5) + gain("b", "sum: 't'", 0.2) + gain("c", "", -0.5) +
                           gain("d", "sum: 's'", -0.25) + gain("e", "wheel: LEFT_WHEEL sum: 't'", 0.2) +
                           gain("f", "wheel: RIGHT_WHEEL sum: 't'", 0.2);
  const RunPlan plan = make_plan(text, {{0, 0, 0}});
  Swarm swarm(plan);
  swarm.set_all_motors(70, 70);
  swarm.run(10);
  EXPECT_NEAR(swarm.poses()[0].x_mm, 10 * 1.25 * 1.4 * 0.5 * 10 * kTick_s, 1e-11);
  EXPECT_EQ(swarm.poses()[0].heading_rad, 0);
}

TEST(Effects, ATurnRateMovesTheReferencePointOnACircle) {
  const RunPlan plan = make_plan(kQuiet + effect("acts_on: TURN_RATE", "constant: 0.1"), {{0, 0, 0}});
  Swarm swarm(plan);
  swarm.set_all_motors(70, 70);
  swarm.run(500);
  const double heading = 0.1 * 500 * kTick_s;
  const ScenePose pose = swarm.poses()[0];
  EXPECT_NEAR(pose.heading_rad, heading, 1e-11);
  EXPECT_NEAR(pose.x_mm, -kOffset_mm + 100 * std::sin(heading) + kOffset_mm * std::cos(heading), 1e-9);
  EXPECT_NEAR(pose.y_mm, 100 - 100 * std::cos(heading) + kOffset_mm * std::sin(heading), 1e-9);
}

TEST(Effects, ABodyDriftTurnsWithTheBody) {
  // The effects alone: sideways at 5 mm/s while turning at 0.2 rad/s.
  const std::string text =
      kQuiet +
      "effect { name: 'a' acts_on: BODY_DRIFT direction_deg: 90 during: STOP function { constant: 5 } } "
      "effect { name: 'b' acts_on: TURN_RATE during: STOP function { constant: 0.2 } }";
  const RunPlan plan = make_plan(text, {{0, 0, 0}});
  Swarm swarm(plan);
  swarm.run(400);
  const double turn = 0.2 * 400 * kTick_s, radius_mm = 5 / 0.2;
  const ScenePose pose = swarm.poses()[0];
  EXPECT_NEAR(pose.x_mm, -kOffset_mm + radius_mm * (std::cos(turn) - 1) + kOffset_mm * std::cos(turn), 1e-9);
  EXPECT_NEAR(pose.y_mm, radius_mm * std::sin(turn) + kOffset_mm * std::sin(turn), 1e-9);
}

TEST(Effects, AWorldDriftAddsUpNearOtherRobots) {
  // Both robots turn. The second pair is so close that its ticks have sub-steps, but the robots never touch.
  const std::string text = kQuiet + effect("acts_on: WORLD_DRIFT direction_deg: 30", "constant: 4");
  const std::vector<ScenePose> start = {{-300, 0, 1}, {300, 0, 1}, {300, 38.5, 1}};
  const RunPlan plan = make_plan(text, start), plain = make_plan(kQuiet, start);
  Swarm swarm(plan), without(plain);
  for (Swarm* s : {&swarm, &without}) {
    s->set_all_motors(70, 0);
    s->run(200);
  }
  const double way_mm = 4 * 200 * kTick_s;
  for (std::size_t r = 0; r < 3; ++r) {
    const ScenePose a = swarm.poses()[r], b = without.poses()[r];
    EXPECT_NEAR(a.x_mm - b.x_mm, way_mm * std::cos(kPi / 6), 1e-9) << r;
    EXPECT_NEAR(a.y_mm - b.y_mm, way_mm * std::sin(kPi / 6), 1e-9) << r;
    EXPECT_NEAR(a.heading_rad, b.heading_rad, 1e-13);
  }
}

TEST(Effects, FunctionsOfTimeAddUpTickByTick) {
  const struct {
    const char* shape;
    double (*f)(double);
  } cases[] = {{"of: TIME linear { at_zero: 5 slope: -0.4 }", [](double t) { return 5 - 0.4 * t; }},
               {"of: TIME exponential { at_zero: 6 at_infinity: 1 scale: 3 }",
                [](double t) { return 1 + 5 * std::exp(-t / 3); }},
               {"of: TIME harmonic { mean: 1 cosine: 2 sine: 3 period: 2 }",
                [](double t) { return 1 + 2 * std::cos(kPi * t) + 3 * std::sin(kPi * t); }},
               {"of: TIME steps { at: 2 value: [3, -3] }", [](double t) { return t < 2 ? 3.0 : -3.0; }},
               {"of: TIME spline { knot: [0, 100] value: [0, 100] }", [](double t) { return t; }}};
  for (const auto& [shape, f] : cases) {
    const RunPlan plan = make_plan(shown(shape, "duration_s: 20 "), {{0, 0, 2}});
    Swarm swarm(plan);
    double sum = 0;
    for (int k = 0; k < 200; ++k) {
      sum += f(k * kTick_s) * kTick_s;
      swarm.step();
      ASSERT_NEAR(swarm.poses()[0].x_mm, sum, 1e-10) << shape << k;
      ASSERT_EQ(swarm.poses()[0].heading_rad, 2);
    }
  }
}

/// Value of a covariate in the coming step, measured by the displacement of robot 0.
double seen(Swarm& swarm, std::uint32_t robot = 0) {
  const double before = swarm.poses()[robot].x_mm;
  swarm.step();
  return (swarm.poses()[robot].x_mm - before) / kTick_s;
}
/// A function whose value is a thousandth of a covariate.
std::string thousandth(const std::string& covariate, const std::string& more = "") {
  return "of: " + covariate + " " + more + " linear { slope: 0.001 }";
}

TEST(Effects, CovariatesOfPoseAndCommand) {
  const ScenePose start{-30, 40, 0.7};
  const auto value = [&](const std::string& covariate, std::uint8_t left, std::uint8_t right) {
    // The motors themselves cause no motion here.
    const RunPlan plan =
        make_plan("motion { noise: false straight_speed_mm_s: 0 turn_speed_mm_s: 0 } run_number: 6 " +
                      effect("acts_on: WORLD_DRIFT during: [STOP, STRAIGHT, LEFT, RIGHT]", thousandth(covariate)),
                  {{300, 300, 0}, start});
    Swarm swarm(plan);
    swarm.set_all_motors(left, right);
    return 1000 * seen(swarm, 1);
  };
  EXPECT_NEAR(value("X", 0, 0), -30, 1e-8);
  EXPECT_NEAR(value("Y", 0, 0), 40, 1e-8);
  EXPECT_NEAR(value("RADIUS", 0, 0), 50, 1e-8);
  EXPECT_NEAR(value("HEADING", 0, 0), 0.7, 1e-8);
  EXPECT_NEAR(value("ROBOT", 0, 0), 1, 1e-8);
  EXPECT_NEAR(value("RUN", 0, 0), 6, 1e-8);
  EXPECT_NEAR(value("COMMAND", 0, 0), 0, 1e-8);
  EXPECT_NEAR(value("COMMAND", 50, 60), 1, 1e-8);
  EXPECT_NEAR(value("COMMAND", 50, 0), 2, 1e-8);
  EXPECT_NEAR(value("COMMAND", 0, 60), 3, 1e-8);
  EXPECT_NEAR(value("LEFT_DUTY", 50, 60), 50, 1e-8);
  EXPECT_NEAR(value("RIGHT_DUTY", 50, 60), 60, 1e-8);
}

TEST(Effects, OwnMotorsAreThoseOfEachWheel) {
  const RunPlan plan = make_plan(kQuiet + effect("acts_on: WHEEL_OFFSET", thousandth("DUTY")), {{0, 0, 0}});
  Swarm swarm(plan);
  swarm.set_all_motors(70, 35);  // the right motor drives the left wheel
  swarm.step();
  const double left = 5 + 0.035, right = 10 + 0.07;
  EXPECT_NEAR(swarm.poses()[0].heading_rad, (right - left) / kBase_mm * kTick_s, 1e-14);
}

TEST(Effects, TimesFollowTheMotors) {
  const auto plan_of = [](const std::string& function) { return make_plan(shown(function), {{0, 0, kPi / 2}}); };
  const RunPlan left = plan_of(thousandth("LEFT_MOTOR_TIME")), right = plan_of(thousandth("RIGHT_MOTOR_TIME")),
                driven = plan_of(thousandth("DRIVEN_TIME")), since = plan_of(thousandth("TIME_SINCE_COMMAND")),
                fading = plan_of(thousandth("DRIVEN_TIME", "forget_s: 2")),
                rest = plan_of(thousandth("SINCE_REST")), difference = plan_of(thousandth("MOTOR_TIME_DIFFERENCE"));
  Swarm swarms[] = {Swarm(left),   Swarm(right), Swarm(driven),    Swarm(since),
                    Swarm(fading), Swarm(rest),  Swarm(difference)};
  double expected[7] = {};
  std::pair<bool, bool> last{false, false};
  for (int k = 0; k < 400; ++k) {
    const bool l = k / 50 % 3 != 0, r = k / 70 % 2 != 0;
    if (std::pair(l, r) != last) expected[3] = 0;
    last = {l, r};
    for (int s = 0; s < 7; ++s) {
      if (!l && !r) expected[5] = 0;
      swarms[s].set_all_motors(l ? 70 : 0, r ? 70 : 0);
      const double before = swarms[s].poses()[0].x_mm;
      // Subtracts the motion by the motors alone: that of a robot with the same pose without effects.
      const RunPlan plain = make_plan(kQuiet, {swarms[s].poses()[0]});
      Swarm twin(plain);
      twin.set_all_motors(l ? 70 : 0, r ? 70 : 0);
      twin.step();
      swarms[s].step();
      ASSERT_NEAR(1000 * (swarms[s].poses()[0].x_mm - twin.poses()[0].x_mm) / kTick_s, expected[s], 1e-6)
          << s << " " << k << before;
    }
    expected[0] += l ? kTick_s : 0;
    expected[1] += r ? kTick_s : 0;
    expected[2] += l || r ? kTick_s : 0;
    expected[3] += kTick_s;
    expected[5] += l || r ? kTick_s : 0;
    expected[6] = expected[0] - expected[1];
    expected[4] = expected[4] * std::exp(-kTick_s / 2) + (l || r ? kTick_s : 0);
  }
}

TEST(Effects, NeighbourCovariatesMatchTheirDefinitions) {
  // Neighbours of the robot: 50 mm ahead, 70 mm to the left, at 99 mm and at 101 mm.
  const std::vector<ScenePose> start = {{0, 0, 0.5},
                                        {50 * std::cos(0.5), 50 * std::sin(0.5), 0},
                                        {-70 * std::sin(0.5), 70 * std::cos(0.5), 0},
                                        {-99, 0, 0},
                                        {0, -101, 0}};
  const auto value = [&](const std::string& covariate, const std::vector<ScenePose>& poses,
                         const std::string& how = "") {
    const RunPlan plan =
        make_plan(kQuiet + "effect { name: 'e' acts_on: WORLD_DRIFT robot: 0 during: STOP function { " +
                      thousandth(covariate, "radius_mm: 100 " + how) + " } }",
                  poses);
    Swarm swarm(plan);
    return 1000 * seen(swarm);
  };
  EXPECT_NEAR(value("NEIGHBOURS", start), 3, 1e-8);
  EXPECT_NEAR(value("NEAREST", start), 50, 1e-8);
  EXPECT_NEAR(value("NEAREST_BEARING", start), 0, 1e-7);
  const auto weight = [](double d) { return (1 - d * d / 1e4) * (1 - d * d / 1e4); };
  EXPECT_NEAR(value("DENSITY", start), weight(50) + weight(70) + weight(99), 1e-8);
  // Their bearings: 0, 90 and 180 - 0.5 rad = 151.4 degrees.
  const auto share = [](double degrees) { return (1 + std::cos(degrees * kPi / 180)) / 2; };
  EXPECT_NEAR(value("NEIGHBOURS", start, "focus: 2"), 1 + std::pow(share(90), 2) + std::pow(share(151.3521), 2),
              1e-6);
  EXPECT_NEAR(value("DENSITY", start, "focus: 1 toward_deg: 90"),
              weight(50) * share(90) + weight(70) + weight(99) * share(61.3521), 1e-6);
  // All robots are at rest. Robots 2 and 3 stand at 70 and 99 mm.
  EXPECT_EQ(value("NEIGHBOURS", start, "others: DRIVEN_OTHERS"), 0);
  EXPECT_NEAR(value("NEIGHBOURS", start, "others: RESTING_OTHERS"), 3, 1e-8);
  EXPECT_NEAR(value("NEAREST", start, "others: DRIVEN_OTHERS"), 100, 1e-8);
  EXPECT_NEAR(value("DENSITY", start, "other_robot: 3 other_robot: 2"), weight(70) + weight(99), 1e-8);
  EXPECT_NEAR(value("NEAREST", start, "other_robot: 3"), 99, 1e-8);
  EXPECT_NEAR(value("NEAREST_BEARING", start, "other_robot: 2"), kPi / 2, 1e-7);
  const std::vector<ScenePose> fewer = {start[0], start[2], start[4]};
  EXPECT_NEAR(value("NEAREST_BEARING", fewer), kPi / 2, 1e-7);
  const std::vector<ScenePose> alone = {start[0], start[4]};
  EXPECT_EQ(value("NEIGHBOURS", alone), 0);
  EXPECT_NEAR(value("NEAREST", alone), 100, 1e-8);
  EXPECT_EQ(value("NEAREST_BEARING", alone), 0);
}

TEST(Effects, NeighboursThatDriveCountFromTheirFirstTick) {
  const RunPlan plan =
      make_plan(kQuiet + "effect { name: 'e' acts_on: WORLD_DRIFT robot: 0 during: STOP function { " +
                    thousandth("NEIGHBOURS", "radius_mm: 100 others: DRIVEN_OTHERS") + " } }",
                {{0, 0, 0}, {60, 0, 0}, {-70, 0, 0}});
  Swarm swarm(plan);
  swarm.set_motors(2, 70, 0);
  EXPECT_NEAR(1000 * seen(swarm), 1, 1e-8);
  swarm.set_motors(1, 70, 70);
  EXPECT_NEAR(1000 * seen(swarm), 2, 1e-8);
  swarm.set_motors(2, 0, 0);
  EXPECT_NEAR(1000 * seen(swarm), 1, 1e-8);
}

TEST(Effects, DistancesFromAMovingPointMatchTheirDefinition) {
  const std::string function = thousandth(
      "POINT_DISTANCE", "point { x_mm: -30 y_mm: 40 velocity_x_mm_s: 3 velocity_y_mm_s: -1 growth_mm_s: 2 }");
  // The function is the drift along y, in mm/s, of a robot that stands at the origin at first.
  const RunPlan plan =
      make_plan(kQuiet + "effect { name: 'e' acts_on: WORLD_DRIFT direction_deg: 90 during: STOP function { " +
                    function + " } }",
                {{0, 0, 0}});
  Swarm swarm(plan);
  double y_mm = 0;
  for (int k = 0; k < 300; ++k) {
    const double t = k * kTick_s;
    EXPECT_NEAR(swarm.poses()[0].y_mm, y_mm, 1e-9) << k;
    y_mm += kTick_s * (std::hypot(-30 + 3 * t, y_mm - (40 - t)) - 2 * t) / 1000;
    swarm.run(1);
  }
}

TEST(Effects, PlacesAlongADirectionMatchTheirDefinition) {
  const RunPlan plan =
      make_plan(shown(thousandth("ALONG", "along_deg: 30")), {{100, 0, 0}, {0, 100, 0}, {-60, 80, 0}});
  Swarm swarm(plan);
  const std::vector<ScenePose> before = swarm.poses();
  swarm.run(1);
  for (std::size_t i = 0; i < before.size(); ++i) {
    const double along_mm = before[i].x_mm * std::cos(M_PI / 6) + before[i].y_mm * std::sin(M_PI / 6);
    EXPECT_NEAR(swarm.poses()[i].x_mm, before[i].x_mm + kTick_s * along_mm / 1000, 1e-9) << i;
  }
}

class EpisodesOfShape : public ::testing::TestWithParam<int> {};

INSTANTIATE_TEST_SUITE_P(LomaxAndBurr, EpisodesOfShape, ::testing::Values(1, 3));

TEST_P(EpisodesOfShape, HaveTheStatedRateAndDuration) {
  // 200 robots for 1000 s.
  constexpr std::uint32_t kRobots = 200;
  constexpr int kTicks = 30518;
  const double mean_apart_s = 8, scale_s = 4, tail = 3, shape = GetParam();
  // A shape of 1: scale / (tail - 1).
  const double mean_length_s =
      scale_s * std::tgamma(tail - 1 / shape) * std::tgamma(1 + 1 / shape) / std::tgamma(tail);
  std::vector<ScenePose> poses;
  for (std::uint32_t r = 0; r < kRobots; ++r) poses.push_back({0, 40.0 * r - 4000, 0});
  const RunPlan plan =
      make_plan(shown("episodes { mean_apart_s: 8 scale_s: 4 tail: 3 shape: " + std::to_string(GetParam()) + " }",
                      "duration_s: 1000 physics { engine: KINEMATIC } "),
                poses);
  Swarm swarm(plan);
  std::vector<double> last_x(kRobots, 0), began(kRobots, -1), lengths, waits, ended(kRobots, -1);
  double on = 0;
  for (int k = 0; k < kTicks; ++k) {
    swarm.step();
    const std::vector<ScenePose> now_at = swarm.poses();
    for (std::uint32_t r = 0; r < kRobots; ++r) {
      const double x = now_at[r].x_mm, moved = (x - last_x[r]) / kTick_s;
      last_x[r] = x;
      ASSERT_TRUE(std::abs(moved) < 1e-6 || std::abs(moved - 1) < 1e-6);
      const bool is_on = moved > 0.5;
      on += is_on;
      const double now = k * kTick_s;
      if (is_on && began[r] < 0) {
        began[r] = now;
        if (ended[r] >= 0) waits.push_back(now - ended[r]);
      }
      if (!is_on && began[r] >= 0) {
        if (ended[r] >= 0) lengths.push_back(now - began[r]);
        began[r] = -1;
        ended[r] = now;
      }
    }
  }
  const auto mean = [](const std::vector<double>& v) {
    return std::accumulate(v.begin(), v.end(), 0.0) / static_cast<double>(v.size());
  };
  ASSERT_GT(lengths.size(), 15000u);
  // Three standard errors, plus a tick for phases rounded up to one; the run's end cuts long phases.
  EXPECT_NEAR(mean(waits), mean_apart_s, 3 * mean_apart_s / std::sqrt(waits.size()) + kTick_s + 0.1);
  EXPECT_NEAR(mean(lengths), mean_length_s, 3 * 3.5 / std::sqrt(lengths.size()) + kTick_s);
  EXPECT_NEAR(on / kTicks / kRobots, mean_length_s / (mean_length_s + mean_apart_s), 0.01);
  for (const double t : {2.0, 8.0, 20.0}) {
    const double grown = std::pow(t / scale_s, shape), share = std::pow(1 + grown, -tail),
                 density = tail * shape / t * grown * share / (1 + grown), n = static_cast<double>(lengths.size());
    const double longer =
        static_cast<double>(std::count_if(lengths.begin(), lengths.end(), [t](double l) { return l > t; }));
    EXPECT_NEAR(longer / n, share, 3 * std::sqrt(share * (1 - share) / n) + 0.01 * share + kTick_s * density) << t;
  }
}

TEST(Effects, CovariatesOfPastCommandsMatchTheirDefinitions) {
  // Covariates during the last of these commands, in its first tick and later ones.
  struct Case {
    std::vector<std::pair<std::uint8_t, std::uint8_t>> duties;
    double previous, turn, earlier_turn, count;
  };
  const Case cases[] = {{{{70, 70}}, 0, 0, 0, 1},
                        {{{70, 0}}, 0, 2, 0, 1},
                        {{{70, 70}, {0, 70}}, 1, 3, 0, 2},
                        {{{70, 0}, {70, 70}}, 2, 2, 2, 2},
                        {{{70, 0}, {70, 70}, {0, 70}}, 1, 3, 2, 3},
                        {{{70, 0}, {0, 70}, {0, 0}, {70, 70}}, 0, 3, 3, 4},
                        {{{70, 0}, {70, 70}, {0, 70}, {70, 70}}, 3, 3, 3, 4}};
  for (const std::string covariate :
       {"PREVIOUS_COMMAND", "LAST_TURN", "EARLIER_TURN", "COMMAND_COUNT", "PREVIOUS_LASTED"}) {
    for (const Case& c : cases) {
      const double expected = covariate == "LAST_TURN"          ? c.turn
                              : covariate == "EARLIER_TURN"     ? c.earlier_turn
                              : covariate == "COMMAND_COUNT"    ? c.count
                              : covariate == "PREVIOUS_COMMAND" ? c.previous
                                                                : (c.duties.size() > 1 ? 4 * kTick_s : 0);
      const RunPlan plan =
          make_plan("motion { noise: false straight_speed_mm_s: 0 turn_speed_mm_s: 0 } " +
                        effect("acts_on: WORLD_DRIFT during: [STOP, STRAIGHT, LEFT, RIGHT]", thousandth(covariate)),
                    {{0, 0, 0}});
      Swarm swarm(plan);
      for (std::size_t i = 0; i < c.duties.size(); ++i) {
        swarm.set_motors(0, c.duties[i].first, c.duties[i].second);
        swarm.run(i + 1 < c.duties.size() ? 4 : 0);
      }
      for (int tick = 0; tick < 3; ++tick)
        EXPECT_NEAR(1000 * seen(swarm, 0), expected, 1e-8) << covariate << " " << tick;
    }
  }
}

TEST(Effects, PreviousMotionIsInTheThenBodyFrame) {
  // Robot 0 drives along y. The effect acts on robot 1, which turns, and uses its own previous tick.
  for (const auto& [covariate, straight, turning] : {std::tuple{"PREVIOUS_FORWARD", 10.0, 10.0},
                                                     {"PREVIOUS_SIDEWAYS", 0.0, 0.8 * kOffset_mm},
                                                     {"PREVIOUS_TURN", 0.0, 0.8}}) {
    const RunPlan plan = make_plan(kQuiet + effect("acts_on: WORLD_DRIFT during: STOP", thousandth(covariate)),
                                   {{-300, 0, 0.4}, {300, 0, 2}});
    Swarm swarm(plan);
    swarm.set_motors(0, 70, 70);
    swarm.set_motors(1, 70, 0);
    swarm.run(3);
    swarm.set_all_motors(0, 0);
    const auto before = swarm.poses();
    swarm.step();
    // In a tick with a turn of 0.026 rad, the mean direction differs by half of it.
    EXPECT_NEAR(1000 * (swarm.poses()[0].x_mm - before[0].x_mm) / kTick_s, straight, 1e-7) << covariate;
    EXPECT_NEAR(1000 * (swarm.poses()[1].x_mm - before[1].x_mm) / kTick_s, turning, 0.15) << covariate;
    swarm.step();
    const auto resting = swarm.poses();
    swarm.step();
    EXPECT_NEAR(swarm.poses()[0].x_mm, resting[0].x_mm, 1e-4);
  }
}

TEST(Effects, ArenaFieldsAccumulate) {
  // Two robots are in one cell, one of them driven. A third one, at rest in the cell, shows the cell's value.
  const std::vector<ScenePose> start = {{10, 10, kPi / 2}, {60, 10, 0}, {10, 60, 0}, {-200, 0, 0}};
  const auto field = [](const std::string& counts) {
    return "motion { noise: false straight_speed_mm_s: 0 } field { name: 'f' cell_mm: 100 " + counts +
           " } "
           "effect { name: 'e' acts_on: WORLD_DRIFT during: STOP robot: [2, 3] function { " +
           thousandth("PLACE", "field: 'f'") + " } }";
  };
  const RunPlan driven = make_plan(field(""), start), present = make_plan(field("counts: PRESENT_TIME"), start),
                visits = make_plan(field("counts: VISITS"), start), fading = make_plan(field("forget_s: 1"), start);
  Swarm swarms[] = {Swarm(driven), Swarm(present), Swarm(visits), Swarm(fading)};
  double faded = 0;
  for (int k = 0; k < 100; ++k) {
    for (Swarm& s : swarms) s.set_motors(0, 70, 70);
    EXPECT_NEAR(1000 * seen(swarms[0], 2), k * kTick_s, 1e-7) << k;
    EXPECT_NEAR(1000 * seen(swarms[1], 2), 3 * k * kTick_s, 1e-7) << k;
    EXPECT_NEAR(1000 * seen(swarms[2], 2), k == 0 ? 0 : 3, 1e-7) << k;
    EXPECT_NEAR(1000 * seen(swarms[3], 2), faded, 1e-7) << k;
    faded = (faded + kTick_s) * std::exp(-kTick_s);
  }
  EXPECT_EQ(swarms[0].poses()[3].x_mm, -200);
}

TEST(Effects, TrailsAreThoseOfTheLatestOtherRobot) {
  // Robots 0 and 1 share a cell and drive in turns; 2 reads the cell at rest. Nobody was in the cell of robot 3.
  const RunPlan plan = make_plan(
      "motion { noise: false straight_speed_mm_s: 0 } field { name: 'f' counts: TRAIL forget_s: 2 cell_mm: 100 "
      "corner_x_mm: 995 corner_y_mm: -105 } "
      "effect { name: 'e' acts_on: WORLD_DRIFT during: [STOP, STRAIGHT] function { " +
          thousandth("PLACE", "field: 'f'") + " } }",
      {{10, 10, kPi / 2}, {60, 10, 0}, {10, 60, 0}, {-200, 0, 0}});
  Swarm swarm(plan);
  const auto freshness = [](int age) { return std::exp(-age * kTick_s / 2); };
  for (int k = 0; k < 60; ++k) {
    swarm.set_motors(0, k < 20 ? 70 : 0, k < 20 ? 70 : 0);
    swarm.set_motors(1, k >= 40 ? 70 : 0, k >= 40 ? 70 : 0);
    const auto before = swarm.poses();
    swarm.step();
    const auto after = swarm.poses();
    const auto read = [&](std::size_t r) { return 1000 * (after[r].x_mm - before[r].x_mm) / kTick_s; };
    const int since_0 = k <= 20 ? 1 : k - 19, since_1 = 1;
    EXPECT_NEAR(read(0), k <= 40 ? 0 : freshness(since_1), 1e-7) << k;
    EXPECT_NEAR(read(1), k == 0 ? 0 : freshness(since_0), 1e-7) << k;
    EXPECT_NEAR(read(2), k == 0 ? 0 : k <= 40 ? freshness(since_0) : freshness(since_1), 1e-7) << k;
    EXPECT_NEAR(read(3), 0, 1e-7) << k;
  }
}

TEST(Effects, ActDuringTheStatedCommandsOnTheStatedRobots) {
  const RunPlan plan =
      make_plan(kQuiet + effect("acts_on: WHEEL_GAIN during: LEFT robot: [1, 2, 77]", "constant: 1"),
                {{-300, 0, 0}, {0, 0, 0}, {300, 0, 0}});
  Swarm swarm(plan);
  swarm.set_motors(0, 70, 0);
  swarm.set_motors(1, 70, 0);
  swarm.set_motors(2, 0, 70);
  swarm.step();
  const double turn = 20 / kBase_mm * kTick_s;
  EXPECT_NEAR(swarm.poses()[0].heading_rad, turn, 1e-13);
  EXPECT_NEAR(swarm.poses()[1].heading_rad, 2 * turn, 1e-13);
  EXPECT_NEAR(swarm.poses()[2].heading_rad, -turn, 1e-13);
  swarm.set_all_motors(0, 0);
  const auto before = swarm.poses();
  swarm.run(10);
  EXPECT_EQ(swarm.poses()[1].heading_rad, before[1].heading_rad);
}

TEST(Effects, AreLimitedTogether) {
  const RunPlan plan =
      make_plan("motion { noise: false effects_limit_mm_s: 7 } " + shown("constant: 1000").substr(kQuiet.size()) +
                    "effect { name: 'f' acts_on: WHEEL_OFFSET function { constant: 1e6 } }",
                {{0, 0, 0}});
  const physics::DriveModel drive(plan);
  Swarm swarm(plan);
  swarm.set_all_motors(70, 70);
  swarm.step();
  EXPECT_NEAR(swarm.poses()[0].x_mm, (10 + 7 + 7) * kTick_s, 1e-12);
  EXPECT_GE(drive.top_speed_mm_s(), 24);
  EXPECT_LT(drive.top_speed_mm_s(), 40);
}

/// Variance of the displacement along x after 4.194304 s, mm^2, and the correlation of displacements in successive ticks over
/// robots.
struct Spread {
  double variance, neighbouring;
};
Spread spread_of(const std::string& noise, std::uint32_t tick_cycles) {
  constexpr std::uint32_t kRobots = 2000;
  const RunPlan plan =
      make_plan("tick_cycles: " + std::to_string(tick_cycles) + " arena { width_mm: 100000 height_mm: 100000 } " +
                    shown("noise { " + noise + " }"),
                testing::grid_crowd(kRobots, 200, testing::Facing::kRight));
  const auto start = testing::grid_crowd(kRobots, 200, testing::Facing::kRight);
  Swarm swarm(plan);
  auto before = start;
  std::vector<double> last(kRobots, 0);
  double product = 0, square = 0;
  for (std::uint32_t k = 0; k < (1u << 25) / tick_cycles; ++k) {
    swarm.step();
    const auto now = swarm.poses();
    for (std::uint32_t r = 0; r < kRobots; ++r) {
      const double way = now[r].x_mm - before[r].x_mm;
      product += k > 0 ? way * last[r] : 0;
      square += k > 0 ? way * way : 0;
      last[r] = way;
    }
    before = now;
  }
  double sum = 0, sum_square = 0;
  for (std::uint32_t r = 0; r < kRobots; ++r) {
    const double way = before[r].x_mm - start[r].x_mm;
    sum += way;
    sum_square += way * way;
  }
  return {sum_square / kRobots - sum / kRobots * sum / kRobots, product / square};
}

TEST(Effects, NoiseDoesNotDependOnTheTickLength) {
  const double t = 4.194304;
  for (const std::uint32_t cycles : {1u << 17, 1u << 18, 1u << 20}) {
    // 4.4 standard errors of a variance of 2000.
    const double bound = 4.4 * std::sqrt(2.0 / 2000), tick_s = cycles / 8e6;
    const Spread white = spread_of("sd: 2", cycles);
    EXPECT_NEAR(white.variance / (4 * t), 1, bound) << cycles;
    EXPECT_NEAR(white.neighbouring, 0, 4.4 / std::sqrt(2000 * t / tick_s));
    // The variance of the integral of a process with correlation exp(-t / c) is 2 sd^2 c (t - c (1 - exp(-t / c))). The sum over
    // ticks exceeds it by a relative amount of about (tick / c)^2 / 6.
    const double c = 1.5, expected = 2 * 4 * c * (t - c * (1 - std::exp(-t / c)));
    const Spread slow = spread_of("sd: 2 correlation_s: 1.5", cycles);
    EXPECT_NEAR(slow.variance / expected, 1, bound + 0.005) << cycles;
    EXPECT_NEAR(slow.neighbouring, std::exp(-tick_s / c), 0.02);
  }
}

TEST(Effects, NoiseOfTheTwoWheelsIsIndependent) {
  const RunPlan plan = make_plan("arena { width_mm: 100000 height_mm: 100000 } " + kQuiet +
                                     effect("acts_on: WHEEL_OFFSET", "noise { sd: 0.1 }"),
                                 testing::grid_crowd(4000, 200, testing::Facing::kRight));
  Swarm swarm(plan);
  swarm.set_all_motors(70, 70);
  swarm.step();
  double square = 0;
  for (const ScenePose& pose : swarm.poses()) square += pose.heading_rad * pose.heading_rad;
  const double sd_mm_s = 0.1 / std::sqrt(kTick_s),
               expected = 2 * sd_mm_s * sd_mm_s * kTick_s * kTick_s / (kBase_mm * kBase_mm);
  EXPECT_NEAR(square / 4000 / expected, 1, 4.4 * std::sqrt(2.0 / 4000));
}

TEST(Effects, ACheckpointOfOtherMemoryIsRefused) {
  const RunPlan plan = make_plan(shown(thousandth("DRIVEN_TIME")), {{0, 0, 0}}),
                plain = make_plan(kQuiet, {{0, 0, 0}});
  Swarm swarm(plan), other(plain);
  EXPECT_THROW(swarm.load(Tick{0}, other.save()), RunError);
  EXPECT_THROW(other.load(Tick{0}, swarm.save()), RunError);
}

}  // namespace
}  // namespace kilotwin
