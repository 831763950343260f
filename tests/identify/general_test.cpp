// Parts of the search on small scenes: lag of the commands, products, travelling waves, switches, uncertainty, traffic that fades, walls.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "clients/identify/fit/persistent_residuals.hpp"
#include "clients/identify/fit/uncertainty.hpp"
#include "clients/identify/fit/wall_detection.hpp"
#include "clients/identify/model/effect_records.hpp"
#include "clients/identify/search/products.hpp"
#include "clients/identify/search/search.hpp"
#include "clients/identify/search/shape_refinement.hpp"
#include "clients/identify/search/simplification.hpp"
#include "clients/identify/search/travelling_waves.hpp"
#include "tests/identify/small_set.hpp"
#include "tests/identify/truth/effects.hpp"
#include "tests/identify/truth/laboratory_effects.hpp"

namespace kilotwin {
namespace {

using identify::FitState;
using identify::MeasuredSet;

TEST(CommandLag, IsFittedInPlaceOfEffects) {
  const truth::Scene scene = small({});
  for (const double lag_s : {0.1, -0.15}) {
    MeasuredSet set = set_of(scene, played(scene));
    for (identify::Run& run : set.runs)
      for (identify::Track& track : run.tracks)
        // All of them, the first ones too: a start with another lag is an effect of the time since the start.
        for (identify::CommandChange& change : track.commands) change.time_s -= lag_s;
    auto&& [late, fitter, base] = BaseFit(std::move(set));
    const identify::Search found = identify::search(fitter, base, identify::WorkLog({}));
    for (const identify::Term& term : found.fit.model.terms)
      ADD_FAILURE() << term.name << " at a lag of " << lag_s << " s";
    EXPECT_NEAR(found.fit.model.base.command_lag_s, lag_s, 0.02);
    const auto [low_s, high_s] = fitter.command_lag_interval(found.fit);
    EXPECT_LT(low_s, lag_s);
    EXPECT_GT(high_s, lag_s);
    EXPECT_LT(high_s - low_s, 0.1);
  }
}

TEST(CommandLag, IsNotUsedWithoutOne) {
  const truth::Scene scene = small({});
  auto&& [set, fitter, base] = BaseFit(scene);
  EXPECT_EQ(fitter.fit_command_lag(base), 0);
  EXPECT_EQ(base.model.base.command_lag_s, 0);
}

TEST(CommandLag, GoesWithATermThatExplainsIt) {
  const truth::Scene scene = small({truth::inertia()});
  auto&& [set, fitter, base] = BaseFit(scene);
  // At first it looks like a lag.
  FitState late = base;
  ASSERT_GT(fitter.fit_command_lag(late), 0);
  EXPECT_GT(late.model.base.command_lag_s, 0.3);
  const identify::Search found = identify::search(fitter, late, identify::WorkLog({}));
  EXPECT_NEAR(found.fit.model.base.command_lag_s, 0, 0.02);
  ASSERT_FALSE(found.fit.model.terms.empty());
  EXPECT_EQ(found.fit.model.terms.front().name, "inertia-by-command");
}

/// The first hypothesis of a name, fitted to a set and then separated; nothing if it is no product.
std::optional<identify::Term> product_of(const truth::Scene& scene, const std::string& name) {
  auto&& [set, fitter, state] = BaseFit(scene);
  std::vector<identify::Dictionary> all = identify::general_dictionaries_of(identify::extent_of(state.tracks));
  all.push_back(identify::dictionary_of(identify::extent_of(state.tracks)));
  for (const identify::Dictionary& dictionary : all) {
    const auto at = std::find_if(dictionary.hypotheses.begin(), dictionary.hypotheses.end(),
                                 [&](const identify::Hypothesis& h) { return h.name == name; });
    if (at == dictionary.hypotheses.end()) continue;
    state.model.terms.push_back(dictionary.term_of(*at, 1));
    fitter.fit(state, 2);
    if (!identify::separate(fitter, state, 0)) return std::nullopt;
    return state.model.terms.front();
  }
  ADD_FAILURE() << "no hypothesis " << name;
  return std::nullopt;
}

TEST(Products, OfCommandsGetTheirStep) {
  // Turns are slow from the 21st command on.
  const truth::Scene scene = small({truth::many_commands()});
  const std::optional<identify::Term> term = product_of(scene, "speed-by-command-and-command-count");
  ASSERT_TRUE(term);
  const std::vector<identify::Factor> functions = identify::functions_of(*term);
  const auto step = std::find_if(functions.begin(), functions.end(), [](const identify::Factor& f) {
    return f.axis.of == identify::Covariate::kCommandCount;
  });
  ASSERT_NE(step, functions.end());
  EXPECT_EQ(step->shape, identify::Factor::Shape::kAtLeast);
  // A number between the 20th and the 21st command, or the latter.
  EXPECT_TRUE(std::any_of(step->points.begin(), step->points.end(), [](double p) { return p > 20 && p <= 21; }));
}

TEST(Products, OfDriftsHaveADirection) {
  // Towards 30 degrees, on one half of the floor, ever stronger.
  truth::Effect slope;
  slope.name = "slope";
  slope.push = [](const truth::Situation& at, truth::Push& push) {
    if (!at.driven()) return;
    const double drift_mm_s = 5 * at.time_s / 120 / (1 + std::exp(-at.disc.x / 60));
    push.drift_mm_s.x += drift_mm_s * std::cos(M_PI / 6);
    push.drift_mm_s.y += drift_mm_s * std::sin(M_PI / 6);
  };
  const truth::Scene scene = small({slope});
  const std::optional<identify::Term> term = product_of(scene, "drift-by-position-and-time");
  ASSERT_TRUE(term);
  const auto drift_at = [&](double x_mm, double time_s) {
    identify::Situation s;
    s.x_mm = x_mm;
    s.time_s = time_s;
    Eigen::Vector2d sum(0, 0);
    Eigen::Index next = 0;
    for (const identify::Block& block : term->blocks) {
      std::array<double, identify::kMostColumns> values;
      block.basis.evaluate(s, 0, values.data());
      for (std::size_t i = 0; i < block.basis.size(); ++i)
        sum[block.target == identify::Target::kWorldX ? 0 : 1] += term->coefficients[next++] * values[i];
    }
    return sum;
  };
  const Eigen::Vector2d far = drift_at(200, 110), near = drift_at(-200, 110), early = drift_at(200, 10);
  EXPECT_NEAR(std::atan2(far.y(), far.x()), M_PI / 6, 0.15);
  EXPECT_NEAR(far.norm(), 5 * 110 / 120.0 * 0.965, 0.8);
  EXPECT_LT(near.norm(), 1);
  EXPECT_LT(early.norm(), 1);
}

/// A drift of 4 mm/s, less or none in some situations.
truth::Effect drift(std::function<double(const truth::Situation&)> share) {
  truth::Effect effect;
  effect.name = "drift";
  effect.push = [share = std::move(share)](const truth::Situation& at, truth::Push& push) {
    if (at.driven()) push.drift_mm_s.y += 4 * share(at);
  };
  return effect;
}

TEST(Drifts, AreFoundByWhatTheyDependOn) {
  const std::map<std::string, truth::Effect> drifts = {
      {"drift-by-command",
       drift([](const truth::Situation& at) { return at.motion == truth::Motion::kLeft ? 1 : 0; })},
      {"drift-by-time-since-command",
       drift([](const truth::Situation& at) { return 1 - std::exp(-at.since_change_s / 3); })},
      {"drift-by-robot", drift([](const truth::Situation& at) { return at.robot % 3 == 0 ? 1 : 0; })},
  };
  for (const auto& [name, effect] : drifts) {
    auto&& [set, fitter, base] = BaseFit(small({effect}));
    const identify::Search found = identify::search(fitter, base, identify::WorkLog({}));
    ASSERT_EQ(found.fit.model.terms.size(), 1U) << name;
    EXPECT_EQ(found.fit.model.terms.front().name, name);
    EXPECT_EQ(found.reasons.front().covariates.front(), "world_frame");
  }
}

TEST(SecondLook, FindsAPatchThatSlowsSomeRobots) {
  // Beside so large an effect the threshold of the first look lets nothing pass.
  truth::Effect patch;
  patch.name = "patch of some";
  patch.push = [](const truth::Situation& at, truth::Push& push) {
    if (at.robot % 2 != 0) return;
    const double distance_mm = std::hypot(at.disc.x - 40, at.disc.y - 30);
    const double gain = 1 - 0.5 / (1 + std::pow(distance_mm / 180, 6));
    push.gain.left *= gain;
    push.gain.right *= gain;
  };
  auto&& [set, fitter, base] = BaseFit(small({patch}));
  const identify::Search found =
      identify::search(fitter, base, identify::WorkLog({}), [](const FitState&) { return true; });
  EXPECT_TRUE(std::any_of(found.reasons.begin(), found.reasons.end(), [](const identify::Reason& reason) {
    const auto is_of = [&](const char* word) {
      return std::find(reason.covariates.begin(), reason.covariates.end(), word) != reason.covariates.end();
    };
    return is_of("robot") && is_of("position");
  }));
  for (const identify::Term& term : found.fit.model.terms)
    EXPECT_EQ(term.name.find("time"), std::string::npos) << term.name;
}

TEST(TravellingWaves, AreFoundByTheirPeriodogram) {
  const truth::Scene scene = small({truth::travelling_waves()});
  auto&& [set, fitter, base] = BaseFit(scene);
  const identify::Dictionary waves = identify::wave_dictionary_of(fitter, base, identify::extent_of(base.tracks));
  ASSERT_FALSE(waves.blocks.empty());
  const std::vector<double>& numbers = waves.blocks.front().basis.factors.front().points;
  // The truth: a wavelength of 420 mm, a period of 70 s, direction (0.8, 0.6).
  EXPECT_NEAR(numbers[0], 2 * M_PI * 0.8 / 420, 0.0015);
  EXPECT_NEAR(numbers[1], 2 * M_PI * 0.6 / 420, 0.0015);
  EXPECT_NEAR(numbers[2], 2 * M_PI / 70, 0.01);
}

TEST(TravellingWaves, GetTheirNumbersByLikelihood) {
  const truth::Scene scene = small({truth::travelling_waves()});
  auto&& [set, fitter, state] = BaseFit(scene);
  const identify::Dictionary waves = identify::wave_dictionary_of(fitter, state, identify::extent_of(state.tracks));
  ASSERT_FALSE(waves.hypotheses.empty());
  identify::Term wave = waves.term_of(waves.hypotheses.front(), 1);
  // A wrong start: 8 % too long, 5 % too slow.
  std::vector<double>& start = wave.blocks.front().basis.factors.front().points;
  start = {2 * M_PI * 0.8 / 420 / 1.08, 2 * M_PI * 0.6 / 420 / 1.08, 2 * M_PI / 70 / 1.05};
  state.model.terms.push_back(wave);
  fitter.fit(state, 2);
  EXPECT_TRUE(identify::refine_wave_numbers(fitter, state, 0));
  const std::vector<double>& found = state.model.terms.front().blocks.front().basis.factors.front().points;
  EXPECT_NEAR(found[0], 2 * M_PI * 0.8 / 420, 0.00025);
  EXPECT_NEAR(found[1], 2 * M_PI * 0.6 / 420, 0.00025);
  EXPECT_NEAR(found[2], 2 * M_PI / 70, 0.0012);
}

struct Switch {
  double instant_s, gain;
};

/// Curves of each robot over time, fitted to a scene, after their simplification: by robot.
std::map<int, Switch> switches_of(const truth::Effect& effect) {
  const truth::Scene scene = small({effect});
  auto&& [set, fitter, state] = BaseFit(scene);
  const identify::Dictionary dictionary = identify::dictionary_of(identify::extent_of(state.tracks));
  const auto curves =
      std::find_if(dictionary.hypotheses.begin(), dictionary.hypotheses.end(),
                   [](const identify::Hypothesis& h) { return h.name == "speed-by-robot-and-time"; });
  if (curves == dictionary.hypotheses.end()) return {};
  state.model.terms.push_back(dictionary.term_of(*curves, 1));
  fitter.fit(state, 2);
  identify::refine_curves(fitter, state, 0);
  if (!identify::simplify_to_switch(fitter, state, 0)) return {};
  // Later refinements leave them their instants.
  identify::refine_curves(fitter, state, 0);
  std::map<int, Switch> switches;
  const identify::Term& term = state.model.terms.front();
  Eigen::Index column = 0;
  for (const identify::Block& block : term.blocks) {
    const identify::Factor &begins = block.basis.factors.at(0), &robots = block.basis.factors.at(1);
    EXPECT_EQ(begins.shape, identify::Factor::Shape::kAtLeast);
    for (const double robot : robots.points)
      switches[static_cast<int>(robot)] = {begins.points.at(0), term.coefficients[column++]};
  }
  return switches;
}

void expect_switches(const std::map<int, Switch>& found, const std::map<int, double>& instants_s) {
  for (const auto& [robot, instant_s] : instants_s) {
    ASSERT_TRUE(found.contains(robot)) << robot;
    EXPECT_NEAR(found.at(robot).instant_s, instant_s, 1.5) << robot;
    EXPECT_NEAR(found.at(robot).gain, -0.4, 0.1) << robot;
  }
  // Robots that do not fail: the speed of a robot in a part of a run is known to some per cent only.
  for (const auto& [robot, one] : found) {
    if (instants_s.contains(robot)) continue;
    EXPECT_LT(std::abs(one.gain), 0.12) << robot;
  }
}

TEST(Switches, AreOneInstantOfAllRobots) {
  const std::map<int, Switch> found = switches_of(truth::robots_that_fail());
  expect_switches(found, {{1, 83.7}, {4, 83.7}, {7, 83.7}});
  for (const auto& [robot, one] : found) EXPECT_EQ(one.instant_s, found.at(1).instant_s) << robot;
}

TEST(Switches, AreOneInstantOfEachRobot) {
  expect_switches(switches_of(truth::failures_in_turn()), {{1, 31.3}, {4, 56.3}, {7, 81.3}});
}

TEST(Uncertainty, HoldsTheTrueBiases) {
  // 40 biases, 2 of them outside on average; more than 8 in one of 2000 sets.
  truth::Scene scene = small({});
  scene.robots = 20;
  const truth::Play play = played(scene);
  auto&& [set, fitter, state] = BaseFit(set_of(scene, play));
  const identify::Uncertainty u = identify::uncertainty_of(fitter, state);
  int outside = 0;
  for (const auto& [robot, covariance] : u.biases) {
    const truth::Wheels<double>& truth = play.individuals.at(robot).bias_mm_s;
    const Eigen::Vector2d off = state.model.bias_of(robot).mean_mm_s - Eigen::Vector2d(truth.left, truth.right);
    for (int w = 0; w < 2; ++w) outside += std::abs(off[w]) > 1.96 * std::sqrt(covariance(w, w)) ? 1 : 0;
  }
  EXPECT_LE(outside, 8);
  for (int c = 0; c < identify::kBaseColumns; ++c) EXPECT_GT(u.sd(c), 0);
}

TEST(TrafficGrid, Forgets) {
  identify::TrafficGrid grid({30, 0, 0, 10});
  grid.add(0, 5, 5, 2, 0);
  EXPECT_NEAR(grid.value(0, 5, 5, 10), 2 * std::exp(-1), 1e-5);
  grid.add(1, 5, 5, 1, 10);
  EXPECT_NEAR(grid.value(0, 5, 5, 20), (2 * std::exp(-1) + 1) * std::exp(-1), 1e-5);
}

TEST(PersistentResiduals, AreNoNoise) {
  const auto share = [](const truth::Scene& scene) {
    auto&& [set, fitter, base] = BaseFit(scene);
    return identify::persistent_share(fitter, base);
  };
  EXPECT_LT(share(small({})), 0.1);
  EXPECT_GT(share(small({truth::slow_strip()})), 0.5);
}

TEST(Walls, TheLastOneFollowsFromTheOthers) {
  truth::Scene scene = small({});
  scene.width_mm = scene.height_mm = 450;
  MeasuredSet set = set_of(scene, played(scene));
  const double wall_mm = scene.height_mm / 2 - 16.5;
  // No robot comes near the lower wall.
  const auto keep = [&](double shift_mm) {
    for (identify::Run& run : set.runs)
      for (identify::Track& track : run.tracks) {
        std::erase_if(track.samples, [&](const identify::Sample& s) { return s.y_mm < -wall_mm + 15; });
        for (identify::Sample& s : track.samples) s.x_mm += shift_mm;
      }
    return identify::detected_walls(identify::PreparedSet(set), identify::MotionModel{});
  };
  const identify::Walls walls = keep(0);
  ASSERT_TRUE(std::isfinite(walls.x_low_mm) && std::isfinite(walls.x_high_mm) && std::isfinite(walls.y_high_mm));
  EXPECT_NEAR(walls.y_low_mm, -wall_mm, 1);
  // The centre of this arena is not the origin.
  EXPECT_TRUE(std::isinf(keep(30).y_low_mm));
}

TEST(Walls, TheLastOneFollowsWithoutHeadings) {
  truth::Scene scene = small({});
  scene.heading = false;
  scene.tracked_ahead_mm = 0;
  scene.width_mm = scene.height_mm = 450;
  MeasuredSet set = set_of(scene, played(scene));
  const double wall_mm = scene.height_mm / 2 - 16.5;
  // No robot comes near the lower wall.
  for (identify::Run& run : set.runs)
    for (identify::Track& track : run.tracks)
      std::erase_if(track.samples, [&](const identify::Sample& s) { return s.y_mm < -wall_mm + 25; });
  auto&& [part, fitter, base] = BaseFit(std::move(set));
  EXPECT_NEAR(base.model.walls.y_high_mm, wall_mm, 2);
  EXPECT_NEAR(base.model.walls.y_low_mm, -wall_mm, 2);
}

}  // namespace
}  // namespace kilotwin
