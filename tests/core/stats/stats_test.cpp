#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "core/stats/clusters.hpp"
#include "core/stats/distributions.hpp"
#include "core/stats/moments.hpp"
#include "core/stats/quantiles.hpp"
#include "core/stats/resampling.hpp"

namespace kilotwin::stats {
namespace {

TEST(Quantiles, OfFourValues) {
  std::vector<double> values{4, 1, 3, 2};
  EXPECT_EQ(order_statistic(values, 0), 1);
  EXPECT_EQ(order_statistic(values, 3), 4);
  EXPECT_EQ(upper_end(values, 1), 3);
  EXPECT_EQ(upper_end(values, 9), 1);
  EXPECT_EQ(upper_median(values), 3);
  EXPECT_EQ(lower_quantile(values, 0.5), 2);
  EXPECT_EQ(lower_quantile(values, 1), 4);
  EXPECT_EQ(nearest_quantile(values, 0.4), 2);
  EXPECT_EQ(nearest_quantile(values, 0.6), 3);
  EXPECT_EQ(interpolated_quantile(values, 0.5), 2.5);
  EXPECT_NEAR(interpolated_quantile(values, 0.9), 3.7, 1e-15) << "numpy.quantile([1, 2, 3, 4], 0.9)";
}

TEST(Quantiles, OfNothing) {
  std::vector<double> none;
  EXPECT_EQ(upper_median(none), 0);
  EXPECT_EQ(lower_quantile(none, 0.5), 0);
  EXPECT_TRUE(std::isnan(interpolated_quantile(none, 0.5)));
}

TEST(Moments, MeanAndStandardError) {
  Moments sample;
  EXPECT_EQ(sample.mean(), 0);
  EXPECT_EQ(sample.standard_error(), 0);
  sample.add(3);
  EXPECT_EQ(sample.mean(), 3);
  EXPECT_EQ(sample.standard_error(), 0);
  for (const double value : {5.0, 7.0, 9.0}) sample.add(value);
  EXPECT_EQ(sample.count(), 4u);
  EXPECT_DOUBLE_EQ(sample.mean(), 6);
  EXPECT_DOUBLE_EQ(sample.standard_deviation(), std::sqrt(20.0 / 3));
  EXPECT_DOUBLE_EQ(sample.standard_error(), std::sqrt(20.0 / 3) / 2);
}

TEST(Moments, HasNoCancellation) {
  Moments sample;
  for (const double value : {1e9 + 4, 1e9 + 7, 1e9 + 13, 1e9 + 16}) sample.add(value);
  EXPECT_DOUBLE_EQ(sample.standard_deviation() * sample.standard_deviation(), 30);
}

TEST(Resampling, CountsDrawsAndPermutes) {
  const std::vector<double> weights = bootstrap_weights(4, [](std::size_t i) { return i / 2; });
  EXPECT_EQ(weights, (std::vector<double>{2, 2, 0, 0}));
  std::vector<int> items{0, 1, 2, 3};
  permute(
      items.size(), [](std::size_t) { return 0u; },
      [&](std::size_t i, std::size_t j) { std::swap(items[i], items[j]); });
  EXPECT_EQ(items, (std::vector<int>{1, 2, 3, 0}));
  EXPECT_EQ(permutation_p(0, 999), 0.001);
  EXPECT_EQ(permutation_p(999, 999), 1);
}

TEST(Distributions, AgreeWithTables) {
  EXPECT_NEAR(normal_cdf(kNormal95), 0.975, 3e-6);
  EXPECT_EQ(normal_cdf(0), 0.5);
  EXPECT_NEAR(chi_squared_tail(3.841459, 1), 0.05, 1e-6);
  EXPECT_NEAR(chi_squared_tail(18.307, 10), 0.05, 1e-5);
  EXPECT_EQ(chi_squared_tail(0, 4), 1);
  EXPECT_NEAR(student_quantile(0.99, 2), 6.965, 1e-3);
  EXPECT_NEAR(student_quantile(0.99, 9), 2.821, 1e-3);
}

TEST(Distributions, TheLogarithmOfATailIsExactOnBothSides) {
  for (const double degrees : {1.0, 2.0, 7.0, 64.0})
    for (const double x : {0.1, 1.0, 5.0, 40.0, 130.0, 600.0})
      EXPECT_NEAR(log10_chi_squared_tail(x, degrees), std::log10(chi_squared_tail(x, degrees)), 1e-9)
          << x << " with " << degrees;
  // With two degrees of freedom the tail is exp(-x / 2).
  EXPECT_NEAR(log10_chi_squared_tail(4000, 2), -2000 / std::log(10.0), 1e-9);
}

TEST(Gumbel, QuantilesFollowFromTheMoments) {
  EXPECT_NEAR(kGumbelSd * std::sqrt(6.0), M_PI, 1e-15);
  // With location 3 and scale 2: the mean is 3 + 2 * Euler's constant, and P(X <= x) = exp(-exp(-(x - 3) / 2)).
  constexpr double kLocation = 3, kScale = 2, kMean = kLocation + kScale * 0.57721566490153286;
  for (const double p : {0.003, 0.5, 0.95, 0.997}) {
    const double x = gumbel_quantile(p, kMean, kScale * kGumbelSd);
    EXPECT_NEAR(std::exp(-std::exp(-(x - kLocation) / kScale)), p, 1e-12);
  }
  // The median of the standard distribution is -log(log 2).
  EXPECT_NEAR(gumbel_quantile(0.5, 0.57721566490153286, kGumbelSd), -std::log(std::log(2.0)), 1e-14);
}

TEST(WilsonInterval, HoldsTheProbabilityAsOftenAsStated) {
  // Exact coverage over the binomial distribution.
  constexpr int kTrials = 100;
  for (const double probability : {0.05, 0.3, 0.95}) {
    double covered = 0, mass = std::pow(1 - probability, kTrials);
    for (int hits = 0; hits <= kTrials; ++hits) {
      const auto [low, high] = wilson_interval(hits, kTrials);
      if (low <= probability && probability <= high) covered += mass;
      mass *= (kTrials - hits) / (hits + 1.0) * probability / (1 - probability);
    }
    EXPECT_GT(covered, 0.93) << probability;
    EXPECT_LT(covered, 0.98) << probability;
  }
  EXPECT_EQ(wilson_interval(0, 50).first, 0);
  EXPECT_EQ(wilson_interval(50, 50).second, 1);
}

TEST(WilsonInterval, OfClustersAllowsForTheirDependence) {
  // Clusters of 8 trials with one probability each: 1 or 0.6, 0.9 on average.
  constexpr int kSets = 2000, kClusters = 60, kTrials = 8;
  constexpr double kMean = 0.9;
  std::mt19937_64 random(5);
  const auto below = [&](double p) { return static_cast<double>(random() >> 11) * 0x1p-53 < p; };
  int held = 0, held_if_independent = 0;
  for (int set = 0; set < kSets; ++set) {
    std::vector<Cluster> clusters;
    double hits = 0;
    for (int c = 0; c < kClusters; ++c) {
      const double probability = below(0.75) ? 1 : 0.6;
      Cluster& cluster = clusters.emplace_back(Cluster{0, kTrials});
      for (int t = 0; t < kTrials; ++t) cluster.hits += below(probability) ? 1 : 0;
      hits += cluster.hits;
    }
    const auto [low, high] = wilson_interval(clusters);
    held += low <= kMean && kMean <= high ? 1 : 0;
    const auto [narrow_low, narrow_high] = wilson_interval(hits, kClusters * kTrials);
    held_if_independent += narrow_low <= kMean && kMean <= narrow_high ? 1 : 0;
  }
  EXPECT_GT(held, 0.93 * kSets);
  EXPECT_LT(held, 0.98 * kSets);
  EXPECT_LT(held_if_independent, 0.88 * kSets);
  // A single cluster counts as one trial, whatever the rounding of its share.
  for (int hits = 1; hits < 49; ++hits)
    EXPECT_EQ(wilson_interval(std::vector<Cluster>{{1.0 * hits, 49}}), wilson_interval(hits / 49.0, 1)) << hits;
  // One trial per cluster: the plain interval, but for Student's distribution.
  std::vector<Cluster> single(100, Cluster{1, 1});
  EXPECT_EQ(wilson_interval(single), wilson_interval(100, 100));
  for (int i = 0; i < 10; ++i) single[static_cast<std::size_t>(i)].hits = 0;
  EXPECT_NEAR(wilson_interval(single).first, wilson_interval(90, 100).first, 0.003);
}

TEST(PoissonInterval, HoldsTheMeanInAtLeast95PercentOfCases) {
  for (const double mean : {0.5, 3.0, 10.0, 60.0}) {
    double probability = std::exp(-mean), holds = 0;
    for (int count = 0; count < 300; ++count) {
      const auto [low, high] = poisson_interval(count);
      if (low <= mean && mean <= high) holds += probability;
      probability *= mean / (count + 1);
    }
    EXPECT_GT(holds, 0.95) << mean;
    EXPECT_LT(holds, 0.99) << mean;
  }
  EXPECT_NEAR(poisson_interval(10).first, 4.795, 1e-3);
  EXPECT_NEAR(poisson_interval(10).second, 18.390, 1e-3);
  EXPECT_EQ(poisson_interval(0).first, 0);
}

}  // namespace
}  // namespace kilotwin::stats
