// The boundary of visited places with curved walls.
#include "clients/identify/model/visited_boundary.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "core/random/random.hpp"

namespace kilotwin::identify {
namespace {

constexpr double kMargin_mm = 12;

/// Robots spread over an arena, one third at its walls; `shown` maps the square [-1, 1]^2 to the image.
template <class Shown> MeasuredSet room_full_of_robots(Shown&& shown) {
  const Random random(5);
  MeasuredSet set;
  Track& track = set.runs.emplace_back().tracks.emplace_back();
  for (std::uint32_t i = 0; i < 20000; ++i) {
    double u = 2 * random.uniform(Stream::kLayout, i, Tick{0}, 0) - 1;
    double v = 2 * random.uniform(Stream::kLayout, i, Tick{1}, 0) - 1;
    if (i % 6 == 0) u = std::copysign(1, u);
    if (i % 6 == 3) v = std::copysign(1, v);
    const auto [x, y] = shown(u, v);
    track.samples.push_back({static_cast<double>(i), x, y, 0});
  }
  return set;
}

/// All places at a wall are near the boundary; none is that is farther away than margin, strips and their slope
/// allow.
template <class Shown> void expect_held_at_walls_only(Shown&& shown, double inside) {
  const VisitedBoundary boundary(room_full_of_robots(shown), kMargin_mm);
  for (double along = -0.95; along <= 0.95; along += 0.05) {
    for (const double side : {-1.0, 1.0}) {
      const auto [x, y] = shown(side, along);
      EXPECT_TRUE(boundary.is_near(x, y)) << along;
      const auto [p, q] = shown(along, side);
      EXPECT_TRUE(boundary.is_near(p, q)) << along;
    }
  }
  for (double u = -inside; u <= inside; u += 0.1)
    for (double v = -inside; v <= inside; v += 0.1) {
      const auto [x, y] = shown(u, v);
      EXPECT_FALSE(boundary.is_near(x, y)) << u << ' ' << v;
    }
}

struct Point {
  double x_mm, y_mm;
};

TEST(VisitedBoundary, StraightWalls) {
  expect_held_at_walls_only([](double u, double v) { return Point{500 * u + 30, 400 * v}; }, 0.96);
}

TEST(VisitedBoundary, BarrelAndPincushionDistortion) {
  for (const double bent : {-0.15, 0.15})
    expect_held_at_walls_only(
        [bent](double u, double v) {
          const double scale = 450 * (1 + bent * (u * u + v * v));
          return Point{scale * u, scale * v};
        },
        0.85);
}

TEST(VisitedBoundary, ARoundArena) {
  expect_held_at_walls_only(
      [](double u, double v) {
        // Maps the square to the disc.
        return Point{450 * u * std::sqrt(1 - v * v / 2), 450 * v * std::sqrt(1 - u * u / 2)};
      },
      0.8);
}

}  // namespace
}  // namespace kilotwin::identify
