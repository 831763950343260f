#include "clients/recorder/statistics.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

namespace kilotwin::recorder {
namespace {

TEST(Sample, MeanAndStandardError) {
  Sample sample;
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

TEST(Sample, HasNoCancellation) {
  Sample sample;
  for (const double value : {1e9 + 4, 1e9 + 7, 1e9 + 13, 1e9 + 16}) sample.add(value);
  EXPECT_DOUBLE_EQ(sample.standard_deviation() * sample.standard_deviation(), 30);
}

TEST(DisplacementObserver, MeanAndLargestDistance) {
  DisplacementObserver observer;
  observer.add(std::array{0.0, 1.0}, std::array{0.0, 1.0});
  EXPECT_EQ(observer.max_distance_mm(), 0);
  observer.add(std::array{3.0, 1.0}, std::array{4.0, 2.0});
  EXPECT_DOUBLE_EQ(observer.mean_distance_mm(), 3);
  EXPECT_DOUBLE_EQ(observer.max_distance_mm(), 5);
}

}  // namespace
}  // namespace kilotwin::recorder
