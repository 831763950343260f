// The loop over driven robots gives the same bits for every instruction set, and those of the functions for one robot.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>
#include <vector>

#include "core/base/pose.hpp"
#include "core/math/elementary.h"
#include "services/physics/drive.hpp"
#include "services/physics/drive_kernel.hpp"

namespace kilotwin::physics {
namespace {

constexpr double kHalfTick_s = 0.016384, kBase_mm = 25, kOffset_mm = 9.2;

struct Columns {
  explicit Columns(std::size_t size)
      : left(size),
        right(size),
        heading(size),
        part(size),
        turn(size),
        x(size),
        y(size),
        cosine(size),
        sine(size) {}
  std::vector<double> left, right, heading, part, turn, x, y, cosine, sine;

  bool run(const DriveKernel& kernel) {
    return kernel.integrate({kHalfTick_s, 2 * kHalfTick_s / kBase_mm, kOffset_mm},
                            {left.data(), right.data(), heading.data(), part.data(), turn.data(), x.data(),
                             y.data(), cosine.data(), sine.data()},
                            left.size() / 8);
  }
};

/// Angles of any size, angles next to multiples of an eighth turn, and the ends of the range.
std::vector<double> angles() {
  std::vector<double> found{0.0, -0.0, kPi, -kPi, 1e-300, -1e-300, 0x1p-27, -0x1p-27, 0x1p-28};
  for (int k = -4; k <= 4; ++k) {
    double above = k * kPi / 4, below = above;
    for (int n = 0; n < 40; ++n) {
      if (std::abs(above) <= kPi) found.push_back(above);
      if (std::abs(below) <= kPi) found.push_back(below);
      above = std::nextafter(above, 10);
      below = std::nextafter(below, -10);
    }
  }
  std::mt19937_64 generator(7);
  while (found.size() % 8 != 0 || found.size() < 200000) {
    const double uniform = static_cast<double>(generator() >> 11) * 0x1p-53;
    found.push_back(generator() % 4 == 0 ? std::ldexp(uniform, -static_cast<int>(generator() % 60))
                                         : (2 * uniform - 1) * kPi);
  }
  return found;
}

TEST(DriveKernel, GivesTheBitsOfTheScalarFunctions) {
  const DriveKernel* kernels[3];
  const std::size_t count = drive_kernels(kernels);
  const std::vector<double> headings = angles();
  std::mt19937 generator(1);
  Columns columns(headings.size());
  for (std::size_t i = 0; i < headings.size(); ++i) {
    columns.left[i] = generator() % 5 == 0 ? 0 : static_cast<double>(generator() % 2000) / 100;
    columns.right[i] = generator() % 5 == 0 ? 0 : static_cast<double>(generator() % 2000) / 100;
    columns.heading[i] = headings[i];
    columns.part[i] = i % 2 == 0 ? 1 : 0.25;
  }
  for (std::size_t k = 0; k < count; ++k) {
    Columns result = columns;
    ASSERT_TRUE(result.run(*kernels[k])) << kernels[k]->name;
    for (std::size_t i = 0; i < headings.size(); ++i) {
      const double turn = (columns.right[i] - columns.left[i]) * (2 * kHalfTick_s / kBase_mm) * columns.part[i];
      const Arc arc =
          arc_of((columns.left[i] + columns.right[i]) * kHalfTick_s * columns.part[i], turn, kOffset_mm);
      double s, c;
      kt_sincos(headings[i], &s, &c);
      ASSERT_EQ(result.x[i], c * arc.forward_mm - s * arc.sideways_mm) << kernels[k]->name << ' ' << headings[i];
      ASSERT_EQ(result.y[i], s * arc.forward_mm + c * arc.sideways_mm) << kernels[k]->name << ' ' << headings[i];
      ASSERT_EQ(result.cosine[i], arc.cos_turn);
      ASSERT_EQ(result.sine[i], arc.sin_turn);
    }
  }
}

TEST(DriveKernel, ReportsTurnsTooLargeForTheSeries) {
  const DriveKernel* kernels[3];
  const std::size_t count = drive_kernels(kernels);
  for (std::size_t k = 0; k < count; ++k) {
    for (const double sign : {-1.0, 1.0}) {
      Columns columns(16);
      columns.part.assign(16, 1);
      columns.right[11] = sign * kSeriesTurn_rad / (2 * kHalfTick_s / kBase_mm) * 0.999;
      EXPECT_TRUE(columns.run(*kernels[k])) << kernels[k]->name;
      columns.right[11] *= 1.002;
      EXPECT_FALSE(columns.run(*kernels[k])) << kernels[k]->name;
    }
  }
}

}  // namespace
}  // namespace kilotwin::physics
