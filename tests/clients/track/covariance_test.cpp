// Stated uncertainties against true errors, on rendered films: the mean normalised squared error of a place is 2, of a heading 1,
// where the covariance is honest.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <opencv2/imgproc.hpp>

#include "clients/track/edge_circle.hpp"
#include "tests/clients/track/film.hpp"

namespace kilotwin::track {
namespace {

/// Wheels fluctuate: the heading wanders by some 1.2 degrees in a second.
constexpr double kWander_s = 0.0013;

struct Sums {
  double nees = 0, heading = 0, squares = 0, stated = 0;
  long places = 0, headings = 0, within = 0;
};

double squared(const Covariance& c, double dx, double dy) {
  return (c.yy * dx * dx - 2 * c.xy * dx * dy + c.xx * dy * dy) / c.determinant();
}

Sums sums_of(const Film& film) {
  constexpr double kQuantile95 = 5.991;
  Sums sums;
  play(film, [&](double t, const std::vector<Driver>& robots, const std::vector<TrackedRobot>& seen) {
    for (const TrackedRobot& one : seen) {
      double off = 0;
      const Driver* const robot = robot_at(robots, one.position, &off);
      if (robot == nullptr || one.state != TrackState::kSeen || t < 0.5) continue;
      const double dx = one.position.x_mm - robot->pose().x_mm, dy = one.position.y_mm - robot->pose().y_mm;
      const double d2 = squared(one.covariance, dx, dy);
      sums.nees += d2;
      sums.within += d2 < kQuantile95 ? 1 : 0;
      sums.squares += dx * dx + dy * dy;
      sums.stated += one.covariance.xx + one.covariance.yy;
      ++sums.places;
      if (!one.heading || t < 3) continue;
      const double error = kilotwin::wrapped(one.heading->heading_rad - robot->heading_rad);
      const double h2 = error * error / one.heading->variance_rad2;
      sums.heading += h2;
      ++sums.headings;
    }
  });
  return sums;
}

/// Where something as dark hides a part of the rim, the centre is less certain towards it.
TEST(HonestShape, AHiddenPartOfTheRimMakesTheErrorLongTowardsIt) {
  constexpr int kFine = 4, kSide = 80;
  cv::Mat fine(kFine * kSide, kFine * kSide, CV_8U, cv::Scalar(190));
  cv::circle(fine, {kFine * 40, kFine * 40}, kFine * 14, cv::Scalar(40), cv::FILLED);
  const auto fitted = [&] {
    cv::Mat picture;
    cv::resize(fine, picture, {kSide, kSide}, 0, 0, cv::INTER_AREA);
    return fit_circle(picture, {{39.6, 39.6}, 14}, {});
  };
  const auto whole = fitted();
  ASSERT_TRUE(whole);
  EXPECT_NEAR(whole->spread(0, 0), whole->spread(1, 1), 0.1 * whole->spread(0, 0));
  EXPECT_NEAR(whole->spread(0, 0), 2.0 / kRays, 0.5 / kRays);
  // A dark bar covers the rim within 45 degrees of the diagonal.
  const std::vector<cv::Point> bar{
      {kFine * 58, kFine * 38}, {kFine * 38, kFine * 58}, {kFine * 70, kFine * 79}, {kFine * 79, kFine * 70}};
  cv::fillConvexPoly(fine, bar, cv::Scalar(40));
  const auto hidden = fitted();
  ASSERT_TRUE(hidden);
  const double along = hidden->spread(0, 0) + hidden->spread(0, 1),
               across = hidden->spread(0, 0) - hidden->spread(0, 1);
  EXPECT_GT(along, 1.5 * across);
}

class Honest : public testing::TestWithParam<Film> {};

TEST_P(Honest, StatedUncertaintiesAreThoseOfTheErrors) {
  const Film& film = GetParam();
  const Sums sums = sums_of(film);
  ASSERT_GT(sums.places, 1000);
  const auto n = static_cast<double>(sums.places), m = static_cast<double>(std::max(1L, sums.headings));
  std::printf(
      "| %d robots, %.1f px/mm, noise %.0f, uneven light %.0f %%, LEDs %s, %s | %.3f | %.3f | %.2f | %.1f | %s |\n",
      film.robots, film.px_per_mm, film.noise, 100 * film.uneven, film.leds == FilmLeds::kOff ? "off" : "on",
      film.moves           ? "driving"
      : film.pitch_mm < 35 ? "at rest, touching"
                           : "at rest",
      std::sqrt(sums.squares / n), std::sqrt(sums.stated / n), sums.nees / n,
      100 * static_cast<double>(sums.within) / n,
      sums.headings == 0 ? "" : fmt::format("{:.2f}", sums.heading / m).c_str());
  EXPECT_GT(sums.nees / n, 0.7);
  EXPECT_LT(sums.nees / n, 3.2);
  if (!film.moves) return;
  // Headings are never stated too well. In films, where robots turn at even rates, they are better than stated.
  EXPECT_GT(sums.heading / m, 0.1);
  EXPECT_LT(sums.heading / m, 1.6);
}

INSTANTIATE_TEST_SUITE_P(
    Films, Honest,
    testing::Values(
        Film{.robots = 10, .px_per_mm = 0.6, .noise = 3, .factor_variance_s = kWander_s},
        Film{.robots = 10, .px_per_mm = 0.6, .noise = 3, .seed = 4, .factor_variance_s = kWander_s},
        Film{.robots = 10, .px_per_mm = 0.8, .noise = 8, .uneven = 0.4, .factor_variance_s = kWander_s},
        Film{.robots = 10, .px_per_mm = 0.8, .noise = 3, .leds = FilmLeds::kOff, .factor_variance_s = kWander_s},
        Film{.robots = 10, .px_per_mm = 1.1, .noise = 2, .duration_s = 6, .factor_variance_s = kWander_s},
        Film{.robots = 24, .px_per_mm = 0.7, .noise = 4, .duration_s = 4, .pitch_mm = 33.6, .moves = false},
        Film{.robots = 24, .px_per_mm = 0.7, .noise = 4, .duration_s = 4, .pitch_mm = 50, .moves = false}));

}  // namespace
}  // namespace kilotwin::track
