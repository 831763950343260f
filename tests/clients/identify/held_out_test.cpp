// What is held out, and the last check on it.
#include <gtest/gtest.h>

#include <cmath>

#include "clients/identify/identify.hpp"
#include "clients/identify/predict/evaluation.hpp"
#include "clients/identify/predict/final_check.hpp"
#include "core/random/random.hpp"

namespace kilotwin::identify {
namespace {

/// Robots far apart that drive straight, with noise in their steps.
MeasuredSet driven_straight(std::uint32_t robots, std::uint32_t runs, double duration_s, std::uint64_t seed) {
  const Random random(seed);
  MeasuredSet set;
  set.has_commands = set.has_headings = true;
  for (std::uint32_t r = 0; r < runs; ++r) {
    Run& run = set.runs.emplace_back();
    run.name = std::to_string(r);
    for (std::uint32_t robot = 0; robot < robots; ++robot) {
      Track& track = run.tracks.emplace_back();
      track.robot = robot;
      track.commands = {{-1e300, Motion::kStop}, {0, Motion::kStraight}};
      double x_mm = 0;
      for (int k = 0; k <= duration_s; ++k) {
        const auto noise = [&](std::uint32_t draw) {
          return random.normal(Stream::kMeasurementNoise, 100 * r + robot, Tick{k}, draw);
        };
        track.samples.push_back({1.0 * k, x_mm + 0.3 * noise(0), 3000.0 * robot + 0.3 * noise(1), 0.02 * noise(2)});
        x_mm += 10 + noise(3);
      }
    }
  }
  return set;
}

HeldOut held_out_of(MeasuredSet set) {
  hold_out_part(set);
  return Evaluation(set, nullptr, 1).held_out();
}

TEST(HeldOut, DependsOnRunsAndRobots) {
  for (std::uint32_t robots = 1; robots <= 3; ++robots) {
    EXPECT_EQ(held_out_of(driven_straight(robots, 1, 5, 1)), HeldOut::kNothing) << robots;
    EXPECT_EQ(held_out_of(driven_straight(robots, 2, 5, 1)), HeldOut::kRuns) << robots;
  }
  EXPECT_EQ(held_out_of(driven_straight(4, 1, 5, 1)), HeldOut::kRobots);
  EXPECT_EQ(held_out_of(driven_straight(2, 3, 5, 1)), HeldOut::kRuns);
  const MeasuredSet set = driven_straight(1, 1, 5, 1);
  EXPECT_EQ(Evaluation(set, &set, 1).held_out(), HeldOut::kTestSet);
}

TEST(HeldOut, WithoutItNoErrorIsReported) {
  MeasuredSet set = driven_straight(2, 1, 40, 2);
  hold_out_part(set);
  const Identified found = identify(set, nullptr, {});
  const auto& result = found.document.at("contract");
  for (const char* when : {"before", "after"}) {
    EXPECT_TRUE(result.at(when).at("rmse_mm").is_null()) << when;
    EXPECT_EQ(result.at(when).at("rows"), 0) << when;
  }
  EXPECT_EQ(result.at("held_out").at("kind"), "nothing");
  EXPECT_NE(result.at("held_out").at("in_words").get<std::string>().find("Give a second run"), std::string::npos);
  EXPECT_TRUE(found.predictions.empty());
  EXPECT_GT(result.at("noise_floor_mm").get<double>(), 0);
  EXPECT_FALSE(found.model.SerializeAsString().empty());
}

TEST(HeldOut, TracksWithoutAPredictedTimeGiveNoError) {
  // Held out, but shorter than the first predicted time.
  MeasuredSet set = driven_straight(3, 2, 40, 3);
  for (Track& track : set.runs.back().tracks) track.samples.resize(8);
  hold_out_part(set);
  const Identified found = identify(set, nullptr, {});
  const auto& result = found.document.at("contract");
  EXPECT_TRUE(result.at("after").at("rmse_mm").is_null());
  EXPECT_EQ(result.at("held_out").at("kind"), "no predicted time");
}

/// Errors of a model on tracks of some robots in two runs: every track has this root mean square, times its factor.
PredictionErrors errors_with(double rmse_mm, double odd_factor = 1) {
  PredictionErrors errors;
  for (std::uint32_t run = 0; run < 2; ++run) {
    for (std::uint32_t place = 0; place < 8; ++place) {
      const double mm = rmse_mm * (place % 2 == 1 ? odd_factor : 1);
      errors.by_track[{run, place}] = {10 * mm * mm, 10};
      errors.sum_mm2 += 10 * mm * mm;
      errors.rows += 10;
    }
  }
  return errors;
}

TEST(FinalCheck, TheLastModelThatIsNotWorseStays) {
  const MeasuredSet set = driven_straight(8, 2, 5, 1);
  // Better and better: the last.
  EXPECT_EQ(last_not_worse(set, {errors_with(10), errors_with(6), errors_with(4)}), 2U);
  // The last is worse than the one before, in all tracks.
  EXPECT_EQ(last_not_worse(set, {errors_with(10), errors_with(6), errors_with(7)}), 1U);
  // All are worse than the base model.
  EXPECT_EQ(last_not_worse(set, {errors_with(23), errors_with(40), errors_with(63)}), 0U);
  // Worse than the one before in half of the tracks, better in the others: within chance.
  EXPECT_EQ(last_not_worse(set, {errors_with(10), errors_with(6), errors_with(5.8, 1.08)}), 2U);
  // Within chance of the base model, but not below it.
  EXPECT_EQ(last_not_worse(set, {errors_with(6), errors_with(5.8, 1.09)}), 0U);
  // No number.
  EXPECT_EQ(last_not_worse(set, {errors_with(6), errors_with(std::nan(""))}), 0U);
  EXPECT_EQ(last_not_worse(set, {errors_with(6)}), 0U);
}

/// Speeds swing by 4 mm/s with the time of the run, with a period of 50 s; `sign` -1: off by half a period.
void swing(MeasuredSet& set, double sign) {
  const double rate_s = 2 * M_PI / 50, size_mm = sign * 4 / rate_s;
  for (Run& run : set.runs)
    for (Track& track : run.tracks)
      for (Sample& s : track.samples) s.x_mm += size_mm * (1 - std::cos(rate_s * s.time_s));
}

TEST(FinalCheck, AnEffectThatHoldsInTheFitOnlyIsNotWritten) {
  // The clock of the test data is off by half a period.
  MeasuredSet train = driven_straight(6, 2, 80, 4), test = driven_straight(6, 1, 50, 5);
  swing(train, 1);
  swing(test, -1);
  const Identified found = identify(train, &test, {});
  const auto& result = found.document.at("contract");
  EXPECT_LE(result.at("after").at("rmse_mm").get<double>(),
            1.001 * result.at("before").at("rmse_mm").get<double>());
  const auto& check = result.at("check");
  ASSERT_GE(check.at("path").size(), 2U);
  // The search accepted something, and its last model would have been worse.
  EXPECT_GT(check.at("path").back().at("rmse_mm").get<double>(), check.at("path")[0].at("rmse_mm").get<double>());
  EXPECT_FALSE(check.at("dropped").empty());
  EXPECT_TRUE(result.at("effects").empty());
}

}  // namespace
}  // namespace kilotwin::identify
