// Effects of some robots only, on small scenes: neighbours that count, wheels that change.
#include <gtest/gtest.h>

#include <algorithm>
#include <optional>

#include "clients/identify/search/search.hpp"
#include "clients/identify/search/shape_refinement.hpp"
#include "clients/identify/search/simplification.hpp"
#include "clients/identify/search/wheel_offsets.hpp"
#include "tests/identify/small_set.hpp"
#include "tests/identify/truth/laboratory_effects.hpp"

namespace kilotwin {
namespace {

using identify::Axis;
using identify::Block;
using identify::Dictionary;
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
  const MeasuredSet set = set_of(scene, played(scene));
  FitState base(set);
  const Fitter fitter(set, 2);
  fitter.fit_base(base);
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
  const MeasuredSet set = set_of(scene, played(scene));
  FitState state(set);
  const Fitter fitter(set, 2);
  fitter.fit_base(state);
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

}  // namespace
}  // namespace kilotwin
