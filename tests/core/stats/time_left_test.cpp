#include "core/stats/time_left.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace kilotwin::stats {
namespace {

enum Kind { kFit, kTest };

Work unit(Kind kind, double cost, std::vector<WorkLeft> left) {
  return {"stage", "activity", kind, cost, std::move(left)};
}

double likely(const TimeLeft& time, double now_s) { return time.at(now_s)->likely_s; }

TEST(TimeLeft, IsUnknownUntilAUnitHasEnded) {
  TimeLeft time;
  EXPECT_FALSE(time.at(0));
  time.begin(0, unit(kFit, 1, {{kFit, 5, 9}}));
  EXPECT_FALSE(time.at(3));
  EXPECT_EQ(time.share(3), 0);
  EXPECT_EQ(in_words(time.at(3)), "time left not known yet");
  time.begin(4, unit(kFit, 1, {{kFit, 4, 8}}));
  EXPECT_TRUE(time.at(4));
}

TEST(TimeLeft, IsExactAtAConstantRate) {
  // Costs are right up to a factor: 3 s per cost. Within a unit the time falls by the time that passes.
  TimeLeft time;
  double now_s = 0;
  const std::vector<double> costs{1, 4, 0.5, 2, 2, 4, 1};
  for (std::size_t i = 0; i < costs.size(); ++i) {
    double fits = 0, tests = 0;
    for (std::size_t k = i + 1; k < costs.size(); ++k) (k % 2 == 0 ? fits : tests) += costs[k];
    time.begin(now_s, unit(i % 2 == 0 ? kFit : kTest, costs[i], {{kFit, fits, fits}, {kTest, tests, tests}}));
    const double left_s = 3 * (costs[i] + fits + tests);
    if (i > 0) {
      EXPECT_NEAR(likely(time, now_s), left_s, 1e-9);
      EXPECT_NEAR(likely(time, now_s + 1.5 * costs[i]), left_s - 1.5 * costs[i], 1e-9);
      EXPECT_GE(time.at(now_s)->most_s, left_s);
      EXPECT_NEAR(time.share(now_s), now_s / (now_s + left_s), 1e-9);
    }
    now_s += 3 * costs[i];
  }
  time.begin(now_s, unit(kFit, 0, {}));
  EXPECT_EQ(likely(time, now_s), 0);
  EXPECT_EQ(time.share(now_s), 1);
}

TEST(TimeLeft, LearnsTheRateOfAKindFromItsUnits) {
  // Tests cost ten times what the library believes.
  TimeLeft time;
  time.begin(0, unit(kFit, 1, {{kTest, 8, 8}}));
  time.begin(1, unit(kTest, 1, {{kTest, 7, 7}}));
  EXPECT_NEAR(likely(time, 1), 8, 1e-9);
  double before = std::abs(likely(time, 1) - 80);
  for (int done = 1; done < 8; ++done) {
    const double now_s = 1 + 10 * done;
    time.begin(now_s, unit(kTest, 1, {{kTest, 7.0 - done, 7.0 - done}}));
    const double error_s = std::abs(likely(time, now_s) - 10 * (8 - done));
    EXPECT_LT(error_s, before);
    before = error_s;
  }
  EXPECT_LT(before, 1);
}

TEST(TimeLeft, ShrinksIfRoundsStopEarlyAndIsNeverNegative) {
  TimeLeft time;
  time.begin(0, unit(kFit, 1, {{kTest, 4, 10}}));
  time.begin(2, unit(kTest, 1, {{kTest, 3, 9}}));
  const TimeLeft::Estimate before = *time.at(4);
  // The test passes nothing: no further round.
  time.begin(4, unit(kFit, 1, {}));
  EXPECT_LT(time.at(4)->likely_s, before.likely_s);
  EXPECT_LT(time.at(4)->most_s, before.most_s);
  for (double now_s = 4; now_s < 100; ++now_s) {
    EXPECT_GE(likely(time, now_s), 0);
    EXPECT_GE(time.at(now_s)->most_s, likely(time, now_s));
  }
}

TEST(TimeLeft, KeepsAUnitThatIsLateUnfinished) {
  TimeLeft time;
  time.begin(0, unit(kFit, 1, {{kFit, 1, 1}}));
  time.begin(10, unit(kFit, 1, {}));
  double before_s = likely(time, 10);
  EXPECT_NEAR(before_s, 10, 1e-9);
  // It falls until the unit is late, and from then on grows slowly.
  for (double now_s = 10.5; now_s < 20; now_s += 0.5) {
    EXPECT_LE(likely(time, now_s), before_s);
    before_s = likely(time, now_s);
  }
  EXPECT_GT(before_s, 0);
  EXPECT_GT(likely(time, 40), before_s);
}

TEST(TimeLeft, HasAShareThatNeverFalls) {
  // Random kinds, costs, durations and revisions of what is left.
  std::mt19937 engine(7);
  std::uniform_real_distribution<double> uniform;
  for (int trial = 0; trial < 200; ++trial) {
    TimeLeft time;
    double now_s = 0, share = 0;
    for (int i = 0; i < 30; ++i) {
      time.begin(now_s, unit(uniform(engine) < 0.5 ? kFit : kTest, uniform(engine),
                             {{kFit, 20 * uniform(engine), 30}, {kTest, 5 * uniform(engine), 10}}));
      const double length_s = 10 * uniform(engine);
      for (double at_s = now_s; at_s < now_s + length_s; at_s += 0.7) {
        EXPECT_GE(time.share(at_s), share);
        share = time.share(at_s);
        EXPECT_LE(share, 1);
      }
      now_s += length_s;
    }
  }
}

TEST(TimeLeft, IsToldInFiguresThatDoNotPretend) {
  EXPECT_EQ(in_words(TimeLeft::Estimate{3.2, 7.1}), "about 4 s left (at most 8 s)");
  EXPECT_EQ(in_words(TimeLeft::Estimate{38, 88}), "about 40 s left (at most 90 s)");
  EXPECT_EQ(in_words(TimeLeft::Estimate{38, 39}), "about 40 s left");
  EXPECT_EQ(in_words(TimeLeft::Estimate{100, 400}), "about 100 s left (at most 7 min)");
}

}  // namespace
}  // namespace kilotwin::stats
