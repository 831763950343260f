// Laws of the robots' program, the floor's reports and the swarm.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "clients/identify/kilogrid/cell_filter.hpp"
#include "clients/identify/kilogrid/floor_statistics.hpp"
#include "clients/identify/kilogrid/floor_swarm.hpp"

namespace kilotwin::kilogrid {
namespace {

TEST(FloorProgram, GoesStraightAndTurnsForWholeSeconds) {
  FloorProgram program({}, 3);
  std::map<std::int64_t, int> turns;
  double straight = 0, straights = 0, left = 0, all = 0;
  Motion last = Motion::kStop;
  std::int64_t since = 0;
  for (std::int64_t k = 0; k < 3'000'000; ++k) {
    const Motion now = program.loop(k);
    if (now == last) continue;
    if (last == Motion::kStraight) {
      straight += static_cast<double>(k - since);
      ++straights;
    } else if (last != Motion::kStop) {
      ++turns[(k - since) / FloorProgram::kWalkTicks];
      left += last == Motion::kLeft ? 1 : 0;
      ++all;
    }
    last = now;
    since = k;
  }
  ASSERT_GT(straights, 4000);
  // Truncation to whole seconds removes half a second of 15; three standard errors.
  EXPECT_NEAR(straight / straights / FloorProgram::kWalkTicks, 14.5, 3 * 1.53 / std::sqrt(straights) + 0.1);
  EXPECT_NEAR(left / all, 0.5, 3 * 0.5 / std::sqrt(all));
  // P(|N(0.5, 3)| below a whole number of seconds), by differences of the normal distribution.
  const auto below = [](double s) {
    return 0.5 * (std::erf((s - 0.5) / 3 / std::sqrt(2)) - std::erf((-s - 0.5) / 3 / std::sqrt(2)));
  };
  for (int s = 0; s < 6; ++s) {
    const double share = below(s + 1) - below(s);
    EXPECT_NEAR(turns[s] / all, share, 3 * std::sqrt(share * (1 - share) / all) + 0.002) << s;
  }
}

TEST(FloorProgram, TurnsAtAWallAndLeavesItASecondAfterTheLastMessage) {
  FloorProgram program({}, 4);
  std::int64_t k = 0;
  for (; k < 20; ++k) EXPECT_EQ(program.loop(k), Motion::kStraight);
  program.hear_wall(k, 100);
  const Motion turning = program.loop(k);
  EXPECT_TRUE(turning == Motion::kLeft || turning == Motion::kRight);
  const std::int64_t heard = k;
  while (program.avoiding()) (void)program.loop(++k);
  EXPECT_EQ(k - heard, FloorProgram::kWallTicks + 1);
  EXPECT_EQ(program.loop(++k), turning);  // until the walk's next transition
}

TEST(FloorProgram, GoesAwayOnceReadingsGetWeaker) {
  FloorProgram program({}, 5);
  (void)program.loop(0);
  program.hear_wall(1, 100);
  (void)program.loop(1);
  std::int64_t k = 1;
  const auto hear = [&](double strength) {
    for (int i = 0; i < 4; ++i) program.hear_wall(k += 8, strength);
    return program.loop(k);
  };
  EXPECT_NE(hear(100), Motion::kStraight);
  EXPECT_NE(hear(110), Motion::kStraight);
  EXPECT_EQ(hear(90), Motion::kStraight);
  EXPECT_EQ(hear(80), Motion::kStraight);
  (void)hear(95);  // nearer again
  EXPECT_NE(program.loop(k + 1), Motion::kStraight);
}

TEST(FloorReporter, ReportsAtTheRateOfItsRange) {
  // A robot at random positions: a cell in range is polled a quarter of the time.
  const Floor floor;
  FloorRadio radio;
  radio.heard = 0.6;
  radio.heard_sd = 0;
  radio.while_talking = 1;
  radio.range_mm = 44;
  radio.blur_mm = 0.5;
  FloorReporter reporter(floor, radio, 1, 9);
  Dice dice(2);
  constexpr int kReports = 60000;
  for (int i = 0; i < kReports; ++i)
    reporter.see(0, 2.2 * i, 100 + 800 * dice.uniform(), 100 + 1800 * dice.uniform());
  const FloorRun run = reporter.take("r", 2.2 * kReports);
  const double expected = 0.6 * 3.14159265 * 44 * 44 / 2500 / 4 * kReports;
  EXPECT_NEAR(static_cast<double>(run.tracks[0].size()), expected, 0.03 * expected);
}

TEST(FloorReporter, CellsReportARobotAtRestInTurn) {
  // In the middle of a module, in range of its four cells; every report is received.
  FloorRadio radio;
  radio.heard = 1;
  radio.heard_sd = 0;
  radio.while_talking = 1;
  radio.in_turn = 1;
  radio.blur_mm = 0.1;
  for (const std::size_t pace : {std::size_t{0}, std::size_t{1}, std::size_t{2}}) {
    radio.later = {0, 0, 0, 0};
    radio.later[pace] = 1;
    FloorReporter reporter({}, radio, 1, 3);
    for (int i = 0; i < 40; ++i) reporter.see(0, 2.2 * i, 550, 1050);
    const FloorRun run = reporter.take("r", 100);
    const FloorTrack& track = run.tracks[0];
    ASSERT_GE(track.size(), 39u);
    const std::size_t period = pace == 0 ? 1 : pace == 1 ? 4 : 2;
    for (std::size_t i = 0; i + period < track.size(); ++i) {
      EXPECT_EQ(std::pair(track.x_mm[i], track.y_mm[i]), std::pair(track.x_mm[i + period], track.y_mm[i + period]));
    }
    if (pace > 0) {
      EXPECT_NE(std::pair(track.x_mm[0], track.y_mm[0]), std::pair(track.x_mm[1], track.y_mm[1]));
    }
  }
}

TEST(FloorReporter, AllRobotsAreReportedAtTheStart) {  // in the middle of a module
  FloorRadio radio;
  radio.while_talking = 0;
  constexpr std::uint32_t kRobots = 200;
  FloorReporter reporter({}, radio, kRobots, 9);
  for (int i = 0; i < 60; ++i) {
    for (std::uint32_t robot = 0; robot < kRobots; ++robot) reporter.see(robot, i * 0.5, 450, 950);
  }
  // Some bursts start within half a minute, with probability 30 / 300.
  EXPECT_GT(reporter.take("", 30).tracks.size(), 0.97 * kRobots);
}

TEST(FloorReporter, ReportingCellsAreNear) {
  const Floor floor;
  FloorRadio radio;
  radio.blur_mm = 0.1;
  FloorReporter reporter(floor, radio, 1, 1);
  for (int i = 0; i < 3000; ++i) reporter.see(0, 2.2 * i, 510, 1010);
  const FloorRun run = reporter.take("r", 6600);
  ASSERT_GT(run.tracks[0].size(), 300u);
  for (std::size_t i = 0; i < run.tracks[0].size(); ++i)
    EXPECT_LT(std::hypot(run.tracks[0].x_mm[i] - 510, run.tracks[0].y_mm[i] - 1010), radio.range_mm + 3);
}

TEST(FloorSwarm, TheNearestBoundarySectionIsFound) {
  const Floor floor;
  EXPECT_NEAR(boundary_cell_distance_mm(floor, 25, 1025), 0, 1e-12);
  EXPECT_NEAR(boundary_cell_distance_mm(floor, 65, 1025), 40, 1e-12);
  EXPECT_NEAR(boundary_cell_distance_mm(floor, 500, 1990), std::hypot(25, 15), 1e-12);
  EXPECT_EQ(boundary_section(floor, 10, 5), 0u);
  EXPECT_EQ(boundary_section(floor, 990, 15), 4u);
  EXPECT_EQ(boundary_section(floor, 990, 1985), 11u);
  EXPECT_EQ(boundary_section(floor, 15, 1990), 15u);
  EXPECT_EQ(boundary_section(floor, 5, 15), 23u);
}

FloorScene scene_of_grid(std::uint32_t robots, double duration_s) {
  FloorScene scene{"grid", duration_s, {}, {}};
  for (std::uint32_t i = 0; i < robots; ++i) {
    scene.x_mm.push_back(150 + 100 * (i % 8));
    scene.y_mm.push_back(150 + 150.0 * (i / 8));
  }
  return scene;
}

TEST(FloorSwarm, IsDeterministic) {
  proto::Model model;
  const FloorScene scene = scene_of_grid(20, 200);
  const FloorRun a = simulate(scene, {}, model, {}, {}, 5), b = simulate(scene, {}, model, {}, {}, 5),
                 c = simulate(scene, {}, model, {}, {}, 6);
  ASSERT_EQ(a.tracks.size(), b.tracks.size());
  bool differs = false;
  for (std::size_t i = 0; i < a.tracks.size(); ++i) {
    EXPECT_EQ(a.tracks[i].x_mm, b.tracks[i].x_mm);
    EXPECT_EQ(a.tracks[i].time_s, b.tracks[i].time_s);
    differs = differs || a.tracks[i].x_mm != c.tracks[i].x_mm;
  }
  EXPECT_TRUE(differs);
}

TEST(FloorStatistics, DisplacementsOfStraightTracks) {
  // Four robots at 6 mm/s along y, without blur: 60 mm in 10 s, 120 mm in 20 s. Four is the least number for a
  // mean.
  FloorRun run{"r", 250, {}, {}};
  FloorTrack track;
  for (int t = 0; t < 250; ++t) {
    track.time_s.push_back(t);
    track.x_mm.push_back(500);
    track.y_mm.push_back(200 + 6.0 * t);
  }
  run.tracks.assign(4, track);
  const FloorStatistics s = statistics_of(robot_sums(run, {}));
  const StatisticGroup& ways = statistic_group("msd");
  EXPECT_NEAR(std::sqrt(s.value[ways.first]), 60, 1e-9);
  EXPECT_NEAR(std::sqrt(s.value[ways.first + 1]), 120, 1e-9);
  EXPECT_NEAR(s.value[statistic_group("drift").first + 1], 60, 1e-9);
  const StatisticGroup& turns = statistic_group("turn");
  EXPECT_NEAR(s.value[turns.first], 1, 1e-12);
  EXPECT_NEAR(s.value[statistic_group("step").first + 7], 1, 1e-12);  // from 60 mm
}

TEST(CellFilter, TheLikelihoodIsLargestAtTheTrueSpeed) {
  const Floor floor;
  FloorSettings settings;
  settings.model.mutable_motion()->set_straight_speed_mm_s(9);
  settings.model.mutable_motion()->set_bias_sd_mm_s(0.5);
  settings.model.mutable_motion()->set_bias_mean_mm_s(0);
  settings.radio.heard = 0.9;
  settings.radio.wall_range_mm = 40;
  const FloorRun run = simulate(scene_of_grid(8, 600), floor, settings.model, settings.times, settings.radio, 3);
  std::map<double, double> likelihood;
  for (const double speed : {5.5, 9.0, 14.0}) {
    FloorSettings tried = settings;
    tried.model.mutable_motion()->set_straight_speed_mm_s(speed);
    for (std::size_t i = 0; i < run.tracks.size(); ++i)
      likelihood[speed] += filter_cells(run.tracks[i], floor, tried, 10, 80, i + 1).log_likelihood;
  }
  for (const auto& [speed, value] : likelihood) {
    if (speed != 9) {
      EXPECT_LT(value, likelihood[9]) << speed;
    }
  }
}

TEST(CellFilter, PredictsBetterThanTheLastReport) {
  const Floor floor;
  FloorSettings settings;
  settings.model.mutable_motion()->set_bias_sd_mm_s(0.8);
  settings.radio.heard = 0.9;
  const FloorRun run = simulate(scene_of_grid(8, 400), floor, settings.model, settings.times, settings.radio, 4);
  double followed = 0, still = 0, rows = 0;
  for (const FloorTrack& track : run.tracks) {
    constexpr double kSoon_s = 0.01;
    const CellFilterResult result = filter_cells(track, floor, settings, kSoon_s, 150, 1);
    for (const CellPrediction& p : result.predictions) {
      const auto i =
          static_cast<std::size_t>(std::upper_bound(track.time_s.begin(), track.time_s.end(), p.time_s - kSoon_s) -
                                   track.time_s.begin()) -
          1;
      followed += std::pow(p.x_mm - p.measured_x_mm, 2) + std::pow(p.y_mm - p.measured_y_mm, 2);
      still += std::pow(track.x_mm[i] - p.measured_x_mm, 2) + std::pow(track.y_mm[i] - p.measured_y_mm, 2);
      ++rows;
    }
  }
  ASSERT_GT(rows, 200);
  EXPECT_LT(std::sqrt(followed / rows), 0.9 * std::sqrt(still / rows));
  EXPECT_GT(std::sqrt(followed / rows), cell_noise_mm(floor, settings.radio));
}

}  // namespace
}  // namespace kilotwin::kilogrid
