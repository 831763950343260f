// The simulation check: the model that generated the tracks agrees; without its effect it does not.
#include "clients/identify/replay/simulation_check.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "clients/identify/identify.hpp"
#include "clients/identify/model/model_file.hpp"
#include "clients/identify/replay/replay.hpp"
#include "clients/identify/replay/track_statistics.hpp"
#include "core/random/random.hpp"

namespace kilotwin::identify {
namespace {

/// Commands: straight and turns alternately, of random durations. Sample times twice a second, without positions.
MeasuredSet commanded(std::uint32_t robots, std::uint32_t runs, double duration_s, std::uint64_t seed) {
  const Random random(seed);
  MeasuredSet set;
  set.has_commands = set.has_headings = true;
  for (std::uint32_t run = 0; run < runs; ++run) {
    set.runs.push_back({"run" + std::to_string(run), {}});
    for (std::uint32_t robot = 0; robot < robots; ++robot) {
      Track& track = set.runs.back().tracks.emplace_back();
      // Robot numbers have gaps.
      track.robot = 3 + 2 * robot;
      track.commands.push_back({-1e300, Motion::kStop});
      std::uint32_t draw = 0;
      const auto uniform = [&] { return random.uniform(Stream::kLayout, run * 1000 + robot, Tick{0}, draw++); };
      for (double t = 0.3; t < duration_s;) {
        const bool straight = track.commands.back().motion != Motion::kStraight;
        track.commands.push_back({t, straight          ? Motion::kStraight
                                     : uniform() < 0.5 ? Motion::kLeft
                                                       : Motion::kRight});
        t += straight ? 6 + 6 * uniform() : 1 + 2 * uniform();
      }
      const double x = 400.0 * (robot % 4) - 600, y = 400.0 * (robot / 4) - 400;
      for (double t = 0; t <= duration_s; t += 0.5) track.samples.push_back({t, x, y, 0.7 * robot});
    }
  }
  return set;
}

/// A model with all base parameters, in which robots slow down to 60 % with a time constant of 40 s.
MotionModel slowing(std::uint32_t robots, double share) {
  MotionModel model;
  model.noise.position_mm2 = 0.25;
  model.noise.heading_rad2 = 1e-3;
  model.walls = {-800, 800, -700, 700};
  model.base.ahead_mm = kAxleOffset_mm - 4;
  const Random random(5);
  for (std::uint32_t robot = 0; robot < robots; ++robot) {
    RobotBias& bias = model.robots[3 + 2 * robot];
    for (std::uint32_t wheel = 0; wheel < 2; ++wheel)
      bias.mean_mm_s[wheel] = 1.2 * random.normal(Stream::kWheelBias, robot, Tick{0}, wheel);
  }
  if (share == 0) return model;
  Factor factor;
  factor.shape = Factor::Shape::kExponential;
  factor.axis.of = Covariate::kTime;
  factor.points = {40};
  model.terms.push_back({"slowing",
                         {{Target::kGain, Basis{}}, {Target::kGain, Basis{{factor}}}},
                         Eigen::Vector2d(-share, share),
                         Eigen::Vector2d(1, 1)});
  return model;
}

/// The set with tracks of robots of a model.
void perform(MeasuredSet& set, const MotionModel& model, std::uint64_t seed) {
  PreparedSet prepared(set);
  prepared.find_headings(model, 1);
  std::vector<std::vector<std::vector<Sample>>> samples;
  for (std::size_t run = 0; run < set.runs.size(); ++run)
    samples.push_back(play(scene_of(model, prepared, run), proto_of(model), seed + run));
  for (std::size_t run = 0; run < set.runs.size(); ++run)
    for (std::size_t t = 0; t < set.runs[run].tracks.size(); ++t) set.runs[run].tracks[t].samples = samples[run][t];
}

identification::Identification checked(MeasuredSet& set, const MotionModel& base, const MotionModel& full) {
  PreparedSet prepared(set);
  const proto::Model written_base = proto_of(base), written_full = proto_of(full);
  identification::Identification found;
  add_simulation_check({base, written_base}, {full, written_full}, prepared, Tracks::kAll, 2, found);
  return found;
}

TEST(SimulationCheck, TheGeneratingModelAgrees) {
  MeasuredSet set = commanded(12, 2, 120, 3);
  const MotionModel truth = slowing(12, 0.4), without = slowing(12, 0);
  perform(set, truth, 77);
  const identification::Identification found = checked(set, without, truth);
  const identification::Simulated& simulated = found.result().simulated();
  EXPECT_TRUE(simulated.agrees().bool_value()) << simulated.DebugString();
  EXPECT_EQ(simulated.units(), 12U);
  bool speed_differs = false;
  for (const identification::SimulatedStatistic& s : simulated.statistics())
    if (s.name() == "mean speed over the run")
      speed_differs = s.base_p() < 0.01 && s.base_distance() > 5 * s.distance();
  EXPECT_TRUE(speed_differs) << simulated.DebugString();
  EXPECT_TRUE(found.has_msd() && !found.distributions().empty() && found.has_speed_over_time());
  // With exchanged roles the full model differs.
  const auto exchanged = checked(set, truth, without).result().simulated().agrees();
  EXPECT_TRUE(exchanged.has_bool_value() && !exchanged.bool_value());
}

TEST(SimulationCheck, FalseAlarmRate) {
  // Under the null hypothesis a statistic differs with probability 1 %: of 24 sets with six statistics, 1.4 on
  // average; more than 6 with probability below 0.001.
  const MotionModel truth = slowing(8, 0.4);
  int alarms = 0;
  for (std::uint64_t seed = 0; seed < 24; ++seed) {
    MeasuredSet set = commanded(8, 1, 60, 100 + seed);
    perform(set, truth, 1000 * seed + 500);
    const identification::Identification found = checked(set, truth, truth);
    for (const identification::SimulatedStatistic& s : found.result().simulated().statistics())
      alarms += s.p() < 0.01 ? 1 : 0;
  }
  EXPECT_LE(alarms, 6);
}

TEST(SimulationCheck, IsDeterministic) {
  MeasuredSet set = commanded(8, 1, 40, 9);
  const MotionModel truth = slowing(8, 0.4), without = slowing(8, 0);
  perform(set, truth, 7);
  EXPECT_EQ(checked(set, without, truth).SerializeAsString(), checked(set, without, truth).SerializeAsString());
}

TEST(Replay, RobotsStartAtTheirMeasuredPoses) {
  MeasuredSet set = commanded(9, 1, 10, 4);
  MotionModel model = slowing(9, 0.4);
  model.noise.position_mm2 = 1e-8;
  model.noise.heading_rad2 = 1e-10;
  PreparedSet prepared(set);
  prepared.find_headings(model, 1);
  const Scene scene = scene_of(model, prepared, 0);
  const auto seen = play(scene, proto_of(model), 1);
  for (std::size_t r = 0; r < seen.size(); ++r) {
    const Sample& first = set.runs[0].tracks[r].samples.front();
    ASSERT_EQ(seen[r].size(), set.runs[0].tracks[r].samples.size());
    EXPECT_NEAR(seen[r][0].x_mm, first.x_mm, 0.01);
    EXPECT_NEAR(seen[r][0].y_mm, first.y_mm, 0.01);
    EXPECT_NEAR(wrapped_angle(seen[r][0].heading_rad - first.heading_rad), 0, 1e-3);
    // Four mm behind the disc centre.
    EXPECT_NEAR(std::hypot(scene.robots[r].x_mm - first.x_mm, scene.robots[r].y_mm - first.y_mm), 4, 0.01);
  }
}

TEST(Replay, WallsStopRobotsAtTheFittedLines) {
  // An arena that does not contain the origin.
  MeasuredSet set;
  set.has_commands = set.has_headings = true;
  set.runs.push_back({"r", {}});
  for (std::uint32_t robot = 0; robot < 4; ++robot) {
    Track& track = set.runs[0].tracks.emplace_back();
    track.robot = robot;
    track.commands = {{-1e300, Motion::kStop}, {0, Motion::kStraight}};
    const double x[] = {700, 750, 500, 450}, y[] = {450, 560, 600, 480};
    for (double t = 0; t <= 40; t += 1) track.samples.push_back({t, x[robot], y[robot], M_PI / 2 * robot});
  }
  MotionModel model;
  model.walls = {400, 800, 400, 640};
  model.noise.position_mm2 = 1e-8;
  model.base.bias_sd_mm_s = 0;
  PreparedSet prepared(set);
  prepared.find_headings(model, 1);
  const auto seen = play(scene_of(model, prepared, 0), proto_of(model), 1);
  EXPECT_NEAR(seen[0].back().x_mm, 800, 2);
  EXPECT_NEAR(seen[1].back().y_mm, 640, 2);
  EXPECT_NEAR(seen[2].back().x_mm, 400, 2);
  EXPECT_NEAR(seen[3].back().y_mm, 400, 2);
}

TEST(TrackStatistics, DistancesMatchTheirDefinitions) {
  const Statistic histogram{Statistic::Kind::kHistogram, "h", "", {0, 1, 2, 3}, ""};
  // All mass one bin further: the 1-Wasserstein distance is one bin.
  EXPECT_DOUBLE_EQ(distance(histogram, {{0, 0, 0}, {4, 2, 0}}, {{0, 0, 0}, {0, 2, 1}}), 1);
  const Statistic means{Statistic::Kind::kMeans, "m", "", {0, 1}, ""};
  EXPECT_DOUBLE_EQ(distance(means, {{4, 6}, {2, 3}}, {{5, 3}, {1, 1}}), 2);
  const Statistic squares{Statistic::Kind::kSquares, "s", "", {1}, ""};
  EXPECT_NEAR(distance(squares, {{2}, {1}}, {{6}, {1}}), std::log(3), 1e-12);
}

}  // namespace
}  // namespace kilotwin::identify
