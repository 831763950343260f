// Fit by simulation: recovers the generating parameters, detects a planted effect, and no other.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "clients/identify/kilogrid/fast_swarm.hpp"
#include "clients/identify/kilogrid/floor_selection.hpp"
#include "clients/identify/kilogrid/floor_sensitivity.hpp"

namespace kilotwin::kilogrid {
namespace {

FloorScene scene(std::uint32_t robots, double duration_s, int which) {
  FloorScene scene{"s" + std::to_string(which), duration_s, {}, {}};
  for (std::uint32_t i = 0; i < robots; ++i) {
    scene.x_mm.push_back(150 + 100 * (i % 8));
    scene.y_mm.push_back(250 + 30 * which + 150.0 * (i / 8));
  }
  return scene;
}

/// Runs of a model in place of measured ones.
std::vector<FloorRun> runs_of(const FloorModel& model, std::uint64_t seed) {
  std::vector<FloorRun> runs;
  for (int i = 0; i < 3; ++i) {
    const FloorSettings s = model.settings();
    runs.push_back(
        simulate(scene(40, 1000, i), {}, s.model, s.times, s.radio, seed + static_cast<std::uint64_t>(i)));
  }
  return runs;
}

FloorModel base_model() {
  FloorModel model;
  model.add(base_term());
  return model;
}

const FloorProgress kQuiet = [](const std::string& s) { puts(s.c_str()); };

TEST(FloorFit, RecoversTheSpeedAndTheRange) {
  FloorModel truth = base_model();
  truth.values[0] = 9;    // straight speed; initial value 11.3
  truth.values[2] = 1.6;  // spread of the bias; initial value 1.2
  truth.values[4] = 46;   // range; initial value 49
  const FloorTarget target(runs_of(truth, 100), {});
  FloorModel model = base_model();
  const double before = target.misfit(simulated_statistics(target, model.settings(), 1));
  const double after = fit(model, target, 3, 1, 7, kQuiet);
  EXPECT_LT(after, 0.7 * before);
  EXPECT_NEAR(model.values[0], 9, 1.2);
  EXPECT_NEAR(model.values[4], 46, 2.8);
  // Standard errors say how far off the values are, and fall as runs are added.
  const std::vector<double> sd = standard_errors(model, target, 3);
  // Fits of these runs with six other seeds scatter by this much, for they end in the noise of their own simulations.
  const std::map<std::size_t, double> scatter{{0, 0.12}, {2, 0.12}, {4, 1.2}};
  for (const auto& [p, of_fit] : scatter) {
    EXPECT_LT(std::abs(model.values[p] - truth.values[p]), 4 * std::hypot(sd[p], of_fit)) << p;
    EXPECT_LT(sd[p], model.parameters()[p].width) << p;
  }
  std::vector<FloorRun> more = runs_of(truth, 100);
  for (const FloorRun& run : runs_of(truth, 300)) more.push_back(run);
  for (const FloorRun& run : runs_of(truth, 500)) more.push_back(run);
  const std::vector<double> less = standard_errors(model, FloorTarget(more, {}), 3);
  EXPECT_LT(less[0], 0.85 * sd[0]);
  EXPECT_LT(less[4], 0.85 * sd[4]);
}

TEST(FloorFit, ConvergesFromAFarStart) {
  // Three to five scales from the initial values, in parameters that partly compensate for each other.
  FloorModel truth = base_model();
  truth.values[1] = 27;   // turning; initial value 19
  truth.values[7] = 38;   // range of the walls; initial value 52
  truth.values[8] = 1.5;  // rate of their messages; initial value 3.5
  truth.values[9] = 15;   // noise of these; initial value 4
  const FloorTarget target(runs_of(truth, 500), {});
  const auto misfit = [&](const FloorModel& of) {
    return target.misfit(simulated_statistics(target, of.settings(), 1, 2));
  };
  FloorModel model = base_model();
  const double before = misfit(model);
  fit_from_far_start(model, target, 3, kQuiet);
  const double after = misfit(model), best = misfit(truth);
  EXPECT_GT(before, 3 * best);
  // Three quarters of the reduction to the misfit of the truth; finer steps complete it.
  EXPECT_LT(after - best, 0.25 * (before - best));
}

TEST(FloorTarget, CutIsTheBeginningOfEachRun) {
  const std::vector<FloorRun> runs = runs_of(base_model(), 600);
  const FloorTarget target(runs, {}), begun = target.cut(400);
  ASSERT_EQ(begun.scenes().size(), runs.size());
  const StatisticGroup& by_time = statistic_group("step-by-time");  // in 5 minutes
  for (std::size_t r = 0; r < runs.size(); ++r) {
    EXPECT_EQ(begun.scenes()[r].duration_s, 400);
    EXPECT_EQ(begun.set().runs[r].size(), target.set().runs[r].size());
    for (std::size_t i = 0; i < begun.set().runs[r].size(); ++i) {
      EXPECT_EQ(begun.set().runs[r][i].sum[by_time.first], target.set().runs[r][i].sum[by_time.first]);
      EXPECT_EQ(begun.set().runs[r][i].weight[by_time.first + 2], 0);
    }
  }
}

TEST(FloorTarget, PoolsTheSelectedRuns) {
  const FloorTarget target(runs_of(base_model(), 700), {});
  const auto& runs = target.set().runs;
  std::vector<RobotSums> first_and_last = runs[0];
  first_and_last.insert(first_and_last.end(), runs[2].begin(), runs[2].end());
  const FloorStatistics all = pooled(runs), some = pooled(runs, [](std::size_t run) { return run != 1; });
  const StatisticGroup& msd = statistic_group("msd");
  EXPECT_EQ(some.value[msd.first], statistics_of(first_and_last).value[msd.first]);
  EXPECT_EQ(all.value[msd.first], target.statistics().value[msd.first]);
  EXPECT_NE(all.value[msd.first], some.value[msd.first]);
}

/// A subset of the candidates: each costs simulations.
std::vector<FloorTerm> some_candidates() {
  std::vector<FloorTerm> some;
  for (const FloorTerm& term : candidate_terms({})) {
    if (term.name == "speed-of-robots" || term.name == "drift" || term.name == "middle") some.push_back(term);
  }
  return some;
}

TEST(FloorSelection, NoEffectInTheModelsOwnRuns) {
  const FloorModel truth = base_model();
  const FloorTarget without(runs_of(truth, 200), {});
  const Selection choice = choose(truth, some_candidates(), without, 5, kQuiet);
  EXPECT_FALSE(choice.found());
  // Sets simulated by the model deviate from it like other simulated sets: 320 correlated statistics, whose sum of
  // squares varies by about a tenth.
  EXPECT_NEAR(choice.misfit / choice.by_chance, 1, 0.4);
  for (const CandidateScore& score : choice.scores) EXPECT_LT(score.gain, score.needed);
}

TEST(FloorSelection, FindsAPlantedEffect) {
  FloorModel truth = base_model();
  const std::vector<FloorTerm> candidates = some_candidates();
  truth.add(candidates[0]);
  // Spread of speeds; the last is the skewness. With less, chance decides whether the drift to the middle explains more.
  truth.values[truth.values.size() - 2] = 0.6;
  const FloorTarget with(runs_of(truth, 300), {});
  const Selection choice = choose(base_model(), candidates, with, 5, kQuiet);
  ASSERT_TRUE(choice.found());
  EXPECT_EQ(candidates[choice.best].name, "speed-of-robots");
  EXPECT_GT(choice.scores[0].gain, choice.scores[0].needed);
  EXPECT_GT(choice.scores[0].values[0], 0.1);
}

TEST(FloorSelection, AnEffectInOneRunOnlyIsNotAccepted) {
  const FloorModel base = base_model();
  const std::vector<FloorTerm> candidates = some_candidates();
  FloorModel odd = base;
  odd.add(candidates[0]);
  odd.values[odd.values.size() - 2] = 0.5;  // spread of speeds
  std::vector<FloorRun> runs = runs_of(base, 400);
  runs[1] = runs_of(odd, 400)[1];
  const Selection choice = choose(base, candidates, FloorTarget(runs, {}), 5, kQuiet);
  ASSERT_EQ(choice.scores[0].by_run.size(), 3u);
  EXPECT_FALSE(choice.found());
}

TEST(CandidateScore, HelpsHeldOutRunsInTotalAndInThreeOfFour) {
  const auto helps = [](std::vector<double> by_run) {
    return CandidateScore{1, 1, 1, by_run, {}, 0}.helps_held_out();
  };
  EXPECT_TRUE(helps({}));  // not defined for fewer than three runs
  EXPECT_TRUE(helps({3, 1, 2}));
  EXPECT_FALSE(helps({9, 9, -1}));
  EXPECT_TRUE(helps({3, 1, 2, -1}));
  EXPECT_FALSE(helps({3, 1, 2, -7}));
  EXPECT_FALSE(helps({9, 9, -1, -1}));
}

TEST(CandidateScore, ConsistencyOverRunsIsATTest) {
  const auto alike = [](std::vector<double> by_run) {
    return CandidateScore{1, 1, 1, by_run, {}, 0}.consistent_over_runs();
  };
  EXPECT_FALSE(alike({}));
  EXPECT_FALSE(alike({5, 5}));
  // Student's t: 7.4, above the 1 % bound of 4.54 for four runs; then 2.7 and 3.2.
  EXPECT_TRUE(alike({23, 36, 43, 28}));
  EXPECT_FALSE(alike({10, 2, 24, 25}));
  EXPECT_FALSE(alike({9, 30, 8, 19}));
  // Three runs: the bound is 6.97. These have 8.7 and 5.2.
  EXPECT_TRUE(alike({4, 5, 6}));
  EXPECT_FALSE(alike({2, 3, 4}));
  EXPECT_FALSE(alike({30, 31, 32, -0.1}));
}

TEST(CandidateScore, UnexplainedMisfitCountsUnlessRunsAgree) {
  const double bound = 10;
  const auto beyond = [&](double evidence, double uncorrected_evidence, std::vector<double> by_run) {
    return CandidateScore{1, 1, evidence, by_run, {}, uncorrected_evidence}.beyond(bound);
  };
  EXPECT_TRUE(beyond(11, 40, {9, 30, 8, 19}));
  EXPECT_FALSE(beyond(9, 40, {9, 30, 8, 19}));
  EXPECT_TRUE(beyond(9, 40, {23, 36, 43, 28}));
  EXPECT_FALSE(beyond(3, 9, {23, 36, 43, 28}));
  EXPECT_FALSE(beyond(11, 40, {23, 36, -43, -28}));
}

TEST(FloorSensitivity, FollowsTheNearPoints) {
  FloorModel model = base_model();
  std::vector<bool> moves(model.values.size(), false);
  moves[0] = moves[4] = true;
  const std::vector<FloorParameter> parameters = model.parameters();
  FloorPoints points;
  Dice dice(3);
  for (std::size_t i = 0; i < 400; ++i) {
    // Every second point is far away, where the statistics are nonlinear.
    const double reach = i % 2 == 0 ? 1 : 6;
    std::vector<double> at = model.values, steps(2);
    for (std::size_t p = 0; p < 2; ++p) {
      steps[p] = reach * (2 * dice.uniform() - 1);
      at[4 * p] += steps[p] * parameters[4 * p].width;
    }
    points.values.push_back(at);
    points.run.push_back(i % 3);
    std::vector<double> said(statistic_count(), 0);
    said[0] = 5 + 2 * steps[0] - steps[1] + (reach > 1 ? 0.5 * steps[0] * steps[0] * steps[0] : 0);
    said[0] += 7.0 * static_cast<double>(i % 3) + 0.2 * dice.normal();
    points.said.push_back(said);
  }
  const Eigen::MatrixXd slopes = slopes_of(points, model, moves, 3, 1);
  // Two hundred near points with mean square one third and a ridge of 2 %: 0.02 for noise and 6 % for the ridge. A
  // tenth of the others is near enough to contribute.
  EXPECT_NEAR(slopes(0, 0), 2, 0.35);
  EXPECT_NEAR(slopes(0, 4), -1, 0.2);
  EXPECT_EQ(slopes(1, 0), 0);
  EXPECT_EQ(slopes(0, 2), 0);
}

const FloorTerm& term_of(const std::vector<FloorTerm>& terms, const std::string& name) {
  return *std::find_if(terms.begin(), terms.end(), [&](const FloorTerm& t) { return t.name == name; });
}

TEST(FloorModel, ADriftToTheMiddleActsAlongItsAxis) {
  const std::vector<FloorTerm> candidates = candidate_terms({});
  FloorModel model = base_model();
  const auto said = [&](const FloorModel& of) {
    std::vector<RobotSums> all;
    for (int i = 0; i < 4; ++i) {
      const FloorRun run = simulate_fast(scene(40, 1500, i), {}, of.settings(), 20 + static_cast<std::uint64_t>(i));
      for (RobotSums& robot : robot_sums(run, {})) all.push_back(std::move(robot));
    }
    return statistics_of(all);
  };
  const FloorStatistics none = said(model);
  model.add(term_of(candidates, "to-the-middle"));
  model.values[model.values.size() - 2] = 1.6;  // along x
  const FloorStatistics drift = said(model);
  const auto more = [&](const char* group, std::size_t i) {
    const std::size_t s = statistic_group(group).first + i;
    return (drift.value[s] - none.value[s]) / std::sqrt(drift.variance[s] + none.variance[s]);
  };
  // In standard errors: the middle two tenths of the width hold more robots, the outer ones fewer; no change along
  // the other axis.
  EXPECT_GT(more("occupancy-along-x", 4), 3);
  EXPECT_GT(more("occupancy-along-x", 5), 3);
  EXPECT_LT(more("occupancy-along-x", 1), -2);
  EXPECT_LT(more("occupancy-along-x", 8), -2);
  EXPECT_LT(std::abs(more("occupancy-along-y", 4)), 4);
  EXPECT_LT(std::abs(more("way-to-the-middle-along-y", 2)), 4);
}

TEST(FloorModel, WallsAreRecordsThatActBesideThem) {
  FloorModel model = base_model();
  model.wall.emplace().fill(1);
  (*model.wall)[0] = 0.25;  // lower wall, left end
  (*model.wall)[11] = 0.5;  // right wall, top
  const FloorSettings settings = model.settings();
  ASSERT_EQ(settings.model.effect_size(), 4);
  EXPECT_EQ(settings.model.effect(0).name(), "wall-bottom");
  EXPECT_NEAR(settings.model.effect(0).function(1).steps().value(0), -0.75, 1e-12);
  EXPECT_NEAR(settings.model.effect(1).function(1).steps().value(7), -0.5, 1e-12);
  EXPECT_EQ(settings.model.effect(1).function(0).steps().at(0), 500 - FloorModel::kBeside_mm);
}

TEST(FloorModel, IndividualStraightSpeedsKeepTurns) {
  const std::vector<FloorTerm> candidates = candidate_terms({});
  FloorModel model = base_model();
  model.values[2] = model.values[3] = 0;  // no bias, no noise
  model.add(term_of(candidates, "straight-speed-of-robots"));
  model.values[model.values.size() - 2] = 3;
  const FloorSettings settings = model.settings();
  ASSERT_EQ(settings.model.effect_size(), 1);
  const proto::Effect& effect = settings.model.effect(0);
  EXPECT_EQ(effect.acts_on(), proto::Effect::WHEEL_OFFSET);
  ASSERT_EQ(effect.during_size(), 1);
  EXPECT_EQ(effect.during(0), proto::STRAIGHT);
  double sum = 0, squares = 0;
  const proto::Table& table = effect.function(0).table();
  for (const double value : table.value()) {
    sum += value;
    squares += value * value;
    EXPECT_GT(settings.model.motion().straight_speed_mm_s() + value, 0);  // no negative speeds
  }
  const double count = table.value_size();
  EXPECT_NEAR(sum / count, 0, 0.1);
  EXPECT_NEAR(std::sqrt(squares / count), 3, 0.2);
}

}  // namespace
}  // namespace kilotwin::kilogrid
