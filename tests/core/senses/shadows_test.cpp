// Shadows against closed forms and against a search through all bodies.
#include "core/senses/shadows.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/pose.hpp"
#include "tests/support/scenes.hpp"

namespace kilotwin::senses {
namespace {

struct Bodies {
  std::vector<double> x, y;
};

bool hides(const Bodies& bodies, const Lamp& lamp, double x, double y, double z = 30, std::uint32_t self = 999999) {
  Shadows shadows(34);
  shadows.prepare(bodies.x, bodies.y);
  return shadows.hides(lamp, x, y, z, self);
}

TEST(Shadows, FallOverTheWidthOfABody) {
  // A lamp near the floor and a body half-way: the tangents give the width of the shadow.
  const Lamp lamp{0, 0, 30, 1};
  const Bodies body{{100}, {0}};
  const double half = 200 * std::tan(std::asin(16.5 / 100));
  EXPECT_TRUE(hides(body, lamp, 200, half - 1e-6));
  EXPECT_FALSE(hides(body, lamp, 200, half + 1e-6));
  EXPECT_TRUE(hides(body, lamp, 200, -half + 1e-6));
  EXPECT_FALSE(hides(body, lamp, 200, -half - 1e-6));
  EXPECT_FALSE(hides(body, lamp, 80, 0)) << "the sensor is before the body";
  EXPECT_FALSE(hides(body, {300, 0, 30, 1}, 200, 0)) << "the lamp is on the other side";
}

TEST(Shadows, AreAsLongAsTheLampIsLow) {
  // A body of 34 mm hides a lamp at 334 mm from a sensor at 30 mm up to 1/76 of the way to it.
  const Lamp lamp{-1000, 0, 334, 1};
  const double reach = 1000 * 4 / 304.0;
  EXPECT_TRUE(hides({{-16.5 - reach + 1e-6}, {0}}, lamp, 0, 0));
  EXPECT_FALSE(hides({{-16.5 - reach - 1e-6}, {0}}, lamp, 0, 0));
  EXPECT_FALSE(hides({{-20}, {0}}, lamp, 0, 0, 34)) << "a sensor as high as bodies";
}

TEST(Shadows, ARobotDoesNotHideFromItself) {
  EXPECT_TRUE(hides({{0}, {0}}, {500, 0, 20, 1}, 10, 0));
  EXPECT_FALSE(hides({{0}, {0}}, {500, 0, 20, 1}, 10, 0, 30, 0));
}

TEST(Shadows, EqualASearchThroughAllBodies) {
  int hidden = 0, cases = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    Bodies bodies;
    const double width = 200.0 * static_cast<double>(seed), height = seed % 3 == 0 ? 60 : 900;
    for (const auto& pose : testing::random_crowd(static_cast<std::uint32_t>(5 * seed), width, height, 33, seed)) {
      bodies.x.push_back(pose.x_mm);
      bodies.y.push_back(pose.y_mm);
    }
    Shadows shadows(34);
    shadows.prepare(bodies.x, bodies.y);
    const auto ends = testing::random_crowd(60, 2 * width, 2 * height, 0, seed + 100);
    for (std::size_t n = 0; n + 1 < ends.size(); n += 2) {
      for (const double lamp_height : {0.0, 30.0, 34.0, 50.0, 400.0}) {
        // Include lines along the axes.
        const double to_x = n % 5 == 0 ? ends[n].x_mm : ends[n + 1].x_mm,
                     to_y = n % 7 == 0 ? ends[n].y_mm : ends[n + 1].y_mm;
        const Lamp lamp{to_x, to_y, lamp_height, 1};
        bool expected = false;
        const double part = lamp_height > 34 ? 4 / (lamp_height - 30) : 1;
        for (std::size_t b = 0; b < bodies.x.size(); ++b) {
          const double dx = part * (to_x - ends[n].x_mm), dy = part * (to_y - ends[n].y_mm);
          const double bx = bodies.x[b] - ends[n].x_mm, by = bodies.y[b] - ends[n].y_mm, square = dx * dx + dy * dy;
          const double s = square > 0 ? std::min(1.0, std::max(0.0, (bx * dx + by * dy) / square)) : 0;
          expected = expected || std::hypot(bx - s * dx, by - s * dy) < kRobotRadius_mm;
        }
        EXPECT_EQ(shadows.hides(lamp, ends[n].x_mm, ends[n].y_mm, 30, 999999), expected);
        hidden += expected;
        ++cases;
      }
    }
  }
  EXPECT_GT(hidden, cases / 10);
  EXPECT_LT(hidden, cases * 9 / 10);
}

TEST(Shadows, NeedABody) { EXPECT_FALSE(hides({}, {1, 2, 3, 1}, 0, 0)); }

}  // namespace
}  // namespace kilotwin::senses
