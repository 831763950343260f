// The renderer against geometry: where discs lie, how large they are, what lens and noise do.
#include "clients/cameras/renderer.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <opencv2/imgproc.hpp>
#include <random>

#include "clients/cameras/robot_look.hpp"
#include "idl/experiment.pb.h"

namespace kilotwin::cameras {
namespace {

World arena_of(double width_mm, double height_mm) {
  proto::Experiment experiment;
  experiment.mutable_arena()->set_width_mm(width_mm);
  experiment.mutable_arena()->set_height_mm(height_mm);
  return World(experiment);
}

/// Discs of one colour on a floor of one colour: moments then have a closed form.
Look plain() {
  Look look;
  look.floor = {200, 200, 200};
  look.board = look.battery = look.leg = {0, 0, 0};
  look.floor_texture = 0;
  return look;
}

RobotView robot_at(double x_mm, double y_mm, double heading_rad = 0, std::uint8_t led = 0) {
  RobotView robot;
  robot.pose = {x_mm, y_mm, heading_rad};
  robot.led = led;
  return robot;
}

/// Area (px^2) and centroid of what is darker than the floor in the first channel, weighted by how much.
struct Moments {
  double area_px2 = 0;
  cv::Point2d centre;
};
Moments dark_moments(const cv::Mat& picture, double floor) {
  Moments moments;
  for (int row = 0; row < picture.rows; ++row) {
    for (int column = 0; column < picture.cols; ++column) {
      const double share = (floor - picture.at<cv::Vec3b>(row, column)[0]) / floor;
      moments.area_px2 += share;
      moments.centre += share * cv::Point2d(column, row);
    }
  }
  moments.centre /= moments.area_px2;
  return moments;
}

/// Largest distance of a seen centre from the true one.
struct CentreError {
  double most_px = 0;
  int places = 0;

  void add(const cv::Point2d& seen, const cv::Point2d& truth) {
    most_px = std::max(most_px, cv::norm(seen - truth));
    ++places;
  }
  void print(const char* what) const {
    std::printf("measured: %s, %d places: %.3f px at most\n", what, places, most_px);
  }
};

/// The centre of a robot of the full look: the radius at which many rays cross a level between board and floor, its first harmonic.
cv::Point2d rim_centre(const cv::Mat& picture, const cv::Point2d& guess, double radius_px, double level_of_rim) {
  constexpr int kRays = 180;
  cv::Point2d offset;
  for (int ray = 0; ray < kRays; ++ray) {
    const double angle = 2 * CV_PI * ray / kRays;
    const cv::Point2d along(std::cos(angle), std::sin(angle));
    double last = 0, crossing = radius_px;
    for (int step = 0; step < 140; ++step) {
      const double r = radius_px - 3 + 0.05 * step;
      cv::Mat one;
      cv::getRectSubPix(picture, {1, 1}, guess + r * along, one, CV_32F);
      const double level = one.at<cv::Vec3f>(0, 0)[0];
      if (level > level_of_rim && last > 0) {
        crossing = r;
        break;
      }
      last = level;
    }
    offset += (2.0 / kRays) * (crossing - radius_px) * along;
  }
  return guess + offset;
}

TEST(Renderer, DiscsHaveTheirAreaAndCentreAtEverySubPixelPlace) {
  const World world = arena_of(4000, 4000);
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> place_mm(-45, 45), turn(-3, 3);
  CentreError error;
  for (const double px_per_mm : {0.37, 0.8, 1.0, 1.9}) {
    const CameraModel camera = CameraModel::overhead(320, 300, px_per_mm, 3, -4);
    Renderer renderer(world, camera, plain());
    for (int i = 0; i < 60; ++i) {
      const RobotView robot = robot_at(place_mm(random), place_mm(random), turn(random));
      const Moments seen = dark_moments(renderer.render({{robot}, {}}), 200);
      const cv::Point2d truth = renderer.centre_px(robot.pose);
      EXPECT_LT(cv::norm(seen.centre - truth), 0.05) << px_per_mm;
      error.add(seen.centre, truth);
      const double radius_px = kRobotRadius_mm * px_per_mm;
      EXPECT_NEAR(seen.area_px2, CV_PI * radius_px * radius_px, 0.01 * CV_PI * radius_px * radius_px) << px_per_mm;
    }
  }
  error.print("centre of a plain disc by moments, 0.37 to 1.9 px/mm");
}

TEST(Renderer, TheFullLookHasItsRimAtTheTrueCentre) {
  const World world = arena_of(400, 400);
  Look look;
  look.floor_texture = 0;
  Renderer renderer(world, CameraModel::overhead(320, 300, 1.0), look);
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> place_mm(-45, 45), turn(-3, 3);
  CentreError error;
  for (int i = 0; i < 40; ++i) {
    const RobotView robot = robot_at(place_mm(random), place_mm(random), turn(random));
    const cv::Mat picture = renderer.render({{robot}, {}});
    const cv::Point2d truth = renderer.centre_px(robot.pose);
    // The parts on the board's ring are lighter than its rest, which moves the crossing of single rays.
    const cv::Point2d seen =
        rim_centre(picture, truth, kRobotRadius_mm, 0.75 * look.floor[0] + 0.25 * look.board[0]);
    EXPECT_LT(cv::norm(seen - truth), 0.05);
    error.add(seen, truth);
  }
  error.print("centre of the full look by its rim, 1 px/mm");
}

TEST(Renderer, ATiltedCameraWithALensStillShowsCentresWhereItProjectsThem) {
  const World world = arena_of(2000, 2000);
  CameraModel camera = CameraModel::overhead(1200, 900, 0.6, 0, 0, 1500);
  camera.distortion = {-0.2, 0.05, 0, 0.001, -0.0015};
  const double tilt = 0.1;
  camera.R = cv::Matx33d(1, 0, 0, 0, std::cos(tilt), -std::sin(tilt), 0, std::sin(tilt), std::cos(tilt)) * camera.R;
  Renderer renderer(world, camera, plain());
  CentreError error;
  for (const auto& [x, y] : {std::pair{0.0, 0.0}, {-500.3, 300.7}, {444.4, -333.3}, {600.1, 0.2}}) {
    const RobotView robot = robot_at(x, y, 1);
    const cv::Mat with = renderer.render({{robot}, {}}), without = renderer.render({});
    cv::Mat difference, channel;
    cv::subtract(without, with, difference);
    cv::extractChannel(difference, channel, 0);
    const cv::Moments moments = cv::moments(channel);
    const cv::Point2d seen(moments.m10 / moments.m00, moments.m01 / moments.m00);
    EXPECT_LT(cv::norm(seen - renderer.centre_px(robot.pose)), 0.05) << x << " " << y;
    error.add(seen, renderer.centre_px(robot.pose));
  }
  error.print("centre through a tilted camera with a lens, 0.6 px/mm");
}

TEST(CameraModel, ProjectionAndItsInverseAgree) {
  CameraModel camera = CameraModel::overhead(1200, 900, 0.6, 40, -30, 1500);
  camera.distortion = {-0.25, 0.08, 0.001, 0.002, -0.001};
  for (int x = -700; x <= 700; x += 100) {
    for (int y = -500; y <= 500; y += 100) {
      const cv::Point2d back = camera.at_height(camera.project({1.0 * x, 1.0 * y, 15}), 15);
      EXPECT_NEAR(back.x, x, 1e-4);
      EXPECT_NEAR(back.y, y, 1e-4);
    }
  }
}

TEST(CameraModel, NorthIsUpAndEastIsRight) {
  const CameraModel camera = CameraModel::overhead(101, 101, 1);
  EXPECT_NEAR(camera.project({0, 0, 0}).x, 50, 1e-9);
  EXPECT_NEAR(camera.project({10, 0, 0}).x, 60, 1e-9);
  EXPECT_NEAR(camera.project({0, 10, 0}).y, 40, 1e-9);
}

TEST(Renderer, TheLedShinesAtItsPlaceInItsColour) {
  const World world = arena_of(400, 400);
  Renderer renderer(world, CameraModel::overhead(300, 300, 1.0));
  for (int blue = 0; blue <= 3; blue += 3) {
    for (int green = 0; green <= 3; green += 3) {
      for (int red = 0; red <= 3; red += 3) {
        const auto led = static_cast<std::uint8_t>(red | green << 2 | blue << 4);
        const double heading = 0.7;
        const RobotView on = robot_at(12.3, -20.1, heading, led), off = robot_at(12.3, -20.1, heading);
        cv::Mat light;
        cv::subtract(renderer.render({{on}, {}}), renderer.render({{off}, {}}), light);
        if (led == 0) {
          EXPECT_EQ(cv::countNonZero(light.reshape(1)), 0);
          continue;
        }
        // Around the white middle the channels that are lit stand out.
        const double c = std::cos(heading), s = std::sin(heading);
        const cv::Point2d place = renderer.camera().project(
            {12.3 + c * kLedForward_mm - s * kLedLeft_mm, -20.1 + s * kLedForward_mm + c * kLedLeft_mm, 0});
        const cv::Vec3b at = renderer.render({{on}, {}})
                                 .at<cv::Vec3b>(cv::Point(static_cast<int>(std::lround(place.x)),
                                                          static_cast<int>(std::lround(place.y))));
        EXPECT_EQ(at[0] > 200, blue == 3);
        EXPECT_EQ(at[1] > 200, green == 3);
        EXPECT_EQ(at[2] > 200, red == 3);
      }
    }
  }
}

TEST(Renderer, BrighterLevelsOfTheLedAreBrighter) {
  const World world = arena_of(400, 400);
  Renderer renderer(world, CameraModel::overhead(300, 300, 1.0));
  double last = cv::sum(renderer.render({{robot_at(0, 0)}, {}}))[2];
  for (std::uint8_t led = 1; led <= 3; ++led) {
    const double sum = cv::sum(renderer.render({{robot_at(0, 0, 0, led)}, {}}))[2];
    EXPECT_GT(sum, last);
    last = sum;
  }
}

TEST(Renderer, MotionSmearsADiscAlongItsPathAndKeepsItsCentre) {
  const World world = arena_of(400, 400);
  CameraModel camera = CameraModel::overhead(300, 300, 1.0);
  camera.exposure_s = 0.5;
  Renderer renderer(world, camera, plain());
  RobotView robot = robot_at(5.25, 3.75);
  const auto second_moment = [&](const cv::Mat& picture) {
    cv::Mat dark;
    cv::extractChannel(picture, dark, 0);
    const cv::Moments m = cv::moments(200 - dark);
    return std::pair{m.mu20 / m.m00, m.mu02 / m.m00};
  };
  const auto still = second_moment(renderer.render({{robot}, {}}));
  robot.vx_mm_s = 20;  // 10 mm within the exposure: a uniform smear adds L^2 / 12
  const cv::Mat moved = renderer.render({{robot}, {}});
  const auto smeared = second_moment(moved);
  EXPECT_NEAR(smeared.first - still.first, 100.0 / 12, 0.5);
  EXPECT_NEAR(smeared.second, still.second, 0.3);
  EXPECT_LT(cv::norm(dark_moments(moved, 200).centre - renderer.centre_px(robot.pose)), 0.05);
}

TEST(Renderer, NoiseHasItsStandardDeviationAndItsSeed) {
  const World world = arena_of(4000, 4000);
  Look look = plain();
  look.floor = {100, 100, 100};
  CameraModel camera = CameraModel::overhead(400, 400, 0.5);
  camera.read_noise = 3;
  camera.shot_noise = 4;
  Renderer renderer(world, camera, look), again(world, camera, look);
  const cv::Mat picture = renderer.render({}, 5);
  cv::Scalar mean, deviation;
  cv::meanStdDev(picture, mean, deviation);
  const double expected = std::sqrt(9 + 16 * 100 / 255.0 + 1 / 12.0);
  for (int c = 0; c < 3; ++c) {
    // 160000 values: the standard error of the mean is 0.01, that of the deviation 0.007.
    EXPECT_NEAR(mean[c], 100, 0.05);
    EXPECT_NEAR(deviation[c], expected, 0.04);
  }
  EXPECT_EQ(cv::norm(picture, again.render({}, 5), cv::NORM_INF), 0);
  EXPECT_GT(cv::norm(picture, renderer.render({}, 6), cv::NORM_INF), 0);
  camera.seed = 2;
  EXPECT_GT(cv::norm(picture, Renderer(world, camera, look).render({}, 5), cv::NORM_INF), 0);
}

TEST(Renderer, VignettingAndRoomLightFollowTheirFormulas) {
  const World world = arena_of(4000, 4000);
  CameraModel camera = CameraModel::overhead(401, 401, 0.5);
  camera.vignetting = 0.4;
  Look look = plain();
  const cv::Mat dim = Renderer(world, camera, look).render({});
  EXPECT_NEAR(dim.at<cv::Vec3b>(200, 200)[0], 200, 1);
  EXPECT_NEAR(dim.at<cv::Vec3b>(0, 0)[0], 120, 1);    // the corner loses 40 %
  EXPECT_NEAR(dim.at<cv::Vec3b>(200, 0)[0], 160, 1);  // half of the corner's squared distance
  camera.vignetting = 0;
  camera.uneven_light = 0.25;
  camera.light_from_rad = 0;
  const cv::Mat uneven = Renderer(world, camera, look).render({});
  EXPECT_NEAR(uneven.at<cv::Vec3b>(200, 400)[0], 220, 1);  // 400 mm east: 10 % brighter
  EXPECT_NEAR(uneven.at<cv::Vec3b>(200, 0)[0], 180, 1);
}

TEST(Renderer, RobotsBeyondThePictureAreCutAtItsEdge) {
  const World world = arena_of(400, 400);
  Renderer renderer(world, CameraModel::overhead(100, 100, 1.0), plain());
  const double whole = CV_PI * kRobotRadius_mm * kRobotRadius_mm;
  // The picture's right edge lies at x = 50: half of the disc is in it.
  EXPECT_NEAR(dark_moments(renderer.render({{robot_at(50, 0)}, {}}), 200).area_px2, whole / 2, 0.02 * whole);
  EXPECT_EQ(cv::norm(renderer.render({{robot_at(500, 0, 0, 3)}, {}}), renderer.render({}), cv::NORM_INF), 0);
}

TEST(Renderer, AHeightShiftsDiscsAwayFromTheMiddleOfThePicture) {
  const World world = arena_of(2000, 2000);
  Look look = plain();
  look.body_height_mm = 30;
  const CameraModel camera = CameraModel::overhead(1000, 1000, 0.5, 0, 0, 1500);
  Renderer renderer(world, camera, look);
  const RobotView robot = robot_at(800, 0);
  const Moments seen = dark_moments(renderer.render({{robot}, {}}), 200);
  const double expected = (camera.width_px - 1) / 2.0 + 0.5 * 800 * 1500 / (1500 - 30);
  EXPECT_NEAR(seen.centre.x, expected, 0.05);
}

}  // namespace
}  // namespace kilotwin::cameras
