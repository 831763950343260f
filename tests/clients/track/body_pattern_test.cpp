// The pattern of bodies: found where there is one, and no lamp is taken for it.
#include "clients/track/body_pattern.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/pose.hpp"

namespace kilotwin::track {
namespace {

constexpr int kSide_px = 60;
const Point kCentre{29.4, 30.2};
const FloorMap kFloor = FloorMap::plane({1, 0, 29.5, 0, -1, 29.5, 0, 0, 1});

/// A disc with a bright bar from the centre along its heading, lit from the right: shares of full contrast.
cv::Mat disc(double heading_rad, double bar, double lamp) {
  cv::Mat grey(kSide_px, kSide_px, CV_8UC1, cv::Scalar(200));
  for (int row = 0; row < kSide_px; ++row) {
    for (int column = 0; column < kSide_px; ++column) {
      const double x = column - kCentre.x_px, y = kCentre.y_px - row;
      if (std::hypot(x, y) > kRobotRadius_mm) continue;
      const double along = x * std::cos(heading_rad) + y * std::sin(heading_rad),
                   across = y * std::cos(heading_rad) - x * std::sin(heading_rad);
      const double light =
          70 + lamp * 40 * x / kRobotRadius_mm + (along > 0 && std::abs(across) < 3 ? bar * 60 : 0);
      grey.at<unsigned char>(row, column) = cv::saturate_cast<unsigned char>(light);
    }
  }
  return grey;
}

BodyPattern learned(double bar, double lamp, double spread_rad = 2 * kPi) {
  BodyPattern pattern;
  constexpr int kPictures = 100;
  for (int i = 0; i < kPictures; ++i) {
    const double heading = wrapped(spread_rad * i / kPictures);
    pattern.learn(*BodyPicture::of(disc(heading, bar, lamp), kCentre, kFloor), heading);
  }
  return pattern;
}

TEST(BodyPattern, ItsRotationIsTheHeading) {
  const BodyPattern pattern = learned(1, 0.3);
  for (double heading = -3; heading < 3; heading += 0.37) {
    const auto found = pattern.heading_rad(*BodyPicture::of(disc(heading, 1, 0.3), kCentre, kFloor));
    ASSERT_TRUE(found) << heading;
    EXPECT_NEAR(wrapped(*found - heading), 0, 0.05) << heading;
  }
}

TEST(BodyPattern, ALampIsNone) {
  const BodyPattern pattern = learned(0, 1);
  EXPECT_FALSE(pattern.heading_rad(*BodyPicture::of(disc(1, 0, 1), kCentre, kFloor)));
}

TEST(BodyPattern, RobotsOfOneHeadingTellNothing) {
  const BodyPattern pattern = learned(1, 1, 0.5);
  EXPECT_FALSE(pattern.heading_rad(*BodyPicture::of(disc(0.2, 1, 1), kCentre, kFloor)));
}

TEST(BodyPicture, IsNoneAtTheRimOfThePictureOrWithoutContrast) {
  EXPECT_FALSE(BodyPicture::of(disc(0, 1, 0), {5, 30}, kFloor));
  EXPECT_FALSE(BodyPicture::of(disc(0, 0, 0), kCentre, kFloor));
}

}  // namespace
}  // namespace kilotwin::track
