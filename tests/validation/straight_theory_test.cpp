#include "tests/validation/straight_theory.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/stats/moments.hpp"

namespace kilotwin::validation {
namespace {

/// The disc's centre of a robot with these biases after `time_s`, by the exact arc, from the origin along x.
void centre_at(const StraightTheory& model, WheelBias bias, double time_s, double& x, double& y, double& heading) {
  const double v = model.speed_mm_s + 0.5 * (bias.left_mm_s + bias.right_mm_s);
  heading = (bias.right_mm_s - bias.left_mm_s) / model.wheel_base_mm * time_s;
  const double half = 0.5 * heading, chord = v * time_s * (half == 0 ? 1 : std::sin(half) / half);
  x = chord * std::cos(half) + model.axle_offset_mm * (std::cos(heading) - 1);
  y = chord * std::sin(half) + model.axle_offset_mm * std::sin(heading);
}

TEST(StraightTheory, ClosedFormIsTheMeanOverManyRobots) {
  const StraightTheory model;
  std::mt19937_64 generator(3);
  std::normal_distribution<double> bias(model.bias_mean_mm_s, model.bias_sd_mm_s);
  for (const double time_s : {0.5, 10.0, 60.0, 600.0}) {
    stats::Moments squares;
    for (int i = 0; i < 200'000; ++i) {
      double x = 0, y = 0, heading = 0;
      centre_at(model, {bias(generator), bias(generator)}, time_s, x, y, heading);
      squares.add(x * x + y * y);
    }
    EXPECT_NEAR(model.msd_mm2(time_s), squares.mean(), 4 * squares.standard_error()) << time_s;
  }
}

TEST(StraightTheory, WithoutSpreadItIsTheSquareOfTheWay) {
  EXPECT_DOUBLE_EQ((StraightTheory{.bias_mean_mm_s = 0, .bias_sd_mm_s = 0}.msd_mm2(60)), 360'000);
  EXPECT_NEAR((StraightTheory{.bias_mean_mm_s = 0, .bias_sd_mm_s = 1e-4}.msd_mm2(60)), 360'000, 1e-2);
}

TEST(SeedEstimator, GivesBackTheBiasesOfExactArcs) {
  const StraightTheory model;
  for (const WheelBias bias : {WheelBias{0, 0}, {1.5, -2}, {-4, 4}, {7, 1}, {-11, -12.5}}) {
    Track track;
    for (int second = 0; second <= 61; ++second) {
      double x = 0, y = 0, heading = 0;
      centre_at(model, bias, second, x, y, heading);
      track.time_s.push_back(second + 0.3);
      track.x_mm.push_back(100 + x);
      track.y_mm.push_back(y);
      track.heading_rad.push_back(heading);
    }
    const WheelBias found = estimate_bias(track, model, 10, 6);
    EXPECT_NEAR(found.left_mm_s, bias.left_mm_s, 1e-9);
    EXPECT_NEAR(found.right_mm_s, bias.right_mm_s, 1e-9);
  }
}

}  // namespace
}  // namespace kilotwin::validation
