#include "clients/recorder/statistics.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/clients/recorder/synthetic.hpp"

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

TEST(Sample, DoesNotCancel) {
  Sample sample;
  for (const double value : {1e9 + 4, 1e9 + 7, 1e9 + 13, 1e9 + 16}) sample.add(value);
  EXPECT_DOUBLE_EQ(sample.standard_deviation() * sample.standard_deviation(), 30);
}

TEST(MeanSquareDisplacement, OfStraightMotion) {
  const Scratch scratch;
  write_synthetic(scratch / "r.ktrec", synthetic_header(3), 62);
  Reader reader(scratch / "r.ktrec");
  const MeanSquareDisplacement msd = mean_square_displacement(reader);
  ASSERT_EQ(msd.time_s.size(), 3u);
  for (std::size_t k = 0; k < 3; ++k) {
    const double t = std::array{0.0, 31.0, 62.0}[k];
    EXPECT_DOUBLE_EQ(msd.time_s[k], t * 0.032768);
    // Robot i moves (0.5 t, 0.25 i t).
    Sample expected;
    for (const double i : {0.0, 1.0, 2.0}) expected.add(t * t * (0.25 + 0.0625 * i * i));
    EXPECT_NEAR(msd.msd_mm2[k], expected.mean(), 1e-9);
    EXPECT_NEAR(msd.standard_error_mm2[k], expected.standard_error(), 1e-9);
  }
}

TEST(DisplacementObserver, MeanAndLargestDistance) {
  DisplacementObserver observer;
  observer.add(5, std::array{0.0, 1.0}, std::array{0.0, 1.0});
  EXPECT_EQ(observer.max_distance_mm(), 0);
  observer.add(6, std::array{3.0, 1.0}, std::array{4.0, 2.0});
  EXPECT_DOUBLE_EQ(observer.mean_distance_mm(), 3);
  EXPECT_DOUBLE_EQ(observer.max_distance_mm(), 5);
  EXPECT_DOUBLE_EQ(observer.msd().time_s.back(), 1);
}

}  // namespace
}  // namespace kilotwin::recorder
