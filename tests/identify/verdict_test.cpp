// The evaluation accepts correct results only.
#include "tests/identify/verdict.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

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

TEST_F(VerdictTest, FilesThatLackSomethingAreSaidToFail) {
  EXPECT_NE(of(scenario("fatigue"), 3, 3, "{").failure, "");
  EXPECT_NE(of(scenario("fatigue"), 3, 3, "{}").failure, "");
  std::filesystem::remove(out_ / "predictions.csv");
  EXPECT_NE(judge(scenario("fatigue"), oracle_, out_).failure, "");
}

}  // namespace
}  // namespace kilotwin::truth
