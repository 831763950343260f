// Significance of effects on a floor: the bound is exceeded in one of 100 sets, for any scales of the candidates.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "clients/identify/kilogrid/floor_evidence.hpp"

namespace kilotwin::kilogrid {
namespace {

/// Fourteen candidates with gains of different scales; the first ten have one parameter, the others two. The first
/// two are bounded at 0, so half of their gains are 0.
constexpr std::size_t kCandidates = 14;
std::vector<std::size_t> switches() {
  std::vector<std::size_t> of(kCandidates, 1);
  std::fill(of.begin() + 10, of.end(), 2);
  return of;
}
std::vector<double> gains(std::mt19937_64& random) {
  std::normal_distribution<> normal;
  std::vector<double> set;
  for (std::size_t c = 0; c < kCandidates; ++c) {
    const double scale = 0.6 + 0.1 * static_cast<double>(c), a = normal(random), b = normal(random);
    set.push_back(scale * (c < 2 && a < 0 ? 0 : a * a + (c < 10 ? 0 : b * b)));
  }
  return set;
}

TEST(NullDistribution, OneSetOfAHundredExceedsTheBound) {
  std::mt19937_64 random(3);
  constexpr int kBounds = 200, kTried = 50, kSets = 16;
  int beyond = 0;
  for (int k = 0; k < kBounds; ++k) {
    std::vector<std::vector<double>> sets;
    for (int b = 0; b < kSets; ++b) sets.push_back(gains(random));
    const NullDistribution chance(sets, switches());
    for (int i = 0; i < kTried; ++i) {
      const std::vector<double> set = gains(random);
      double largest = 0;
      for (std::size_t c = 0; c < kCandidates; ++c) largest = std::max(largest, chance.evidence(c, set[c]));
      beyond += largest > chance.bound() ? 1 : 0;
    }
  }
  // Of 10000. A bound from 16 sets is itself uncertain, so rates differ between bounds.
  EXPECT_LT(beyond, 150);
  EXPECT_GT(beyond, 20);
}

TEST(NullDistribution, EvidenceIsTheNegativeLogarithmOfP) {
  // All gains 1 with one parameter: scale 1. P(more than 3.841) is 5 %; with two parameters P(more than 5.991).
  const NullDistribution chance(std::vector<std::vector<double>>(20, {1, 2}), {1, 2});
  EXPECT_NEAR(std::exp(-chance.evidence(0, 3.841)), 0.05, 1e-4);
  EXPECT_NEAR(std::exp(-chance.evidence(1, 5.991)), 0.05, 1e-4);
  EXPECT_EQ(chance.evidence(0, 0), 0);
  for (const double evidence : {2.0, 7.0, 40.0}) {
    EXPECT_NEAR(chance.evidence(0, chance.gain_of(0, evidence)), evidence, 1e-6);
    EXPECT_NEAR(chance.evidence(1, chance.gain_of(1, evidence)), evidence, 1e-6);
  }
}

TEST(FloorMisfit, StepsStayInTheBoxAndLowerTheMisfit) {
  // Robots with independent sums: correlations near 0.
  std::mt19937_64 random(5);
  std::normal_distribution<> normal;
  const std::size_t n = statistic_count();
  const auto set = [&](double mean) {
    std::vector<RobotSums> robots(60, RobotSums{std::vector<double>(n), std::vector<double>(n, 1)});
    for (RobotSums& robot : robots) {
      for (double& sum : robot.sum) sum = mean + normal(random);
    }
    return FloorSet({robots});
  };
  std::vector<FloorSet> simulated;
  for (int b = 0; b < 8; ++b) simulated.push_back(set(0));
  const Eigen::MatrixXd correlation = correlation_of(simulated);
  EXPECT_NEAR(correlation(3, 3), 1, 1e-9);
  EXPECT_LT(std::abs(correlation(3, 40)), 0.2);  // four standard errors for 480 robots

  // Every statistic is 0.5 higher in the measurement. Two parameters raise all of them; the second is bounded by
  // one half.
  const auto count = static_cast<Eigen::Index>(n);
  Eigen::MatrixXd slopes = Eigen::MatrixXd::Zero(count, 2);
  slopes.col(0).head(count / 2).setConstant(0.25);
  slopes.col(1).tail(count - count / 2).setConstant(1);
  const FloorMisfit gap(set(0.5), simulated[0].statistics, slopes, correlation);
  EXPECT_EQ(gap.numbers, n);
  const FloorBox box{{-1, -1}, {1, 0.2}};
  const Eigen::VectorXd one = gap.best_steps({true, false}, box), both = gap.best_steps({true, true}, box);
  EXPECT_EQ(one(1), 0);
  EXPECT_NEAR(one(0), 1, 1e-9);
  EXPECT_NEAR(both(1), 0.2, 1e-9);
  EXPECT_LT(gap.at(one), gap.misfit);
  EXPECT_LT(gap.at(both), gap.at(one));
}

}  // namespace
}  // namespace kilotwin::kilogrid
