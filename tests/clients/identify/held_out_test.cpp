// Choice of the held-out data, and the last check on them.
#include <gtest/gtest.h>

#include <cmath>
#include <set>

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
  return Evaluation(set, nullptr, Tracks::kReporting, 1).held_out();
}

TEST(HeldOut, DependsOnRunsAndRobots) {
  for (std::uint32_t robots = 1; robots <= 3; ++robots) {
    EXPECT_EQ(held_out_of(driven_straight(robots, 1, 5, 1)), HeldOut::kNothing) << robots;
    EXPECT_EQ(held_out_of(driven_straight(robots, 2, 5, 1)), HeldOut::kRuns) << robots;
  }
  EXPECT_EQ(held_out_of(driven_straight(4, 1, 5, 1)), HeldOut::kRobots);
  EXPECT_EQ(held_out_of(driven_straight(2, 3, 5, 1)), HeldOut::kRuns);
  const MeasuredSet set = driven_straight(1, 1, 5, 1);
  EXPECT_EQ(Evaluation(set, &set, Tracks::kReporting, 1).held_out(), HeldOut::kTestSet);
}

TEST(HeldOut, WithoutItNoErrorIsReported) {
  MeasuredSet set = driven_straight(2, 1, 40, 2);
  hold_out_part(set);
  const Identified found = identify(set, nullptr, {});
  const identification::Result& result = found.found.result();
  for (const identification::Accuracy* error : {&result.before(), &result.after()}) {
    EXPECT_TRUE(error->rmse_mm().has_null_value());
    EXPECT_TRUE(error->has_rows() && error->rows() == 0);
  }
  EXPECT_EQ(result.held_out().kind(), "nothing");
  EXPECT_NE(result.held_out().in_words().find("Give a second run"), std::string::npos);
  EXPECT_TRUE(found.predictions.empty());
  EXPECT_GT(result.noise_floor_mm(), 0);
  EXPECT_FALSE(found.model.SerializeAsString().empty());
}

TEST(HeldOut, TracksWithoutAPredictedTimeGiveNoError) {
  // Held out, but shorter than the first predicted time.
  MeasuredSet set = driven_straight(3, 2, 40, 3);
  for (Track& track : set.runs.back().tracks) track.samples.resize(8);
  hold_out_part(set);
  const Identified found = identify(set, nullptr, {});
  const identification::Result& result = found.found.result();
  EXPECT_TRUE(result.after().rmse_mm().has_null_value());
  EXPECT_EQ(result.held_out().kind(), "no predicted time");
}

TEST(HeldOut, HalfOfItChooses) {
  const auto count = [](const MeasuredSet& set, Tracks which) {
    std::size_t sum = 0;
    for (const auto& run : set.runs)
      for (const Track& track : run.tracks) sum += counts(track, which) ? 1U : 0U;
    return sum;
  };
  MeasuredSet runs = driven_straight(6, 3, 5, 1), robots = driven_straight(8, 1, 5, 1),
              one = driven_straight(1, 2, 5, 1);
  for (MeasuredSet* set : {&runs, &robots, &one}) hold_out_part(*set);
  EXPECT_EQ(count(runs, Tracks::kChoosing), 3U);
  EXPECT_EQ(count(runs, Tracks::kReporting), 3U);
  EXPECT_EQ(count(robots, Tracks::kChoosing), 1U);
  EXPECT_EQ(count(robots, Tracks::kReporting), 1U);
  // A single track gives the error.
  EXPECT_EQ(count(one, Tracks::kChoosing), 0U);
  EXPECT_EQ(count(one, Tracks::kReporting), 1U);
}

TEST(HeldOut, BesideATestSetEachRobotAndRunStaysInTheFit) {
  for (const std::uint32_t robots : {1U, 3U, 8U}) {
    MeasuredSet set = driven_straight(robots, 5, 5, 1);
    hold_out_for_choice(set);
    std::size_t held = 0;
    std::set<std::uint32_t> in_fit;
    for (const auto& run : set.runs) {
      for (const Track& track : run.tracks) {
        EXPECT_EQ(track.held_out, track.chooses);
        held += track.held_out ? 1U : 0U;
        if (!track.held_out) in_fit.insert(track.robot);
      }
    }
    EXPECT_EQ(held, robots) << "one track in five";
    EXPECT_EQ(in_fit.size(), robots);
  }
}

TEST(FinalCheck, TheSmallestOfTheBestStays) {
  // Better and better: the last.
  EXPECT_EQ(smallest_of_the_best({{0, 10}, {1, 6}, {2, 4}}), 2U);
  // The last is worse than the one before.
  EXPECT_EQ(smallest_of_the_best({{0, 10}, {1, 6}, {2, 7}}), 1U);
  // The last is better by less than 0.1 %.
  EXPECT_EQ(smallest_of_the_best({{0, 10}, {1, 6}, {2, 5.999}}), 1U);
  // As good, with a further effect of the measurement, which does not count as size.
  EXPECT_EQ(smallest_of_the_best({{0, 10}, {1, 6}, {1, 6}}), 2U);
  EXPECT_EQ(smallest_of_the_best({{0, 23}, {1, 40}, {2, 63}}), 0U);
  // No number.
  EXPECT_EQ(smallest_of_the_best({{0, 6}, {1, std::nan("")}}), 0U);
  EXPECT_EQ(smallest_of_the_best({{0, std::nan("")}, {1, 5}}), 1U);
  EXPECT_EQ(smallest_of_the_best({{0, std::nan("")}}), 0U);
}

/// Speeds swing by 4 mm/s with the time of the run, with a period of 50 s; `sign` -1: off by half a period.
void swing(MeasuredSet& set, double sign) {
  const double rate_s = 2 * M_PI / 50, size_mm = sign * 4 / rate_s;
  for (Run& run : set.runs)
    for (Track& track : run.tracks)
      for (Sample& s : track.samples) s.x_mm += size_mm * (1 - std::cos(rate_s * s.time_s));
}

TEST(FinalCheck, AnEffectThatHoldsInTheFitOnlyIsNotWritten) {
  // The clock of the last run is off by half a period.
  MeasuredSet set = driven_straight(6, 3, 80, 4);
  hold_out_part(set);
  MeasuredSet first = set, last = set;
  swing(first, 1);
  swing(last, -1);
  set.runs = {first.runs[0], first.runs[1], last.runs[2]};
  const Identified found = identify(set, nullptr, {});
  const identification::Result& result = found.found.result();
  EXPECT_LE(result.after().rmse_mm().number_value(), 1.001 * result.before().rmse_mm().number_value());
  const identification::Check& check = result.check();
  ASSERT_GE(check.path_size(), 2);
  // The search accepted something, and its last model would have been worse.
  EXPECT_GT(check.path().rbegin()->rmse_mm(), check.path(0).rmse_mm());
  EXPECT_FALSE(check.dropped().empty());
  // The swing is left to the noise, whose size may then depend on time.
  for (const identification::Effect& effect : result.effects())
    EXPECT_EQ(effect.acts_on(), "NOISE") << effect.name();
}

TEST(FinalCheck, ATestSetDoesNotChoose) {
  MeasuredSet train = driven_straight(6, 2, 80, 4), like = driven_straight(6, 1, 50, 5), unlike = like;
  hold_out_for_choice(train);
  swing(train, 1);
  swing(like, 1);
  swing(unlike, -1);
  const Identified one = identify(train, &like, {}), other = identify(train, &unlike, {});
  EXPECT_EQ(one.model.SerializeAsString(), other.model.SerializeAsString());
  const identification::Result& result = one.found.result();
  ASSERT_FALSE(result.effects().empty());
  for (const identification::Effect& effect : result.effects())
    EXPECT_GT(effect.evidence().held_out_gain().number_value(), 0);
  EXPECT_LT(result.after().rmse_mm().number_value(), 0.5 * result.before().rmse_mm().number_value());
  EXPECT_FALSE(result.check().has_in_words());
  // The written model is worse than the base model there, and the result says so.
  const identification::Result& worse = other.found.result();
  EXPECT_GT(worse.after().rmse_mm().number_value(), worse.before().rmse_mm().number_value());
  EXPECT_NE(worse.check().in_words().find("larger than that of the base model"), std::string::npos);
}

}  // namespace
}  // namespace kilotwin::identify
