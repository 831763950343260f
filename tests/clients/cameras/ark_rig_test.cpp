// The four cameras against ARK's own steps, written here from their formulas: panorama, mosaic, circles, LEDs.
#include "clients/cameras/ark_rig.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <random>
#include <vector>

#include "clients/cameras/renderer.hpp"
#include "idl/experiment.pb.h"

namespace kilotwin::cameras {
namespace {

/// The data that ARK reads of a calibration file, and computes when it loads one. Its height adjustments are 0.
struct Calibration {
  std::array<cv::Point2f, 4> corner;
  std::vector<cv::Mat> R, K;
  std::array<cv::Point, 4> offset;  // of each camera's picture in the panorama
  cv::Size full;
};

Calibration loaded(const std::string& xml) {
  const cv::FileStorage file(xml, cv::FileStorage::READ | cv::FileStorage::MEMORY);
  Calibration calibration;
  for (std::size_t i = 0; i < 4; ++i) file["corner" + std::to_string(i + 1)] >> calibration.corner.at(i);
  file["R"] >> calibration.R;
  file["K"] >> calibration.K;
  cv::Point least(1 << 20, 1 << 20), most(-(1 << 20), -(1 << 20));
  for (std::size_t i = 0; i < 4; ++i) {
    // The plane warper at scale f with R = I: u = f (x - c_x) / f.
    const cv::Point offset(static_cast<int>(-calibration.K[i].at<double>(0, 2)),
                           static_cast<int>(-calibration.K[i].at<double>(1, 2)));
    calibration.offset.at(i) = offset;
    least = {std::min(least.x, offset.x), std::min(least.y, offset.y)};
    most = {std::max(most.x, offset.x + 2048), std::max(most.y, offset.y + 1536)};
  }
  for (cv::Point& offset : calibration.offset) offset -= least;
  calibration.full = {most.x - least.x + 1, most.y - least.y + 1};
  return calibration;
}

/// The mosaic, 2000 x 2000 px, with ARK's truncations.
cv::Mat mosaic_of(const std::array<cv::Mat, 4>& pictures, const Calibration& calibration) {
  constexpr int kShrunk = 1536;
  cv::Mat mosaic(2000, 2000, CV_8UC3);
  for (std::size_t i = 0; i < 4; ++i) {
    cv::Mat shrunk, square;
    cv::resize(pictures.at(i), shrunk,
               {kShrunk * 2048 / calibration.full.width, kShrunk * 1536 / calibration.full.height});
    const cv::Point offset = calibration.offset.at(i);
    const bool right = offset.x > 100, lower = offset.y > 100;
    const cv::Point2f moved(static_cast<float>(offset.x * kShrunk / calibration.full.width),
                            static_cast<float>(offset.y * kShrunk / calibration.full.height));
    std::array<cv::Point2f, 4> from, to;
    for (std::size_t corner = 0; corner < 4; ++corner) {
      from.at(corner) = calibration.corner.at(corner) - moved;
      to.at(corner) = {static_cast<float>(corner % 2 * 2000 + 100) - (right ? 1000 : 0),
                       static_cast<float>(corner / 2 * 2000 + 100) - (lower ? 1000 : 0)};
    }
    cv::warpPerspective(shrunk, square, cv::getPerspectiveTransform(from.data(), to.data()), {1200, 1200});
    square(cv::Rect(100, 100, 1000, 1000)).copyTo(mosaic(cv::Rect(right ? 1000 : 0, lower ? 1000 : 0, 1000, 1000)));
  }
  return mosaic;
}

std::vector<cv::Vec3f> circles(const cv::Mat& channel, double apart, int votes, int least, int most) {
  std::vector<cv::Vec3f> found;
  cv::HoughCircles(channel, found, cv::HOUGH_GRADIENT, 1.0, apart, 90, votes, least, most);
  return found;
}

/// Off, red, green, blue: 0 to 3. Each channel less shares of the others; a small circle near the robot's centre.
int led_near(const std::array<std::vector<cv::Vec3f>, 3>& lights, const cv::Point2d& robot, int& colours) {
  int found = 0;
  colours = 0;
  for (std::size_t colour = 0; colour < 3; ++colour) {
    const bool near = std::any_of(lights.at(colour).begin(), lights.at(colour).end(), [&](const cv::Vec3f& light) {
      return std::hypot(light[0] - robot.x, light[1] - robot.y) < 19;
    });
    if (!near) continue;
    ++colours;
    found = static_cast<int>(colour) + 1;
  }
  return found;
}

std::array<std::vector<cv::Vec3f>, 3> lights_of(const cv::Mat& mosaic) {
  std::array<cv::Mat, 3> bgr;
  cv::split(mosaic, bgr.data());
  const auto &B = bgr[0], &G = bgr[1], &R = bgr[2];
  const auto less = [](const cv::Mat& of, const cv::Mat& one, double share_one, const cv::Mat& other,
                       double share_other) {
    cv::Mat others, result;
    cv::addWeighted(one, share_one, other, share_other, 0, others);
    cv::subtract(of, others, result);
    return circles(result, 1, 6, 1, 15);
  };
  return {less(R, B, 0.65, G, 0.75), less(G, B, 0.65, R, 0.6), less(B, R, 0.6, G, 0.56)};
}

/// 40 robots at random places of ARK's arena, at least `gap_mm` between rims.
Scene forty_robots(std::uint64_t seed, double gap_mm) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> place(-960, 960), turn(-kPi, kPi);
  constexpr std::array<std::uint8_t, 4> kLeds{0, 3, 12, 48};
  Scene scene;
  while (scene.robots.size() < 40) {
    RobotView robot;
    robot.robot = static_cast<std::uint32_t>(scene.robots.size());
    robot.pose = {place(random), place(random), turn(random)};
    robot.led = kLeds.at(robot.robot % 4);
    const bool free = std::none_of(scene.robots.begin(), scene.robots.end(), [&](const RobotView& other) {
      return std::hypot(other.pose.x_mm - robot.pose.x_mm, other.pose.y_mm - robot.pose.y_mm) <
             2 * kRobotRadius_mm + gap_mm;
    });
    if (free) scene.robots.push_back(robot);
  }
  return scene;
}

class ArkRig : public testing::Test {
 protected:
  /// The mosaic that ARK makes of JPEG pictures of the scene.
  static cv::Mat seen(const Scene& scene, const CameraModel& like) {
    const World world((proto::Experiment()));
    std::array<cv::Mat, 4> pictures;
    const auto cameras = ark_cameras(like);
    for (std::size_t i = 0; i < 4; ++i) {
      std::vector<std::uint8_t> jpeg;
      Renderer renderer(world, cameras.at(i));
      cv::imencode(".jpg", renderer.render(scene, 1), jpeg, {cv::IMWRITE_JPEG_QUALITY, 90});
      pictures.at(i) = cv::imdecode(jpeg, cv::IMREAD_COLOR);
    }
    return mosaic_of(pictures, loaded(ark_calibration_xml()));
  }
  static cv::Point2d in_mosaic(const Pose& pose) { return {1000 + pose.x_mm, 1000 - pose.y_mm}; }
};

TEST_F(ArkRig, TheCalibrationHasWhatArkReads) {
  const Calibration calibration = loaded(ark_calibration_xml());
  ASSERT_EQ(calibration.R.size(), 4u);
  ASSERT_EQ(calibration.K.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(cv::norm(calibration.R[i], cv::Mat::eye(3, 3, CV_64F)), 0);
    EXPECT_EQ(calibration.K[i].at<double>(0, 0), 2000);
  }
  // ARK tells left from right and upper from lower by a fifth of the panorama.
  EXPECT_GT(calibration.offset[1].x, calibration.full.width / 5);
  EXPECT_GT(calibration.offset[2].y, calibration.full.height / 5);
}

TEST_F(ArkRig, ArksCirclesFindAllRobotsAndItsFormulaTheirColours) {
  const Scene scene = forty_robots(1, 3);
  const cv::Mat mosaic = seen(scene, {});
  cv::Mat blue;
  cv::extractChannel(mosaic, blue, 0);
  const std::vector<cv::Vec3f> found = circles(blue, 18, 12, 11, 19);
  EXPECT_EQ(found.size(), scene.robots.size());
  const auto lights = lights_of(mosaic);
  double squares = 0;
  int right = 0;
  for (const RobotView& robot : scene.robots) {
    const cv::Point2d truth = in_mosaic(robot.pose);
    double nearest = 1e9;
    for (const cv::Vec3f& circle : found)
      nearest = std::min(nearest, std::hypot(circle[0] - truth.x, circle[1] - truth.y));
    EXPECT_LT(nearest, 5) << "robot " << robot.robot << " at " << truth;
    squares += nearest * nearest;
    int colours = 0;
    const int expected = robot.led == 0 ? 0 : robot.led == 3 ? 1 : robot.led == 12 ? 2 : 3;
    const int read = led_near(lights, truth, colours);
    EXPECT_EQ(read, expected) << "robot " << robot.robot;
    right += read == expected ? 1 : 0;
    EXPECT_EQ(colours, robot.led == 0 ? 0 : 1) << "robot " << robot.robot;
  }
  EXPECT_LT(std::sqrt(squares / static_cast<double>(scene.robots.size())), 1.2)
      << "px RMS: the circles' own grid is 1 px";
  std::printf("measured: ARK's circle detection, %zu robots: %zu found, %.2f px root mean square\n",
              scene.robots.size(), found.size(), std::sqrt(squares / static_cast<double>(scene.robots.size())));
  std::printf("measured: ARK's LED formula, %zu robots: %d right\n", scene.robots.size(), right);
}

TEST_F(ArkRig, TheMosaicHasNoSeamAndOnePixelPerMillimetre) {
  // Plain discs of known centre: what is dark in the mosaic has its centre there, also where two or four cameras meet.
  const World world((proto::Experiment()));
  Look look;
  look.floor = {200, 200, 200};
  look.board = look.battery = look.leg = {0, 0, 0};
  look.floor_texture = 0;
  const auto cameras = ark_cameras({});
  std::vector<Renderer> renderers;
  for (const CameraModel& camera : cameras) renderers.emplace_back(world, camera, look);
  const Calibration calibration = loaded(ark_calibration_xml());
  Scene scene;
  for (int i = 0; i < 25; ++i) {
    RobotView robot;
    robot.pose = {-940.0 + 470 * (i % 5) + 0.37 * i, -940.0 + 470 * (i / 5) - 0.21 * i, 0};
    scene.robots.push_back(robot);
  }
  std::array<cv::Mat, 4> pictures;
  for (std::size_t i = 0; i < 4; ++i) pictures.at(i) = renderers[i].render(scene);
  const cv::Mat mosaic = mosaic_of(pictures, calibration);
  double most_px = 0;
  for (const RobotView& robot : scene.robots) {
    const cv::Point2d truth = in_mosaic(robot.pose);
    const cv::Rect around(static_cast<int>(truth.x) - 22, static_cast<int>(truth.y) - 22, 45, 45);
    cv::Mat channel;
    cv::extractChannel(mosaic(around), channel, 0);
    const cv::Moments moments = cv::moments(200 - channel);
    const cv::Point2d seen(around.x + moments.m10 / moments.m00, around.y + moments.m01 / moments.m00);
    EXPECT_LT(cv::norm(seen - truth), 0.15) << truth;
    EXPECT_NEAR(moments.m00 / 200, CV_PI * kRobotRadius_mm * kRobotRadius_mm, 10) << truth;
    most_px = std::max(most_px, cv::norm(seen - truth));
  }
  std::printf("measured: centre in ARK's mosaic, seams included, %zu places: %.3f px at most\n",
              scene.robots.size(), most_px);
}

TEST_F(ArkRig, RobotsAreFoundThroughARealisticCameraToo) {
  CameraModel like;
  like.read_noise = 2;
  like.shot_noise = 3;
  like.blur_px = 0.7;
  like.vignetting = 0.1;
  const Scene scene = forty_robots(3, 3);
  cv::Mat blue;
  cv::extractChannel(seen(scene, like), blue, 0);
  EXPECT_EQ(circles(blue, 18, 12, 11, 19).size(), scene.robots.size());
}

}  // namespace
}  // namespace kilotwin::cameras
