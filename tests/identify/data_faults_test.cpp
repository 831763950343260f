// Faults of the data are found, named and excluded. No false alarms.
#include "clients/identify/data/data_faults.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/identify/truth/dice.hpp"
#include "tests/identify/truth/play.hpp"
#include "tests/identify/truth/scenarios.hpp"

namespace kilotwin {
namespace {

using identify::DataFault;
using identify::MeasuredSet;
using Kind = DataFault::Kind;

MeasuredSet measured(const truth::Scene& scene, const std::vector<truth::Run>& runs) {
  MeasuredSet set;
  set.has_commands = true;
  set.has_headings = scene.heading;
  for (const truth::Run& run : runs) {
    set.runs.push_back({std::to_string(run.number), {}});
    auto& tracks = set.runs.back().tracks;
    for (std::size_t robot = 0; robot < run.orders.size(); ++robot) {
      identify::Track track;
      track.robot = static_cast<std::uint32_t>(robot);
      track.commands.push_back({-1e300, identify::Motion::kStop});
      for (const truth::Order& order : run.orders[robot]) {
        track.commands.push_back({order.time_s, static_cast<identify::Motion>(order.motion)});
      }
      for (const truth::Sample& s : run.samples) {
        if (s.robot != static_cast<int>(robot)) continue;
        track.samples.push_back({s.time_s, s.point.x, s.point.y, scene.heading ? s.heading_rad : std::nan("")});
      }
      if (!track.samples.empty()) tracks.push_back(std::move(track));
    }
  }
  return set;
}

MeasuredSet set_of(truth::Scene scene, std::uint64_t seed = 1) {
  scene.test_runs = 0;
  return measured(scene, truth::play(scene, seed).train);
}

std::vector<DataFault> only(const std::vector<DataFault>& faults, Kind kind) {
  std::vector<DataFault> out;
  std::copy_if(faults.begin(), faults.end(), std::back_inserter(out),
               [&](const DataFault& f) { return f.kind == kind; });
  return out;
}

TEST(DataFaults, NoFalseAlarms) {
  // 300 sets of all kinds without a fault: a false alarm rate of 1 % would give three.
  std::size_t alarms = 0;
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    MeasuredSet set = set_of(truth::nothing_to_find(seed), seed);
    const std::size_t samples = set.samples();
    const auto faults = exclude_faults(set);
    alarms += faults.empty() ? 0U : 1U;
    EXPECT_TRUE(!faults.empty() || set.samples() == samples);
  }
  EXPECT_EQ(alarms, 0U);
}

TEST(DataFaults, NoFalseAlarmsInShortRuns) {
  // Of one run of 60 s with few robots. Two of these sets once had a wrong clock, by the gain of some robots.
  for (std::uint64_t seed = 91000; seed < 91300; ++seed) {
    const truth::Scene scene = truth::nothing_to_find(seed);
    MeasuredSet set = measured(scene, truth::play(scene, seed).test);
    const auto faults = exclude_faults(set);
    EXPECT_TRUE(faults.empty()) << seed << ": " << faults.front().in_words();
  }
}

TEST(DataFaults, EffectsAreNoFaults) {
  // Pushes displace robots, crowds stop them, lenses distort their paths: no faults.
  for (const std::string& name : truth::scenario_names()) {
    const truth::Scene scene = truth::scenario(name);
    if (!scene.faults.empty()) continue;
    MeasuredSet set = set_of(scene);
    const auto faults = exclude_faults(set);
    EXPECT_TRUE(faults.empty()) << name << ": " << faults.front().in_words();
  }
}

TEST(DataFaults, NumbersExchangedInTheMiddleOfARun) {
  MeasuredSet set = set_of(truth::scenario("swapped"));
  const std::size_t before = set.samples();
  const auto faults = exclude_faults(set);
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_EQ(faults[0].kind, Kind::kSwapped);
  EXPECT_EQ(faults[0].run, "1");
  EXPECT_EQ(faults[0].robot, 3U);
  EXPECT_EQ(faults[0].other, 9U);
  EXPECT_NEAR(faults[0].from_s, 88, 1.01);
  EXPECT_EQ(set.samples() + faults[0].excluded, before);
  for (const auto& track : set.runs[1].tracks) {
    const bool exchanged = track.robot == 3 || track.robot == 9;
    EXPECT_EQ(track.samples.back().time_s < 88, exchanged);
  }
}

TEST(DataFaults, NumbersExchangedFromTheStart) {
  truth::Scene scene = truth::scenario("nothing-blind");
  scene.faults = {{truth::Fault::Kind::kSwapped, 0, 2, 6, 0, 0, 0}};
  MeasuredSet set = set_of(scene);
  const auto faults = exclude_faults(set);
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_EQ(faults[0].kind, Kind::kSwapped);
  EXPECT_EQ(faults[0].robot, 2U);
  EXPECT_EQ(faults[0].other, 6U);
  EXPECT_LT(faults[0].from_s, 15);
  EXPECT_GT(faults[0].to_s, 185);
}

TEST(DataFaults, NumbersExchangedAndBackAgain) {
  truth::Scene scene = truth::scenario("nothing-tidy");
  scene.faults = {{truth::Fault::Kind::kSwapped, 2, 0, 11, 60, 0, 0},
                  {truth::Fault::Kind::kSwapped, 2, 0, 11, 100, 0, 0}};
  MeasuredSet set = set_of(scene);
  const auto faults = exclude_faults(set);
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_NEAR(faults[0].from_s, 60, 1.01);
  EXPECT_NEAR(faults[0].to_s, 100, 1.01);
}

TEST(DataFaults, AClockThatIsWrong) {
  for (const double rate : {0.7, 0.95, 1.04, 1.5}) {
    truth::Scene scene = truth::scenario("nothing-tidy");
    scene.faults = {{truth::Fault::Kind::kClock, 1, 0, 0, 0, 0, rate}};
    MeasuredSet set = set_of(scene);
    const auto faults = exclude_faults(set);
    ASSERT_EQ(faults.size(), 1U) << rate;
    EXPECT_EQ(faults[0].kind, Kind::kClock);
    EXPECT_EQ(faults[0].run, "1");
    EXPECT_NEAR(faults[0].strength / rate, 1, 0.005);
    ASSERT_EQ(set.runs.size(), 3U);
    for (const auto& track : set.runs[1].tracks) EXPECT_TRUE(track.samples.empty());
    EXPECT_FALSE(set.runs[0].tracks[0].samples.empty());
  }
}

TEST(DataFaults, ARobotTrackedTwice) {
  MeasuredSet set = set_of(truth::scenario("duplicate"));
  const auto faults = exclude_faults(set);
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_EQ(faults[0].kind, Kind::kDuplicate);
  EXPECT_EQ(faults[0].robot, 40U);
  EXPECT_EQ(faults[0].other, 5U);
}

TEST(DataFaults, Outliers) {
  const truth::Scene scene = truth::scenario("outliers");
  truth::Scene clean = scene;
  clean.faults.clear();
  const MeasuredSet right = set_of(clean);
  MeasuredSet set = set_of(scene);
  std::size_t wrong = 0;
  for (std::size_t t = 0; t < set.runs[0].tracks.size(); ++t) {
    for (std::size_t k = 0; k < set.runs[0].tracks[t].samples.size(); ++k) {
      wrong += set.runs[0].tracks[t].samples[k].x_mm != right.runs[0].tracks[t].samples[k].x_mm ? 1U : 0U;
    }
  }
  const auto faults = only(exclude_faults(set), Kind::kOutliers);
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_EQ(faults[0].run, "0");
  EXPECT_FALSE(faults[0].robot.has_value());
  // Outliers nearer than a robot moves within two frames are not detectable: 15 to 20 mm of 15 to 300, and at the
  // ends of tracks.
  EXPECT_GT(static_cast<double>(faults[0].excluded), 0.85 * static_cast<double>(wrong));
  EXPECT_LE(faults[0].excluded, wrong);
}

TEST(DataFaults, AFrozenTracker) {
  MeasuredSet set = set_of(truth::scenario("frozen"));
  const auto faults = exclude_faults(set);
  ASSERT_EQ(faults.size(), 2U);
  EXPECT_EQ(faults[0].kind, Kind::kFrozen);
  EXPECT_EQ(faults[0].robot, 2U);
  EXPECT_NEAR(faults[0].from_s, 60, 1.01);
  EXPECT_NEAR(faults[0].to_s, 110, 1.01);
  EXPECT_EQ(faults[1].run, "2");
  EXPECT_EQ(faults[1].robot, 7U);
}

TEST(DataFaults, RobotsAtRestUnderATrackerThatRoundsAreNotFrozen) {
  truth::Scene scene = truth::scenario("nothing-tidy");
  scene.tracker_sd_mm = 0.05;
  scene.stop_share = 0.5;
  MeasuredSet set = set_of(scene);
  for (auto& run : set.runs) {
    for (auto& track : run.tracks) {
      for (auto& sample : track.samples) {
        sample.x_mm = std::round(sample.x_mm);
        sample.y_mm = std::round(sample.y_mm);
      }
    }
  }
  EXPECT_TRUE(only(exclude_faults(set), Kind::kFrozen).empty());
}

TEST(DataFaults, SeveralAtOnce) {
  truth::Scene scene = truth::scenario("nothing-tidy");
  using FaultKind = truth::Fault::Kind;
  scene.faults = {{FaultKind::kSwapped, 1, 3, 9, 88, 0, 0},
                  {FaultKind::kOutliers, 0, 0, 0, 0, 0, 0.01},
                  {FaultKind::kFrozen, 0, 4, 0, 30, 80, 0},
                  {FaultKind::kClock, 2, 0, 0, 0, 0, 1.2}};
  MeasuredSet set = set_of(scene);
  const auto faults = exclude_faults(set);
  EXPECT_EQ(only(faults, Kind::kSwapped).size(), 1U);
  EXPECT_EQ(only(faults, Kind::kOutliers).size(), 1U);
  EXPECT_EQ(only(faults, Kind::kFrozen).size(), 1U);
  EXPECT_EQ(only(faults, Kind::kClock).size(), 1U);
  EXPECT_EQ(faults.size(), 4U);
}

TEST(DataFaults, SlowSamplingIsNoFault) {
  // The path between two samples is unknown where they are far apart.
  for (const double sample_s : {2.5, 4.0}) {
    truth::Scene scene = truth::scenario("nothing-tidy");
    scene.sample_s = sample_s;
    MeasuredSet set = set_of(scene);
    EXPECT_TRUE(exclude_faults(set).empty()) << sample_s;
  }
}

TEST(DataFaults, SayWhoAndWhen) {
  MeasuredSet set = set_of(truth::scenario("duplicate"));
  const std::vector<DataFault> faults = exclude_faults(set);
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_STREQ(name_of(faults[0].kind), "duplicate");
  EXPECT_EQ(faults[0].run, "0");
  EXPECT_EQ(faults[0].robot, 40U);
  EXPECT_NE(faults[0].in_words().find("robot 40 is a second track of robot 5"), std::string::npos);
}

TEST(DataFaults, EmptyAndTinySetsHaveNone) {
  MeasuredSet nothing;
  EXPECT_TRUE(exclude_faults(nothing).empty());
  MeasuredSet tiny;
  tiny.runs.push_back({"a",
                       {identify::Track{1, {{0, 0, 0, 0}}, {{-1e300, identify::Motion::kStop}}, false},
                        identify::Track{2, {}, {{-1e300, identify::Motion::kStop}}, false}}});
  EXPECT_TRUE(exclude_faults(tiny).empty());
}

}  // namespace
}  // namespace kilotwin
