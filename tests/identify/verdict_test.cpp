// The evaluation accepts correct results only.
#include "tests/identify/verdict.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/identify/coverage.hpp"
#include "tests/identify/truth/play.hpp"
#include "tests/identify/truth/scenarios.hpp"

namespace kilotwin::truth {
namespace {

class VerdictTest : public testing::Test {
 protected:
  VerdictTest()
      : out_(std::filesystem::path(testing::TempDir()) /
             ("verdict-" + std::to_string(getpid()) + "-" +
              testing::UnitTest::GetInstance()->current_test_info()->name())) {
    std::filesystem::create_directories(out_);
    for (int i = 0; i < 40; ++i) oracle_.push_back({0, i / 8, 10.0 + 5 * (i % 8), {1.0 * i, 3}, {1.0 * i, 0}});
  }
  ~VerdictTest() override { std::filesystem::remove_all(out_); }

  /// Predictions displaced by these lengths along y, and a result with this text.
  Verdict of(const Scene& scene, double before_mm, double after_mm, const std::string& result,
             std::size_t leave_out = 0) {
    std::ofstream csv(out_ / "predictions.csv");
    csv << "run,robot,time_s,before_x_mm,before_y_mm,after_x_mm,after_y_mm\n";
    for (std::size_t i = leave_out; i < oracle_.size(); ++i) {
      const Prediction& p = oracle_[i];
      csv << fmt::format("{},{},{},{},{},{},{}\n", p.run, p.robot, p.time_s, p.truth.x, before_mm, p.truth.x,
                         after_mm);
    }
    csv.close();
    std::ofstream(out_ / "result.json") << result;
    return judge(scene, oracle_, out_);
  }

  std::filesystem::path out_;
  std::vector<Prediction> oracle_;
};

const char* const kFatigue = R"({"effects": [{"name": "wear", "covariates": ["motor_time"]}]})";

TEST_F(VerdictTest, LetsTheRightAnswerPass) {
  const Verdict v = of(scenario("fatigue"), 9, 3.2, kFatigue);
  EXPECT_EQ(v.failure, "");
  EXPECT_NEAR(v.before_mm, 9, 1e-9);
  EXPECT_NEAR(v.after_mm, 3.2, 1e-9);
  EXPECT_NEAR(v.oracle_mm, 3, 1e-9);
  EXPECT_EQ(v.named, 1);
  EXPECT_TRUE(v.good());
}

TEST_F(VerdictTest, OneBadPredictionDoesNotMoveTheMedian) {
  oracle_[5].predicted.y = 300;
  const Verdict v = of(scenario("fatigue"), 9, 3.2, kFatigue);
  EXPECT_GT(v.later_oracle_mm, 30);
  EXPECT_NEAR(v.median_oracle_mm, 3, 1e-9);
  EXPECT_NEAR(v.median_after_mm, 3.2, 1e-9);
}

TEST_F(VerdictTest, AnErrorTooLargeDoesNotPass) { EXPECT_FALSE(of(scenario("fatigue"), 9, 3.4, kFatigue).good()); }

TEST_F(VerdictTest, WhatLooksAlikeDoesNotPass) {
  const Verdict v = of(scenario("fatigue"), 9, 3, R"({"effects": [{"name": "old", "covariates": ["time"]}]})");
  EXPECT_EQ(v.named, 0);
  EXPECT_EQ(v.false_findings.size(), 1U);
  EXPECT_FALSE(v.good());
}

TEST_F(VerdictTest, OneOfTwoCausesDoesNotPass) {
  const Verdict v = of(scenario("fatigue-lens"), 9, 3, kFatigue);
  EXPECT_EQ(v.named, 1);
  EXPECT_EQ(v.causes, 2);
  EXPECT_TRUE(v.false_findings.empty());
  EXPECT_FALSE(v.good());
}

TEST_F(VerdictTest, AnEffectWhereNothingIsDoesNotPass) {
  EXPECT_TRUE(of(scenario("nothing-tidy"), 3, 3, R"({"effects": []})").good());
  EXPECT_FALSE(of(scenario("nothing-tidy"), 3, 3, kFatigue).good());
}

TEST_F(VerdictTest, RowsLeftOutDoNotPass) {
  const Verdict v = of(scenario("fatigue"), 9, 3, kFatigue, 1);
  EXPECT_EQ(v.missing_rows, 1);
  EXPECT_FALSE(v.good());
}

TEST_F(VerdictTest, AFaultIsNamedByKindRunAndRobot) {
  const Scene scene = scenario("swapped");
  const auto result = [](const char* kind, int run, int robot) {
    return fmt::format(R"({{"effects": [], "faults": [{{"kind": "{}", "run": "{}", "robot": {}}}]}})", kind, run,
                       robot);
  };
  EXPECT_TRUE(of(scene, 3, 3, result("swapped", 1, 3)).good());
  EXPECT_TRUE(of(scene, 3, 3, result("swapped", 1, 9)).good());
  EXPECT_FALSE(of(scene, 3, 3, result("swapped", 1, 4)).good());
  EXPECT_FALSE(of(scene, 3, 3, result("swapped", 0, 3)).good());
  EXPECT_FALSE(of(scene, 3, 3, result("frozen", 1, 3)).good());
  EXPECT_FALSE(of(scene, 3, 3, R"({"effects": []})").good());
}

TEST_F(VerdictTest, ASystematicErrorIsKeptWithItsSentence) {
  const auto sentence = [&](const char* large) {
    return of(scenario("nothing-tidy"), 3, 3,
              fmt::format(R"({{"effects": [], "unexplained": {{"large": {}, "in_words": "Much is left."}}}})",
                          large))
        .unexplained;
  };
  EXPECT_EQ(sentence("true"), "Much is left.");
  EXPECT_EQ(sentence("false"), "");
}

TEST_F(VerdictTest, APossibleErrorIsKept) {
  const auto perhaps = [&](const char* said) {
    return of(scenario("nothing-tidy"), 3, 3,
              fmt::format(R"({{"effects": [], "unexplained": {{"large": false, "perhaps": {}}}}})", said))
        .perhaps;
  };
  EXPECT_TRUE(perhaps("true"));
  EXPECT_FALSE(perhaps("false"));
}

TEST_F(VerdictTest, FilesThatLackSomethingAreSaidToFail) {
  EXPECT_NE(of(scenario("fatigue"), 3, 3, "{").failure, "");
  EXPECT_NE(of(scenario("fatigue"), 3, 3, "{}").failure, "");
  std::filesystem::remove(out_ / "predictions.csv");
  EXPECT_NE(judge(scenario("fatigue"), oracle_, out_).failure, "");
}

/// A result for the scene "battery" with a band over `covariate`: the true changes of the speed for a mean speed that is 0.9 of the
/// undisturbed one, and `off` at one of the points.
std::string battery_result(const Scene& scene, const std::string& covariate, double off) {
  nlohmann::json band;
  for (const double time_s : {0.0, 60.0, 120.0, 180.0}) {
    Situation at;
    at.motion = Motion::kStraight;
    at.time_s = time_s;
    Push push;
    scene.effects.at(0).push(at, push);
    const double value = push.gain.left / 0.9 - 1 + (time_s == 120 ? off : 0);
    band["at"].push_back(time_s);
    band["value"].push_back(value);
    band["low"].push_back(value - 0.001);
    band["high"].push_back(value + 0.001);
  }
  const nlohmann::json base = {{"wheel_base_mm", scene.wheel_base_mm},
                               {"tracked_point_ahead_mm", scene.tracked_ahead_mm},
                               {"tracked_point_left_mm", 0},
                               {"straight_speed_mm_s", 0.9 * scene.straight_mm_s},
                               {"turn_speed_mm_s", 0.9 * scene.turn_mm_s},
                               {"bias_mean_mm_s", 0.9 * scene.bias_mean_mm_s}};
  const nlohmann::json sd = {{"wheel_base_mm", 0.1},         {"tracked_point_ahead_mm", 0.1},
                             {"tracked_point_left_mm", 0.1}, {"straight_speed_mm_s", 0.01},
                             {"turn_speed_mm_s", 0.01},      {"bias_mean_mm_s", 0.01}};
  const nlohmann::json low = {
      {"tracker_position_sd_mm", 0}, {"tracker_heading_sd_rad", 0}, {"factor_variance_s", 0}};
  const nlohmann::json high = {
      {"tracker_position_sd_mm", nullptr}, {"tracker_heading_sd_rad", nullptr}, {"factor_variance_s", 1e-9}};
  return nlohmann::json{
      {"effects",
       {{{"name", "speed-by-" + covariate}, {"covariates", {covariate}}, {"parameters", {{"bands_95", {band}}}}}}},
      {"base", base},
      {"base_sd", sd},
      {"noise_low", low},
      {"noise_high", high},
      {"robots", nlohmann::json::array()}}
      .dump();
}

TEST_F(VerdictTest, BandsAreComparedUpToTheLevelOfTheCurve) {
  const Scene scene = scenario("battery");
  const auto counted = [&](const std::string& covariate, double off) {
    std::ofstream(out_ / "result.json") << battery_result(scene, covariate, off);
    Coverage coverage;
    coverage.add("battery", scene, {}, out_);
    return coverage;
  };
  const Coverage right = counted("time", 0);
  EXPECT_EQ(right.points_of("battery, speed-by-time").held, 4);
  EXPECT_EQ(right.points_of("battery, speed-by-time").all, 4);
  EXPECT_EQ(right.intervals_of("straight_speed_mm_s").held, 1) << "at the same level";
  EXPECT_EQ(right.intervals_of("factor_variance_s").held, 0);
  EXPECT_EQ(right.intervals_of("tracker_position_sd_mm").held, 1) << "no upper end";
  EXPECT_LT(counted("time", 0.1).points_of("battery, speed-by-time").held, 4);
  // The truth has no curve over places.
  EXPECT_EQ(counted("heading", 0).points_of("battery, speed-by-heading").all, 0);
}

}  // namespace
}  // namespace kilotwin::truth
