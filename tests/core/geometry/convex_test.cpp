#include "core/geometry/convex.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <stdexcept>

namespace kilotwin {
namespace {

TEST(Convex, MeanDistanceOfAreaIsTheClosedForm) {
  EXPECT_NEAR(Convex::disc(30).mean_distance_mm(), 20, 1e-12);
  // A square of side 1: (sqrt 2 + ln(1 + sqrt 2)) / 6.
  EXPECT_NEAR(Convex::box(1, 1).mean_distance_mm(), (std::sqrt(2.0) + std::log(1 + std::sqrt(2.0))) / 6, 1e-12);
  // A thin rod of length 100: a quarter of its length.
  EXPECT_NEAR(Convex::box(100, 1e-3).mean_distance_mm(), 25, 1e-3);
}

TEST(Convex, PolygonIsAboutItsCentroidEitherWayRound) {
  Point2 centre;
  const Convex shape = Convex::polygon({{0, 0}, {0, 80}, {60, 0}}, &centre);
  EXPECT_NEAR(centre.x_mm, 20, 1e-12);
  EXPECT_NEAR(centre.y_mm, 80.0 / 3, 1e-12);
  EXPECT_NEAR(shape.area_mm2(), 2400, 1e-9);
  double x = 0, y = 0;
  for (const Point2 corner : shape.corners()) {
    x += corner.x_mm;
    y += corner.y_mm;
  }
  EXPECT_NEAR(x, 0, 1e-12);  // The centroid of a triangle is the mean of its corners.
  EXPECT_NEAR(y, 0, 1e-12);
}

TEST(Convex, RefusesPolygonsThatAreNotConvex) {
  EXPECT_THROW(static_cast<void>(Convex::polygon({{0, 0}, {1, 0}})), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(Convex::polygon({{0, 0}, {1, 0}, {2, 0}})), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(Convex::polygon({{0, 0}, {4, 0}, {1, 1}, {0, 4}})), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(Convex::polygon({{0, 0}, {4, 4}, {4, 0}, {0, 4}})), std::invalid_argument);
  std::vector<Point2> star;
  for (int i = 0; i < 5; ++i) star.push_back({std::cos(4 * M_PI * i / 5), std::sin(4 * M_PI * i / 5)});
  EXPECT_THROW(static_cast<void>(Convex::polygon(star)), std::invalid_argument);
}

TEST(Convex, NearestAgreesWithSamplingTheRim) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> at(-90, 90);
  for (const Convex& shape :
       {Convex::box(100, 40), Convex::polygon({{0, 0}, {70, 0}, {80, 30}, {20, 60}}), Convex::disc(35)}) {
    const Place place = Place::at(5, -8, 0.7);
    for (int k = 0; k < 300; ++k) {
      const Point2 p{at(random), at(random)};
      const Nearest found = shape.nearest(place, p);
      double least = 1e300;
      const std::size_t sides = shape.is_disc() ? 720 : shape.corners().size();
      for (std::size_t i = 0; i < sides; ++i) {
        for (int s = 0; s <= 200; ++s) {
          Point2 q;
          if (shape.is_disc()) {
            const double angle = 2 * M_PI * (static_cast<double>(i) + s / 200.0) / static_cast<double>(sides);
            q = {shape.radius_mm() * std::cos(angle), shape.radius_mm() * std::sin(angle)};
          } else {
            const Point2 a = shape.corners()[i], b = shape.corners()[(i + 1) % sides];
            q = {a.x_mm + (b.x_mm - a.x_mm) * s / 200, a.y_mm + (b.y_mm - a.y_mm) * s / 200};
          }
          q = place.to_arena(q);
          least = std::min(least, std::hypot(q.x_mm - p.x_mm, q.y_mm - p.y_mm));
        }
      }
      if (found.distance_mm < 0) {
        // Inside, the nearest edge decides; no sampled point of the rim is nearer.
        EXPECT_NEAR(-found.distance_mm, least, 0.3);
      } else {
        EXPECT_NEAR(found.distance_mm, least, 0.3);
        EXPECT_NEAR(std::hypot(found.at.x_mm - p.x_mm, found.at.y_mm - p.y_mm), found.distance_mm, 1e-9);
      }
      EXPECT_NEAR(std::hypot(found.normal_x, found.normal_y), 1, 1e-12);
    }
  }
}

TEST(Convex, SeparationDistinguishesContactFromOverlap) {
  const Convex box = Convex::box(100, 100), disc = Convex::disc(20);
  EXPECT_NEAR(separation_mm(box, Place::at(0, 0, 0), box, Place::at(101, 30, 0)), 1, 1e-12);
  EXPECT_NEAR(separation_mm(box, Place::at(0, 0, 0), box, Place::at(99, 30, 0)), -1, 1e-12);
  EXPECT_NEAR(separation_mm(box, Place::at(0, 0, 0), disc, Place::at(53, 54, 0)), 5 - 20, 1e-12);
  EXPECT_NEAR(separation_mm(disc, Place::at(0, 0, 0), disc, Place::at(30, 40, 0)), 10, 1e-12);
}

}  // namespace
}  // namespace kilotwin
