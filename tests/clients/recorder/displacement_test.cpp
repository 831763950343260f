#include "clients/recorder/displacement.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

namespace kilotwin::recorder {
namespace {

TEST(DisplacementObserver, MeanAndLargestDistance) {
  DisplacementObserver observer;
  observer.add(std::array{0.0, 1.0}, std::array{0.0, 1.0});
  EXPECT_EQ(observer.max_distance_mm(), 0);
  observer.add(std::array{3.0, 1.0}, std::array{4.0, 2.0});
  EXPECT_DOUBLE_EQ(observer.mean_distance_mm(), 3);
  EXPECT_DOUBLE_EQ(observer.max_distance_mm(), 5);
}

TEST(DisplacementObserver, RobotsThatAreLeftOutDoNotCount) {
  DisplacementObserver observer;
  observer.leave_out(1);  // Those before and behind it count.
  observer.add(std::array{0.0, 0.0, 0.0}, std::array{0.0, 0.0, 0.0});
  observer.add(std::array{3.0, 100.0, 0.0}, std::array{4.0, 0.0, 1.0});
  EXPECT_DOUBLE_EQ(observer.mean_distance_mm(), 3);
  EXPECT_DOUBLE_EQ(observer.max_distance_mm(), 5);
}

}  // namespace
}  // namespace kilotwin::recorder
