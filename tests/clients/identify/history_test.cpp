// Covariates of a robot's history, and hypotheses about amplitudes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "clients/identify/search/amplitudes.hpp"
#include "clients/identify/search/hypotheses.hpp"
#include "clients/identify/search/products.hpp"
#include "core/random/random.hpp"

namespace kilotwin::identify {
namespace {

Track commanded(std::vector<CommandChange> commands) {
  Track track;
  commands.insert(commands.begin(), {-1e300, Motion::kStop});
  track.commands = std::move(commands);
  return track;
}

TEST(History, DiscountedMotorTimeIsTheIntegralOverThePast) {
  const Random random(5);
  std::vector<CommandChange> commands;
  double at_s = 0;
  for (std::uint32_t i = 0; at_s < 100; ++i) {
    commands.push_back({at_s, static_cast<Motion>((i * 7 + i * i) % 4)});
    at_s += 0.5 + 9 * random.uniform(Stream::kLayout, 1, Tick{0}, i);
  }
  const CommandClock clock(commanded(commands));
  constexpr double kStep_s = 1e-3;
  std::array<std::array<double, 3>, kDecayTimes_s.size()> sums{};
  double now_s = 0;
  for (int i = 0; now_s < 90; ++i) {
    const CommandState state = clock.at(now_s + kStep_s / 2);
    for (std::size_t f = 0; f < kDecayTimes_s.size(); ++f) {
      const std::array<bool, 3> on = {state.left_on(), state.right_on(), state.driven()};
      for (std::size_t m = 0; m < 3; ++m)
        sums[f][m] = sums[f][m] * std::exp(-kStep_s / kDecayTimes_s[f]) + (on[m] ? kStep_s : 0);
    }
    now_s = (i + 1) * kStep_s;
    if (i % 7919 != 0) continue;
    for (std::size_t f = 0; f < kDecayTimes_s.size(); ++f)
      for (std::size_t m = 0; m < 3; ++m) EXPECT_NEAR(clock.at(now_s).discounted_s(f, m), sums[f][m], 0.01);
  }
}

TEST(History, DurationOfThePreviousCommand) {
  const CommandClock clock(commanded({{1, Motion::kStraight}, {4.5, Motion::kStop}, {6, Motion::kLeft}}));
  for (const auto& [time_s, lasted_s] :
       {std::pair{0.5, 0.0}, {2.0, 1.0}, {5.0, 3.5}, {5.9, 3.5}, {7.0, 1.5}, {60.0, 1.5}}) {
    Situation s;
    s.commands = clock.at(time_s);
    EXPECT_DOUBLE_EQ(value_of({Covariate::kPreviousLasted}, s, 0), lasted_s) << time_s;
  }
}

TEST(History, TheEarlierTurnIsBeforeThePresentCommand) {
  const CommandClock clock(
      commanded({{1, Motion::kLeft}, {2, Motion::kStraight}, {4, Motion::kRight}, {6, Motion::kStop}}));
  for (const auto& [time_s, earlier, count] :
       {std::tuple{0.5, 0.0, 0.0}, {1.5, 0.0, 1.0}, {3.0, 2.0, 2.0}, {5.0, 2.0, 3.0}, {7.0, 3.0, 4.0}}) {
    Situation s;
    s.commands = clock.at(time_s);
    EXPECT_EQ(value_of({Covariate::kEarlierTurn}, s, 0), earlier) << time_s;
    EXPECT_EQ(value_of({Covariate::kCommandCount}, s, 0), count) << time_s;
  }
}

TEST(History, CommandsBeforeTheTrackAreOne) {
  const CommandClock clock(commanded({{-9, Motion::kLeft}, {-5, Motion::kStop}, {-1, Motion::kStraight}}));
  const CommandState state = clock.at(1);
  EXPECT_EQ(state.command, Motion::kStraight);
  EXPECT_EQ(state.earlier_turn, Motion::kStop);
  EXPECT_EQ(state.count, 1);
  EXPECT_TRUE(state.first);
}

TEST(History, ARestResetsTheTimeSinceIt) {
  const CommandClock clock(
      commanded({{1, Motion::kStraight}, {4.5, Motion::kLeft}, {6, Motion::kStop}, {9, Motion::kRight}}));
  for (const auto& [time_s, since_s, difference_s] : {std::tuple{0.5, 0.0, 0.0},
                                                      {2.0, 1.0, 0.0},
                                                      {5.0, 4.0, 0.5},
                                                      {6.5, 0.0, 1.5},
                                                      {9.0, 0.0, 1.5},
                                                      {10.0, 1.0, 0.5},
                                                      {12.0, 3.0, -1.5}}) {
    Situation s;
    s.commands = clock.at(time_s);
    EXPECT_DOUBLE_EQ(value_of({Covariate::kSinceRest}, s, 0), since_s) << time_s;
    EXPECT_DOUBLE_EQ(value_of({Covariate::kMotorTimeDifference}, s, 0), difference_s) << time_s;
  }
}

TEST(History, TheFirstCommandHasNoPredecessor) {
  const CommandClock clock(commanded({{0, Motion::kStraight}, {4, Motion::kStop}, {6, Motion::kLeft}}));
  const Axis previous{Covariate::kPreviousCommand};
  const auto at = [&](double time_s) {
    Situation s;
    s.commands = clock.at(time_s);
    return value_of(previous, s, 0);
  };
  EXPECT_EQ(at(1), kNoCommand);
  EXPECT_EQ(at(5), static_cast<double>(Motion::kStraight));
  EXPECT_EQ(at(7), static_cast<double>(Motion::kStop));
  // A robot that rests at first has stop as previous command.
  const CommandClock rested(commanded({{2, Motion::kStraight}}));
  Situation s;
  s.commands = rested.at(3);
  EXPECT_EQ(value_of(previous, s, 0), static_cast<double>(Motion::kStop));
}

TEST(History, AKnownCurveIsTheSumOfItsColumns) {
  Factor curve;
  curve.shape = Factor::Shape::kCosines;
  curve.axis.of = Covariate::kTime;
  curve.high = 50;
  curve.first = 0;
  curve.count = 4;
  Factor known = curve;
  known.known = {0.3, -1, 0, 2};
  ASSERT_EQ(known.size(), 1u);
  for (double time_s = 0; time_s < 60; time_s += 3.7) {
    Situation s;
    s.time_s = time_s;
    std::array<double, 4> columns;
    curve.evaluate(s, 0, columns.data());
    double sum = 0, one = 0;
    for (std::size_t i = 0; i < 4; ++i) sum += known.known[i] * columns[i];
    known.evaluate(s, 0, &one);
    EXPECT_DOUBLE_EQ(one, sum);
  }
}

/// The columns cos(pi u) and cos(pi v) of an arena of 200 mm.
Factor map_of_plane() {
  Factor map;
  map.shape = Factor::Shape::kCosines2;
  map.axis.of = Covariate::kX;
  map.and_axis.of = Covariate::kY;
  map.low = map.and_low = -100;
  map.high = map.and_high = 100;
  map.count = 1;
  return map;
}

TEST(History, AnEffectOfPositionIsAlsoTestedOverTime) {
  Extent extent;
  extent.duration_s = 200;
  extent.x_low_mm = extent.y_low_mm = -100;
  extent.x_high_mm = extent.y_high_mm = 100;
  extent.has_straight = true;
  extent.robots = {1};
  const Factor map = map_of_plane();
  Term patch;
  patch.name = "speed-by-position";
  patch.blocks = {{Target::kGain, Basis{{map}}}};
  patch.coefficients = Eigen::Vector2d(0.1, -0.3);
  patch.precision = Eigen::Vector2d(1, 1);
  const Dictionary with = dictionary_of(extent, {patch});
  const auto last_of = [&](const std::string& name) {
    return std::find_if(with.hypotheses.rbegin(), with.hypotheses.rend(),
                        [&](const Hypothesis& h) { return h.name == name; });
  };
  // Also over the heading.
  ASSERT_NE(last_of("speed-by-position-and-heading"), with.hypotheses.rend());
  EXPECT_EQ(last_of("speed-by-position-and-heading")->columns.size(), 4u);
  ASSERT_NE(last_of("speed-by-time-and-position"), with.hypotheses.rend());
  const Hypothesis& last = *last_of("speed-by-time-and-position");
  EXPECT_EQ(last.covariates, (std::vector<std::string>{"time", "position"}));
  EXPECT_EQ(last.columns.size(), 16U);
  const Term term = with.term_of(last, 1);
  ASSERT_EQ(term.blocks.size(), 1u);
  std::array<double, kMostColumns> values;
  Situation s;
  s.time_s = 50;
  s.x_mm = -20;
  s.y_mm = 70;
  term.blocks[0].basis.evaluate(s, 0, values.data());
  // The map is known by its values at nodes, with linear interpolation between them.
  const double there = 0.1 * std::cos(M_PI * 0.4) - 0.3 * std::cos(M_PI * 0.85);
  for (std::size_t k = 0; k < term.blocks[0].basis.size(); ++k)
    EXPECT_NEAR(values[k], there * std::cos(M_PI * static_cast<double>(k + 1) * 0.25), 1e-4);
}

TEST(History, WhatActsBesideAGainDoesNotHideIt) {
  // A map of gains with a small part in mm/s along the heading, whose numbers are larger.
  Extent extent;
  extent.robots = {3, 5, 9};
  extent.x_low_mm = extent.y_low_mm = -100;
  extent.x_high_mm = extent.y_high_mm = 100;
  const Factor map = map_of_plane();
  const Term patch{"speed-by-position",
                   {{Target::kGain, Basis{{map}}}, {Target::kAhead, Basis{{map}}}},
                   Eigen::Vector4d(0.1, -0.3, 0.8, 0.6),
                   Eigen::Vector4d::Ones()};
  EXPECT_EQ(main_part(patch).blocks.front().target, Target::kGain);
  const Dictionary with = dictionary_of(extent, {patch});
  EXPECT_TRUE(std::any_of(with.hypotheses.begin(), with.hypotheses.end(),
                          [](const Hypothesis& h) { return h.name == "speed-by-robot-and-position"; }));
}

TEST(History, ACurveAndItsSuddenChangesAreOneFunction) {
  Factor curve, step;
  curve.shape = Factor::Shape::kCosines;
  step.shape = Factor::Shape::kAtLeast;
  curve.axis.of = step.axis.of = Covariate::kTime;
  curve.high = 150;
  curve.count = 3;
  step.points = {64.6};
  const Term term{"speed-by-time",
                  {{Target::kGain, Basis{{curve}, {0, 2}}}, {Target::kGain, Basis{{step}}}},
                  Eigen::Vector3d(0.1, -0.05, 0.4),
                  Eigen::Vector3d::Ones()};
  const std::vector<Factor> functions = functions_of(term);
  ASSERT_EQ(functions.size(), 1U);
  EXPECT_EQ(functions.front().axis, curve.axis);
  for (double time_s = 0.5; time_s < 150; time_s += 1) {
    // Cosines round off the step.
    if (std::abs(time_s - 64.6) < 15) continue;
    const double u = time_s / 150, smooth = 0.1 * std::cos(M_PI * u) - 0.05 * std::cos(3 * M_PI * u);
    double found = 0;
    functions.front().evaluate_at(time_s, 0, &found);
    EXPECT_NEAR(found, (1 + smooth) * (time_s < 64.6 ? 1 : 1.4) - 1, 0.03) << time_s;
  }
}

TEST(History, AMapOrACurveIsAPartOfTheirProduct) {
  Factor map = map_of_plane(), curve;
  curve.shape = Factor::Shape::kCosines;
  curve.axis.of = Covariate::kTime;
  curve.high = 100;
  curve.count = 2;
  const auto of = [](Target target, const std::vector<Factor>& factors, const Eigen::VectorXd& coefficients) {
    return Term{"", {{target, Basis{factors}}}, coefficients, Eigen::VectorXd::Ones(coefficients.size())};
  };
  const Term of_place = of(Target::kGain, {map}, Eigen::Vector2d(0.1, -0.3)),
             of_time = of(Target::kGain, {curve}, Eigen::Vector2d(0.1, -0.3)),
             turn = of(Target::kTurn, {curve}, Eigen::Vector2d(0.1, -0.3));
  Factor known = curve;
  known.known = {0.2, 0.4};
  const Term product = of(Target::kGain, {known, map}, Eigen::Vector2d(1, -1));
  EXPECT_TRUE(is_part_of_product(of_place, product));
  EXPECT_TRUE(is_part_of_product(of_time, product));
  EXPECT_FALSE(is_part_of_product(turn, product));
  EXPECT_FALSE(is_part_of_product(product, of_place));
  EXPECT_FALSE(is_part_of_product(of_place, of_time));
}

TEST(History, ADriftOverTimeOrPlaceHasAConstantPart) {
  Extent extent;
  extent.has_straight = true;
  extent.robots = {1};
  const Dictionary all = dictionary_of(extent);
  for (const char* const name : {"drift-by-time", "drift-by-position"}) {
    // Along x and along y.
    const auto constants = [&](const Hypothesis& h) {
      const Term term = all.term_of(h, 1);
      return std::count_if(term.blocks.begin(), term.blocks.end(),
                           [](const Block& block) { return block.basis.factors.empty(); });
    };
    EXPECT_TRUE(std::any_of(all.hypotheses.begin(), all.hypotheses.end(), [&](const Hypothesis& h) {
      return h.name == name && constants(h) == 2;
    })) << name;
  }
}

TEST(History, AnEffectIsTestedWithAmplitudesPerRobotAndCommand) {
  Extent extent;
  extent.duration_s = 100;
  extent.has_straight = extent.has_turns = extent.has_stop = true;
  extent.robots = {3, 5, 9};
  Term battery;
  battery.name = "speed-by-time";
  Factor curve;
  curve.shape = Factor::Shape::kCosines;
  curve.axis.of = Covariate::kTime;
  curve.high = 100;
  curve.count = 6;
  battery.blocks = {{Target::kGain, Basis{{curve}, {0, 3}}}};
  battery.coefficients = Eigen::Vector2d(-0.2, 0.05);
  battery.precision = Eigen::Vector2d(1, 1);
  const Dictionary without = dictionary_of(extent), with = dictionary_of(extent, {battery});
  // Amplitudes per robot, command and previous command; over the plane, the heading, motor time, and time since the command.
  EXPECT_EQ(with.columns(), without.columns() + 3 + 3 + 5 + 9 + 4 + 16 + 5);
  for (const auto& [covariate, word] : {std::pair{Covariate::kRobot, "robot"}, {Covariate::kCommand, "command"}}) {
    const Hypothesis* found = nullptr;
    for (std::size_t h = without.hypotheses.size(); h < with.hypotheses.size(); ++h) {
      const auto& words = with.hypotheses[h].covariates;
      if (std::find(words.begin(), words.end(), word) != words.end()) found = &with.hypotheses[h];
    }
    ASSERT_NE(found, nullptr);
    EXPECT_EQ(found->covariates.size(), 2u);
    const Term term = with.term_of(*found, 1);
    ASSERT_EQ(term.blocks.size(), 1u);
    const Basis& basis = term.blocks[0].basis;
    EXPECT_TRUE(basis.looks_at(covariate));
    Situation s;
    s.time_s = 30;
    s.robot = 5;
    s.commands.command = Motion::kLeft;
    std::array<double, 3> values;
    basis.evaluate(s, 0, values.data());
    EXPECT_NEAR(values[1], -0.2 * std::cos(M_PI * 0.3) + 0.05 * std::cos(4 * M_PI * 0.3), 1e-12);
    EXPECT_EQ(values[0], 0);
    EXPECT_EQ(values[2], 0);
  }
}

}  // namespace
}  // namespace kilotwin::identify
