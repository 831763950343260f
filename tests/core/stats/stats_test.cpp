#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/stats/distributions.hpp"
#include "core/stats/quantiles.hpp"

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
  EXPECT_EQ(interpolated_quantile(values, 0.5), 2.5);
  EXPECT_NEAR(interpolated_quantile(values, 0.9), 3.7, 1e-15) << "numpy.quantile([1, 2, 3, 4], 0.9)";
}

TEST(Quantiles, OfNothing) {
  std::vector<double> none;
  EXPECT_EQ(upper_median(none), 0);
  EXPECT_EQ(lower_quantile(none, 0.5), 0);
  EXPECT_TRUE(std::isnan(interpolated_quantile(none, 0.5)));
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

}  // namespace
}  // namespace kilotwin::stats
