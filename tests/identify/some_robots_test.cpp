// Effects of some robots only, on small scenes: neighbours that count, wheels that change.
#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "clients/identify/search/products.hpp"
#include "clients/identify/search/search.hpp"
#include "clients/identify/search/shape_refinement.hpp"
#include "clients/identify/search/simplification.hpp"
#include "clients/identify/search/wheel_offsets.hpp"
#include "tests/identify/small_set.hpp"
#include "tests/identify/truth/effects.hpp"
#include "tests/identify/truth/laboratory_effects.hpp"

namespace kilotwin {
namespace {

using identify::Axis;
using identify::Block;
using identify::Dictionary;
using identify::Factor;
using identify::FitState;
using identify::Fitter;
using identify::Hypothesis;
using identify::MeasuredSet;
using identify::Target;
using identify::Term;

/// The search on twelve robots in a narrow arena.
identify::Search found_in_a_crowd(const truth::Effect& effect) {
  truth::Scene scene = small({effect});
  scene.robots = 12;
  scene.width_mm = scene.height_mm = 360;
  auto&& [set, fitter, base] = BaseFit(scene);
  return identify::search(fitter, base, identify::WorkLog({}));
}

const Axis& first_axis(const Term& term) { return term.blocks.front().basis.factors.front().axis; }

TEST(SomeNeighbours, ThoseThatDriveAreFound) {
  const identify::Search found = found_in_a_crowd(truth::driving_crowd());
  ASSERT_FALSE(found.fit.model.terms.empty());
  const Term& term = found.fit.model.terms.front();
  EXPECT_EQ(term.name, "speed-by-neighbours");
  EXPECT_EQ(first_axis(term).others, Others::kDriven);
  EXPECT_NEAR(identify::reach_mm(first_axis(term)), 110, 10);
}

TEST(SomeNeighbours, OneRobotIsFound) {
  const identify::Search found = found_in_a_crowd(truth::slow_leader());
  ASSERT_FALSE(found.fit.model.terms.empty());
  const Term& term = found.fit.model.terms.front();
  EXPECT_EQ(term.name, "speed-by-robot-nearby");
  EXPECT_EQ(first_axis(term).only_robot, 1U);
  EXPECT_NEAR(identify::reach_mm(first_axis(term)), 150, 10);
  EXPECT_EQ(found.reasons.front().covariates, (std::vector<std::string>{"neighbours", "robot"}));
}

/// The term of the first hypothesis of this name with this target; empty: there is none.
Term term_of(const std::vector<Dictionary>& all, const std::string& name, Target target) {
  for (const Dictionary& dictionary : all) {
    for (const Hypothesis& h : dictionary.hypotheses) {
      if (h.name != name) continue;
      if (Term term = dictionary.term_of(h, 1); term.blocks.front().target == target) return term;
    }
  }
  return {};
}

TEST(WheelOffsets, OfRobotsThatAreReplaced) {
  const truth::Scene scene = small({truth::replaced_robots()});
  auto&& [set, fitter, state] = BaseFit(scene);
  Term curves = term_of(identify::general_dictionaries_of(identify::extent_of(state.tracks)),
                        "turning-by-robot-and-time", Target::kTurn);
  ASSERT_FALSE(curves.blocks.empty());
  curves.general = true;
  state.model.terms.push_back(std::move(curves));
  fitter.fit(state, 2);
  identify::refit(fitter, state, 0);
  ASSERT_TRUE(identify::simplify_to_switch(fitter, state, 0));
  ASSERT_TRUE(identify::replace_by_wheel_offsets(fitter, state, 0));
  const Term& term = state.model.terms.front();
  EXPECT_EQ(term.name, "bias-by-robot-and-time");
  // The speed of a wheel going straight, after the replacement less before it.
  const auto change_mm_s = [&](std::uint32_t robot) {
    identify::Situation s;
    s.robot = robot;
    s.commands.command = identify::Motion::kStraight;
    s.time_s = 80;
    const identify::Rates after = state.model.rates(s, {0, 0});
    s.time_s = 60;
    const identify::Rates before = state.model.rates(s, {0, 0});
    return std::pair(after.left_mm_s - before.left_mm_s, after.right_mm_s - before.right_mm_s);
  };
  EXPECT_NEAR(change_mm_s(2).first, -3.0, 0.6);
  EXPECT_NEAR(change_mm_s(2).second, 2.2, 0.6);
  EXPECT_NEAR(change_mm_s(5).first, 2.6, 0.6);
  EXPECT_NEAR(change_mm_s(5).second, -2.4, 0.6);
  EXPECT_NEAR(change_mm_s(1).first, 0, 0.4);
}

/// A factor with known coefficients.
Factor known(Factor::Shape shape, identify::Covariate of, double low, double high, std::vector<double> values) {
  Factor f;
  f.shape = shape;
  f.axis.of = of;
  f.low = low;
  f.high = high;
  f.count = static_cast<std::uint32_t>(values.size());
  f.known = std::move(values);
  return f;
}

TEST(Products, OfRobotsTimeAndPosition) {
  const truth::Scene scene = small({truth::late_patch_of_some()});
  auto&& [set, fitter, state] = BaseFit(scene);
  const double without = fitter.log_likelihood(state);
  // As from a step with amplitudes per robot, which is found first: a rough instant, and a speed that falls to the right.
  Factor robots = known(Factor::Shape::kTable, identify::Covariate::kRobot, 0, 1, {});
  for (int robot = 0; robot < 10; ++robot) {
    robots.points.push_back(robot);
    robots.known.push_back(robot % 2 == 0 ? 1 : 0.2);
  }
  Factor times = known(Factor::Shape::kAtLeast, identify::Covariate::kTime, 0, 1, {1}),
         places = known(Factor::Shape::kCosines, identify::Covariate::kX, -350, 350, {0.1});
  times.points = {71};
  places.plus = -0.1;
  Term term;
  term.name = "speed-by-robot-and-time-and-position";
  term.blocks = {{Target::kGain, {}}};
  state.model.terms.push_back(std::move(term));
  identify::ProductFit product(fitter, state, 0, {places, robots, times});
  product.fit();
  EXPECT_GT(fitter.log_likelihood(state), without + 500);
  const std::vector<Factor> functions = identify::functions_of(state.model.terms.front());
  ASSERT_EQ(functions.size(), 3U);
  const auto value_at = [&](std::uint32_t robot, double time_s, double x_mm) {
    identify::Situation s;
    s.robot = robot;
    s.time_s = time_s;
    s.x_mm = x_mm;
    double all = 1;
    for (const Factor& f : functions) {
      double value = 0;
      f.evaluate(s, 0, &value);
      all *= value;
    }
    return all;
  };
  // The amplitude of a robot that was hardly there is not known.
  const auto samples_there = [&](std::uint32_t robot) {
    std::ptrdiff_t count = 0;
    for (const identify::Run& run : set.runs)
      for (const identify::Track& track : run.tracks)
        if (track.robot == robot)
          count += std::count_if(track.samples.begin(), track.samples.end(),
                                 [](const identify::Sample& s) { return s.time_s > 72 && s.x_mm > 50; });
    return count;
  };
  int known_robots = 0;
  for (const std::uint32_t robot : {0U, 2U, 4U, 6U, 8U}) {
    constexpr std::ptrdiff_t kEnough = 40;
    if (samples_there(robot) < kEnough) continue;
    ++known_robots;
    EXPECT_NEAR(value_at(robot, 100, 150) - value_at(robot, 50, 150), -0.5, 0.08);
    EXPECT_NEAR(value_at(robot, 100, -150), 0, 0.08);
  }
  EXPECT_GE(known_robots, 2);
  EXPECT_NEAR(value_at(3, 100, 150), 0, 0.08);
  const auto steps = std::find_if(functions.begin(), functions.end(),
                                  [](const Factor& f) { return f.shape == Factor::Shape::kAtLeast; });
  ASSERT_NE(steps, functions.end());
  EXPECT_NEAR(steps->points.front(), 71.7, 1);
}

}  // namespace
}  // namespace kilotwin
