// Reading measured grids, simulating them, and recovering the parameters of simulated grids.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "clients/identify/radio/grid_run.hpp"
#include "clients/identify/radio/link_fit.hpp"
#include "clients/identify/radio/link_intervals.hpp"
#include "clients/identify/radio/scores.hpp"
#include "core/base/error.hpp"
#include "core/random/random.hpp"

namespace kilotwin::radio_fit {
namespace {

GridSet grid(int robots, double tau_s, double pitch_mm) {
  GridSet set;
  set.name = "made";
  set.tau_s = tau_s;
  set.pitch_mm = pitch_mm;
  set.runs.push_back({"size", Eigen::MatrixXd::Zero(robots, robots)});
  return set;
}

proto::Radio lone_radio() {
  proto::Radio radio;
  radio.set_model(proto::Radio::DISC);
  radio.set_range_mm(50);
  return radio;
}

/// Out of range of each other, robots send one message per 16 of their 4800 kilo_ticks.
TEST(GridRun, IsolatedRobotsSend300) {
  const GridRun run = simulate(grid(4, 0, 500), lone_radio(), 3);
  for (int i = 0; i < 4; ++i) EXPECT_EQ(run.sent(i), 300);
  EXPECT_EQ(run.counts.sum(), 4 * 300);
}

/// A pause matters only if it exceeds the firmware's own period.
TEST(GridRun, PausesAfterSuccess) {
  EXPECT_EQ(simulate(grid(4, 0.25, 500), lone_radio(), 3).sent(0), 300);
  EXPECT_LT(simulate(grid(4, 1, 500), lone_radio(), 3).sent(0), 160);
}

TEST(GridData, ReadsBothFormsAndSkipsTruncatedLines) {
  const std::filesystem::path directory =
      std::filesystem::path(::testing::TempDir()) / ("grids-" + std::to_string(getpid()));
  std::filesystem::create_directories(directory);
  std::ofstream(directory / "comm_tau000_run000.dat") << "0 9 1 2 3\n1 4 9 5 6\n2 7 8 9 1\n3 1 1 1 9\n";
  std::ofstream(directory / "comm_tau000_run001.dat") << "9 1 2 3\n4 9 5 6\n7 8\n1 1 1 9\n";
  std::ofstream(directory / "notes.txt") << "nothing\n";
  const std::vector<GridSet> sets = read_grids(directory);
  ASSERT_EQ(sets.size(), 1u);
  ASSERT_EQ(sets[0].runs.size(), 2u);
  EXPECT_EQ(sets[0].pitch_mm, 33);
  EXPECT_EQ(sets[0].runs[0].counts(1, 2), 5);
  EXPECT_EQ(sets[0].runs[1].counts(1, 2), 5);
  EXPECT_LT(sets[0].runs[1].share(2, 0), 0);
  EXPECT_NEAR(sets[0].runs[0].share(1, 0), 4.0 / 9, 1e-12);
  EXPECT_NEAR(sets[0].distance_mm(0, 3), 33 * std::sqrt(2.0), 1e-12);
  std::ofstream(directory / "comm_tau000_run002.dat") << "9 1 2 3\n4 9 x 6\n";
  EXPECT_THROW(static_cast<void>(read_grids(directory)), UserError);
  std::filesystem::remove_all(directory);
  EXPECT_THROW(static_cast<void>(read_grids(directory)), UserError);
}

/// The likelihood is largest under the generating model.
TEST(Scores, PreferTheGeneratingModel) {
  proto::Radio near = lone_radio(), far = lone_radio();
  near.set_range_mm(60);
  far.set_range_mm(110);
  const GridSet set = grid(16, 0, 40);
  const GridSet data = simulate(set, near, 3, 1), same = simulate(set, near, 6, 50),
                other = simulate(set, far, 6, 50);
  EXPECT_GT(log_likelihood(data, same), log_likelihood(data, other) + 1);
  const Errors errors = compare(data, same, same);
  EXPECT_NEAR(errors.sent, 0, 1);
  EXPECT_LT(errors.near_worst, 0.06);  // few runs
  EXPECT_EQ(errors.deficit, 0);
}

/// Only runs differ.
proto::Radio radio_of_equal_robots() {
  proto::Radio radio;
  radio.set_model(proto::Radio::PROPAGATION);
  radio.set_range_mm(128);
  proto::Propagation& model = *radio.mutable_propagation();
  model.set_power_sd_db(0);
  model.set_sensitivity_sd_db(0);
  model.set_power_bearing_sd_db(0);
  model.set_sensitivity_bearing_sd_db(0);
  model.set_link_sd_db(0);
  model.set_run_sd_db(0.8);
  return radio;
}

/// Margins and one deaf robot are recovered. Range and pattern are identified by their priors only: on a grid with
/// few bearings they are confounded.
TEST(LinkFit, RecoversItsParameters) {
  proto::Radio radio = radio_of_equal_robots();
  proto::Propagation& model = *radio.mutable_propagation();
  proto::RobotRadio& deaf = *model.add_robot();
  deaf.set_robot(4);
  deaf.set_sensitivity_db(-2.5);
  const GridSet set = simulate(grid(16, 0, 40), radio, 6, 1);
  const LinkModel found = fit_links({set}, Terms::kRobots);
  double sum = 0, links = 0;
  for (int i = 0; i < 16; ++i) {
    for (int j = 0; j < 16; ++j) {
      const double margin_db = 0.139 * (128 - set.distance_mm(i, j)) - (i == 4 ? 2.5 : 0);
      if (i == j || std::isnan(found.swarms[0].margin_db(i, j)) || std::abs(margin_db) > 2) continue;
      sum += found.swarms[0].margin_db(i, j) - margin_db;
      links += 1;
    }
  }
  ASSERT_GT(links, 30);
  EXPECT_NEAR(sum / links, 0, 0.5);
  EXPECT_LT(found.swarms[0].sensitivity_db(4), -1.2);
  EXPECT_LT(found.swarms[0].sensitivity_db(4), found.swarms[0].power_db.minCoeff() - 0.5);
}

TEST(LinkIntervals, HoldTheSpreadOfRobots) {
  proto::Radio radio = radio_of_equal_robots();
  proto::Propagation& model = *radio.mutable_propagation();
  model.set_pair_sd_db(0);
  constexpr std::uint64_t kSets = 8;
  int holds = 0;
  for (std::uint64_t k = 0; k < kSets; ++k) {
    // The same robots in all runs of a set.
    const Random random(k + 1);
    model.clear_robot();
    for (std::uint32_t r = 0; r < 16; ++r) {
      proto::RobotRadio& robot = *model.add_robot();
      robot.set_robot(r);
      robot.set_power_db(0.9 * random.normal(Stream::kLink, r, Tick{0}, 0));
      robot.set_sensitivity_db(1.1 * random.normal(Stream::kLink, r, Tick{0}, 1));
    }
    const std::vector<GridSet> sets{simulate(grid(16, 0, 40), radio, 6, 1 + 100 * k)};
    for (const identification::Estimate& number : numbers_of(fit_links(sets, Terms::kRobots), sets, 2)) {
      const double truth = number.name() == "sd of power over robots"         ? 0.9
                           : number.name() == "sd of sensitivity over robots" ? 1.1
                                                                              : -1;
      if (truth < 0) continue;
      EXPECT_LT(number.low(), number.value());
      EXPECT_LT(number.high() - number.low(), 3) << "an interval that says something";
      holds += number.low() <= truth && truth <= number.high() ? 1 : 0;
    }
  }
  // Of 16 intervals 15.2 are expected; fewer than 12 with a probability of 0.1 %.
  EXPECT_GE(holds, 12);
}

}  // namespace
}  // namespace kilotwin::radio_fit
