// Parts of the monitor: evidence, starts, declared commands, the text of alarms.
#include "clients/monitor/evidence.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <set>

#include "clients/monitor/command_table.hpp"
#include "clients/monitor/hypotheses.hpp"
#include "clients/monitor/start_grid.hpp"
#include "core/base/error.hpp"

namespace kilotwin::monitor {
namespace {

TEST(Evidence, AStartReachesTheThresholdAsSeldomAsVillesInequalitySays) {
  std::mt19937_64 random(2);
  std::normal_distribution<double> normal;
  constexpr int kStarts = 20'000, kSteps = 300;
  constexpr double kThreshold = 3;
  int reached = 0;
  for (int start = 0; start < kStarts; ++start) {
    Sums sums;
    for (int k = 0; k < kSteps; ++k) {
      const double d = 1 + std::sin(0.1 * k);
      sums.score[0] += d * normal(random);
      sums.information[0] += d * d;
      if (evidence(sums, {{0.5}}, 1) < kThreshold) continue;
      ++reached;
      break;
    }
  }
  const double share = static_cast<double>(reached) / kStarts, bound = std::exp(-kThreshold);
  EXPECT_LT(share, bound + 4 * std::sqrt(bound / kStarts));
  EXPECT_GT(share, bound / 5) << "the bound is not empty";
}

TEST(Evidence, TwoIndependentSizesHaveTheSumOfTheirEvidence) {
  const Sums one{1, {3}, {4}}, other{1, {-5}, {2}};
  const Sums both{2, {3, -5}, {4, 0, 0, 2}};
  EXPECT_NEAR(evidence(both, {{0.7, 1.5}}, 1.3), evidence(one, {{0.7}}, 1.3) + evidence(other, {{1.5}}, 1.3),
              1e-12);
  EXPECT_GE(evidence_bound(both, {{0.7, 1.5}}, 1), evidence(both, {{0.7, 1.5}}, 1));
  const auto found = sizes(both, {{0.7, 1.5}}, 1);
  EXPECT_NEAR(found[0].value, 3 / (4 + 1 / 0.49), 1e-12);
  EXPECT_NEAR(found[1].standard_error, 1 / std::sqrt(2 + 1 / 2.25), 1e-12);
}

TEST(Evidence, TheThresholdIsTheLogarithmOfTestsPerFalseAlarm) {
  EXPECT_NEAR(threshold_nat(100, 1, 0.1), std::log(100 * 3600 / 0.1), 1e-12);
  EXPECT_NEAR(threshold_nat(100, 1, 0.01) - threshold_nat(100, 1, 0.1), std::log(10), 1e-12);
}

TEST(StartGrid, StartsCoverTheirAgesEvenlyAndAreNeverMoved) {
  StartGrid grid(32, 3662);
  std::set<std::int64_t> begun;
  for (std::int64_t tick = 0; tick < 20'000; ++tick) {
    if (grid.advance(Tick{tick})) begun.insert(tick);
    if (tick < 4000) continue;
    std::vector<double> ages;
    for (std::size_t slot = 0; slot < StartGrid::kSlots; ++slot) {
      ASSERT_TRUE(grid.is_used(slot));
      ASSERT_TRUE(begun.contains(grid.begin(slot).count()));
      ages.push_back(static_cast<double>(tick - grid.begin(slot).count()) + 32);
    }
    std::sort(ages.begin(), ages.end());
    for (std::size_t i = 1; i < ages.size(); ++i) ASSERT_LE(ages[i] / ages[i - 1], 2.5) << tick;
    ASSERT_GT(ages.back(), 1800) << "about a minute at least";
  }
}

TEST(CommandTable, HoldsEachCommandUntilTheNext) {
  const CommandTable table("commands.csv", "run,robot,time_s,motion\na,3,2,left\na,3,0.5,straight\na,7,1,right\n");
  EXPECT_EQ(table.robots(), (std::vector<std::uint32_t>{3, 7}));
  EXPECT_EQ(table.at(3, 0.4), MotionCommand::kStop);
  EXPECT_EQ(table.at(3, 0.5), MotionCommand::kStraight);
  EXPECT_EQ(table.at(3, 1e9), MotionCommand::kTurnLeft);
  EXPECT_EQ(table.at(8, 5), MotionCommand::kStop);
  const Calibration calibration{61, 62, 63, 64};
  EXPECT_EQ(command_of(duties_of(MotionCommand::kTurnLeft, calibration)), MotionCommand::kTurnLeft);
  EXPECT_EQ(duties_of(MotionCommand::kTurnRight, calibration).right, 62);
}

TEST(CommandTable, ErrorsNameTheirPlace) {
  const auto error_of = [](const std::string& content) -> std::string {
    try {
      const CommandTable table("commands.csv", content);
    } catch (const UserError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_TRUE(error_of("robot,time_s,motion\n1,0,forward\n").starts_with("commands.csv:2:5: ")) << error_of("x");
  EXPECT_NE(error_of("robot,time_s\n1,0\n").find("motion"), std::string::npos);
  EXPECT_NE(error_of("run,robot,time_s,motion\na,1,0,stop\nb,1,0,stop\n").find("second run"), std::string::npos);
  // Random tables never do more than complain.
  std::mt19937_64 random(4);
  const std::string letters = "robt,ime_smn0123456789.-\n\"el ";
  for (int k = 0; k < 2000; ++k) {
    std::string content = k % 2 == 0 ? "robot,time_s,motion\n" : "";
    for (std::uint64_t n = random() % 60; n > 0; --n) content += letters[random() % letters.size()];
    static_cast<void>(error_of(content));
  }
}

TEST(Alarm, NamesTheSuspectItsSizeAndItsOnset) {
  Alarm alarm;
  alarm.time_s = 71.44;
  alarm.onset_s = 70.3;
  alarm.suspect = Suspect::kGainLeft;
  alarm.robots = {2};
  alarm.x_mm = -4.2;
  alarm.y_mm = 80;
  alarm.sizes = {{-0.96, 0.12}};
  alarm.alternatives = {Suspect::kBiasLeft};
  alarm.evidence_nat = 33.9;
  EXPECT_EQ(
      line_of(alarm),
      "monitor: 71.4 s: robot 2 leaves the model: gain of the left wheel -96 +- 12 % since 70.3 s, at (-4, 80) mm; "
      "or bias of the left wheel; evidence 34 nat");
  const auto commas = [](const std::string& row) { return std::count(row.begin(), row.end(), ','); };
  EXPECT_EQ(commas(table_row(alarm)), commas(table_header()));
  alarm.suspect = Suspect::kCalibrationShift;
  alarm.tracker = "ceiling";
  alarm.sizes = {{4, 0.1}, {-2, 0.1}, {0.004, 0.001}};
  EXPECT_EQ(commas(table_row(alarm)), commas(table_header()));
  EXPECT_NE(line_of(alarm).find("tracker \"ceiling\" leaves the model: calibration shift x +4 +- 0.1 mm"),
            std::string::npos)
      << line_of(alarm);
}

}  // namespace
}  // namespace kilotwin::monitor
