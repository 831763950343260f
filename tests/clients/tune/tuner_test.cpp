// Laws of the search: it finds optima under noise, spends what it may, and what it reports of the best point is unbiased.
#include "clients/tune/tuner.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <set>
#include <vector>

namespace kilotwin::tune {
namespace {

/// Noise that is a function of point and seed.
double noise(const Point& point, std::uint64_t seed, double sd) {
  std::seed_seq mix{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(std::llround(1e9 * point[0])),
                    static_cast<std::uint32_t>(std::llround(1e9 * point.back()))};
  std::mt19937 random(mix);
  return std::normal_distribution(0.0, sd)(random);
}

/// A hill with its top at `top`, and noise.
struct Hill {
  Point top;
  double sd = 0;
  std::size_t measured = 0;
  std::set<std::uint64_t> seeds;

  [[nodiscard]] double height(const Point& at) const {
    double squares = 0;
    for (std::size_t d = 0; d < at.size(); ++d) squares += (at[d] - top[d]) * (at[d] - top[d]);
    return -squares;
  }
  std::vector<double> operator()(const Point& at, std::uint64_t first, std::size_t count) {
    std::vector<double> values;
    for (std::size_t i = 0; i < count; ++i) {
      values.push_back(height(at) + noise(at, first + i, sd));
      seeds.insert(first + i);
    }
    measured += count;
    return values;
  }
};

Settings settings(std::size_t parameters, std::size_t budget, std::uint64_t seed = 1) {
  Settings s;
  s.parameters = parameters;
  s.budget = budget;
  s.seed = seed;
  return s;
}

class TuneIn : public testing::TestWithParam<std::size_t> {};
INSTANTIATE_TEST_SUITE_P(Dimensions, TuneIn, testing::Values(1, 2, 5));

TEST_P(TuneIn, FindsTheTopOfAHillWithoutNoise) {
  Hill hill;
  for (std::size_t d = 0; d < GetParam(); ++d) hill.top.push_back(0.2 + 0.13 * static_cast<double>(d));
  const Tuned tuned = tune(std::ref(hill), settings(GetParam(), 3000));
  for (std::size_t d = 0; d < GetParam(); ++d) EXPECT_NEAR(tuned.best[d], hill.top[d], 0.01);
  EXPECT_LE(hill.measured, 3000u);
}

TEST_P(TuneIn, FindsItWithNoiseAsLargeAsTheHill) {
  Hill hill{Point(GetParam(), 0.8), 0.3, 0, {}};
  const Tuned tuned = tune(std::ref(hill), settings(GetParam(), 6000));
  EXPECT_GT(hill.height(tuned.best), hill.height(Point(GetParam(), 0.5)) / 3);
}

TEST(Tune, FindsTheTopOfACurvedRidge) {
  // Rosenbrock's valley, upside down, in [-2, 2]^2: the top is at (1, 1).
  const auto ridge = [](const Point& at, std::uint64_t, std::size_t count) {
    const double x = 4 * at[0] - 2, y = 4 * at[1] - 2;
    return std::vector<double>(count, -(100 * (y - x * x) * (y - x * x) + (1 - x) * (1 - x)));
  };
  const Tuned tuned = tune(ridge, settings(2, 6000));
  EXPECT_NEAR(4 * tuned.best[0] - 2, 1, 0.05);
  EXPECT_NEAR(4 * tuned.best[1] - 2, 1, 0.1);
}

TEST(Tune, TheReportedValueHasNoWinnersCurse) {
  // All points are alike. The best of the search looks good by chance alone; its last measurement must not.
  double reported = 0, of_search = 0, squares = 0;
  constexpr int kSearches = 60;
  for (int i = 0; i < kSearches; ++i) {
    const auto flat = [](const Point& at, std::uint64_t first, std::size_t count) {
      std::vector<double> values;
      for (std::size_t k = 0; k < count; ++k) values.push_back(noise(at, first + k, 1));
      return values;
    };
    const Tuned tuned = tune(flat, settings(2, 400, 1 + 10'000 * static_cast<std::uint64_t>(i)));
    double best = -1e9;
    for (const Trial& trial : tuned.trials) best = std::max(best, trial.mean);
    of_search += best / kSearches;
    reported += tuned.value.mean / kSearches;
    squares += tuned.value.mean * tuned.value.mean / kSearches;
  }
  EXPECT_GT(of_search, 0.5);  // the curse is there
  // 4 standard errors of the mean over searches; a single value has variance 1/16.
  EXPECT_LT(std::abs(reported), 4 * std::sqrt(1.0 / 16 / kSearches));
  EXPECT_NEAR(squares, 1.0 / 16, 4 * 1.0 / 16 * std::sqrt(2.0 / kSearches));
}

TEST(Tune, SpendsNoMoreThanItsBudgetAndNeverChecksWithSeedsOfTheSearch) {
  for (const std::size_t budget : {100u, 101u, 237u, 1000u}) {
    Hill hill{{0.3, 0.6}, 0.1, 0, {}};
    Settings s = settings(2, budget, 50);
    const Tuned tuned = tune(std::ref(hill), s);
    EXPECT_LE(hill.measured, budget);
    EXPECT_GT(hill.measured + 6 * s.seeds, budget);  // a generation of 5 points, and less than a point, may be left
    const Seeds last = last_seeds(s);
    for (const Trial& trial : tuned.trials)
      EXPECT_LT(s.seed + (trial.generation + 1) * s.seeds, last.first) << "shares seeds with the check";
  }
}

TEST(Tune, AvoidsPointsWhoseRunsFail) {
  Hill hill{{0.9, 0.5}, 0.02, 0, {}};
  const auto fails_beyond = [&](const Point& at, std::uint64_t first, std::size_t count) {
    if (at[0] > 0.6) return std::vector<double>(count, std::nan(""));
    return hill(at, first, count);
  };
  const Tuned tuned = tune(fails_beyond, settings(2, 1200));
  EXPECT_LE(tuned.best[0], 0.6);
  EXPECT_GT(tuned.best[0], 0.45);
  EXPECT_EQ(tuned.again.front().failed, 0u);
}

TEST(Tune, SaysWhereNothingSucceeds) {
  const auto fails = [](const Point&, std::uint64_t, std::size_t count) {
    return std::vector<double>(count, std::nan(""));
  };
  EXPECT_THROW(static_cast<void>(tune(fails, settings(2, 400))), FailedSearch);
  EXPECT_THROW(static_cast<void>(tune(fails, settings(2, least_budget(settings(2, 0)) - 1))),
               std::invalid_argument);
}

TEST(Tune, StopsWhenAsked) {
  Hill hill{{0.5, 0.5}, 0, 0, {}};
  Settings s = settings(2, 400);
  s.stop = [&] { return hill.measured >= 40; };
  const Tuned tuned = tune(std::ref(hill), s);
  EXPECT_TRUE(tuned.stopped);
  EXPECT_EQ(hill.measured, 40u);
}

TEST(Tune, TheSameSeedGivesTheSamePoints) {
  Hill a{{0.3, 0.6}, 0.1, 0, {}}, b = a;
  const Tuned first = tune(std::ref(a), settings(2, 400)), second = tune(std::ref(b), settings(2, 400));
  ASSERT_EQ(first.trials.size(), second.trials.size());
  for (std::size_t i = 0; i < first.trials.size(); ++i) EXPECT_EQ(first.trials[i].point, second.trials[i].point);
  EXPECT_EQ(first.value.mean, second.value.mean);
}

TEST(Tune, EstimatesLeaveOutFailedRuns) {
  const Estimate e = estimate({1, std::nan(""), 3});
  EXPECT_EQ(e.count, 2u);
  EXPECT_DOUBLE_EQ(e.mean, 2);
  EXPECT_DOUBLE_EQ(e.standard_error, 1);
  const Estimate d = difference({5, 6, std::nan("")}, {1, 1, 1});
  EXPECT_EQ(d.count, 2u);
  EXPECT_DOUBLE_EQ(d.mean, 4.5);
}

}  // namespace
}  // namespace kilotwin::tune
