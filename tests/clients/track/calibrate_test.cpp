// Calibration from drawn boards with a known camera, and its files.
#include "clients/track/calibrate.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <random>

#include "core/base/error.hpp"

namespace kilotwin::track {
namespace {

constexpr int kColumns = 9, kRows = 6;
constexpr double kSquare_mm = 85;
const cv::Size kPicture(960, 720);

/// A camera above the floor with a lens; the first pose looks straight down from 1500 mm.
struct Camera {
  cv::Matx33d intrinsic{825, 0, 480, 0, 825, 360, 0, 0, 1};
  std::vector<double> distortion{-0.12, 0.03, 0, 0};
  cv::Vec3d rotation, translation_mm;
};

Camera camera_at(double tilt_x, double tilt_y, double turn) {
  Camera camera;
  // y up on the floor is y down in the picture.
  const cv::Matx33d down(1, 0, 0, 0, -1, 0, 0, 0, -1);
  cv::Mat x, y, z;
  cv::Rodrigues(cv::Vec3d(tilt_x, 0, 0), x);
  cv::Rodrigues(cv::Vec3d(0, tilt_y, 0), y);
  cv::Rodrigues(cv::Vec3d(0, 0, turn), z);
  cv::Mat vector;
  cv::Rodrigues(cv::Mat(cv::Matx33d(x) * cv::Matx33d(y) * down * cv::Matx33d(z)), vector);
  camera.rotation = cv::Vec3d(vector);
  camera.translation_mm = {15, -25, 1500};
  return camera;
}

/// The board as that camera sees it
cv::Mat picture_of(const Camera& camera) {
  CameraPose pose;
  pose.intrinsic = camera.intrinsic;
  pose.distortion = cv::Mat(camera.distortion, true);
  cv::Mat rotation;
  cv::Rodrigues(camera.rotation, rotation);
  pose.rotation = cv::Matx33d(rotation);
  pose.translation_mm = camera.translation_mm;
  const double half_w = 0.5 * (kColumns + 1) * kSquare_mm, half_h = 0.5 * (kRows + 1) * kSquare_mm;
  constexpr int kSub = 2;
  std::vector<cv::Point2d> pixels, ideal;
  for (int row = 0; row < kPicture.height * kSub; ++row) {
    for (int column = 0; column < kPicture.width * kSub; ++column)
      pixels.emplace_back((column + 0.5) / kSub - 0.5, (row + 0.5) / kSub - 0.5);
  }
  cv::undistortPoints(pixels, ideal, camera.intrinsic, camera.distortion);
  const cv::Matx33d& r = pose.rotation;
  const cv::Vec3d& t = pose.translation_mm;
  const cv::Matx33d to_floor =
      cv::Matx33d(r(0, 0), r(0, 1), t[0], r(1, 0), r(1, 1), t[1], r(2, 0), r(2, 1), t[2]).inv();
  cv::Mat fine(kPicture.height * kSub, kPicture.width * kSub, CV_8U);
  for (std::size_t i = 0; i < ideal.size(); ++i) {
    const cv::Vec3d p = to_floor * cv::Vec3d(ideal[i].x, ideal[i].y, 1);
    const double x = p[0] / p[2] + half_w, y = p[1] / p[2] + half_h;
    const bool on_board = x >= 0 && y >= 0 && x < 2 * half_w && y < 2 * half_h;
    const bool dark = on_board && (static_cast<int>(x / kSquare_mm) + static_cast<int>(y / kSquare_mm)) % 2 == 0;
    fine.data[i] = static_cast<unsigned char>(dark ? 40 : 215);
  }
  cv::Mat picture;
  cv::resize(fine, picture, kPicture, 0, 0, cv::INTER_AREA);
  cv::GaussianBlur(picture, picture, cv::Size(), 0.7);
  return picture;
}

/// Pixel of a floor point at a height, by the true camera.
Point true_pixel(const Camera& camera, double x_mm, double y_mm, double z_mm) {
  const std::vector<cv::Point3d> points{{x_mm, y_mm, z_mm}};
  std::vector<cv::Point2d> pixels;
  cv::projectPoints(points, camera.rotation, camera.translation_mm, camera.intrinsic, camera.distortion, pixels);
  return {pixels[0].x, pixels[0].y};
}

TEST(Calibrate, LensAndPoseGiveMillimetresAtTheDiscsHeight) {
  constexpr double kHeight_mm = 30;
  std::vector<cv::Mat> pictures{picture_of(camera_at(0, 0, 0))};
  for (const auto& [x, y] : {std::pair{0.35, 0.0}, {-0.3, 0.2}, {0.1, -0.35}, {-0.2, -0.25}})
    pictures.push_back(picture_of(camera_at(x, y, 0.2)));
  const Calibration calibration = calibrate(pictures, {kColumns, kRows, kSquare_mm}, kHeight_mm);
  EXPECT_EQ(calibration.pictures, 5);
  EXPECT_LT(calibration.residual_px, 0.3);
  const Camera camera = camera_at(0, 0, 0);
  double squares = 0;
  int count = 0;
  for (double x = -300; x <= 300; x += 100) {
    for (double y = -200; y <= 200; y += 100) {
      const FloorPoint at = calibration.map.floor(true_pixel(camera, x, y, kHeight_mm));
      squares += std::pow(at.x_mm - x, 2) + std::pow(at.y_mm - y, 2);
      ++count;
    }
  }
  // At the floor's height the error would be 30 / 1500 of the distance from the middle: 4 mm on average.
  EXPECT_LT(std::sqrt(squares / count), 1);
}

TEST(Calibrate, OnePictureGivesAPlane) {
  const Calibration calibration =
      calibrate({picture_of(camera_at(0.15, 0.1, 0))}, {kColumns, kRows, kSquare_mm}, 0);
  EXPECT_FALSE(calibration.map.camera_pose());
  EXPECT_LT(calibration.residual_mm, 1);
  EXPECT_THROW(static_cast<void>(calibrate({picture_of(camera_at(0, 0, 0))}, {kColumns, kRows, kSquare_mm}, 20)),
               UserError);
  EXPECT_THROW(static_cast<void>(calibrate({cv::Mat(400, 400, CV_8U, cv::Scalar(90))}, {9, 6, 20}, 0)), UserError);
}

TEST(FloorMaps, PixelAndFloorAreInverse) {
  CameraPose pose;
  const Camera camera = camera_at(0.2, -0.1, 0.3);
  pose.intrinsic = camera.intrinsic;
  pose.distortion = cv::Mat(camera.distortion, true);
  cv::Mat rotation;
  cv::Rodrigues(camera.rotation, rotation);
  pose.rotation = cv::Matx33d(rotation);
  pose.translation_mm = camera.translation_mm;
  pose.disc_height_mm = 25;
  for (const FloorMap& map : {FloorMap::scale({800, 600}, 1.3), FloorMap::camera(pose)}) {
    for (const Point pixel : {Point{100, 80}, Point{640, 480}, Point{900, 650}}) {
      const Point back = map.pixel(map.floor(pixel));
      EXPECT_NEAR(back.x_px, pixel.x_px, 1e-3);
      EXPECT_NEAR(back.y_px, pixel.y_px, 1e-3);
    }
  }
  // Up in the picture is up on the floor.
  EXPECT_NEAR(FloorMap::scale({800, 600}, 1.3).floor_direction({10, 10}, 1.2), 1.2, 1e-9);
}

TEST(CalibrationFile, ReadsWhatItWrote) {
  const std::filesystem::path file =
      std::filesystem::temp_directory_path() / ("kilotwin-calibration-" + std::to_string(getpid()) + ".yaml");
  Calibration calibration{
      FloorMap::plane({1.5, 0.1, 300, 0.05, -1.4, 200, 1e-5, 2e-5, 1}), {640, 480}, 0.2, 0.3, 1};
  write_calibration(calibration, file);
  const FloorMap plane = read_calibration(file, {});
  CameraPose pose;
  pose.intrinsic = {900, 0, 320, 0, 900, 240, 0, 0, 1};
  pose.distortion = (cv::Mat_<double>(1, 4) << -0.1, 0.01, 0, 0);
  pose.rotation = {1, 0, 0, 0, -1, 0, 0, 0, -1};
  pose.translation_mm = {0, 0, 1200};
  pose.disc_height_mm = 20;
  calibration.map = FloorMap::camera(pose);
  write_calibration(calibration, file);
  const FloorMap camera = read_calibration(file, {});
  const Point pixel{123, 45};
  EXPECT_NEAR(camera.floor(pixel).x_mm, calibration.map.floor(pixel).x_mm, 1e-9);
  EXPECT_NEAR(plane.floor(pixel).y_mm,
              FloorMap::plane({1.5, 0.1, 300, 0.05, -1.4, 200, 1e-5, 2e-5, 1}).floor(pixel).y_mm, 1e-9);

  std::ofstream(file) << "%YAML:1.0\n---\ncorner1: [ 100., 50. ]\ncorner2: [ 900., 50. ]\ncorner3: [ 100., 450. ]\n"
                         "corner4: [ 900., 450. ]\n";
  const FloorMap corners = read_calibration(file, {2000, 1000});
  EXPECT_NEAR(corners.floor({500, 250}).x_mm, 0, 1e-3);
  EXPECT_NEAR(corners.floor({900, 50}).y_mm, 500, 1e-3);
  EXPECT_THROW(static_cast<void>(read_calibration(file, {})), UserError);
  // Damaged files are errors for people.
  std::mt19937_64 random(2);
  write_calibration(calibration, file);
  std::ifstream in(file);
  const std::string text((std::istreambuf_iterator<char>(in)), {});
  for (int trial = 0; trial < 200; ++trial) {
    std::string damaged = text;
    for (int i = 0; i < 3; ++i) damaged[random() % damaged.size()] = static_cast<char>(32 + random() % 90);
    std::ofstream(file, std::ios::trunc) << damaged.substr(0, random() % (damaged.size() + 1));
    try {
      static_cast<void>(read_calibration(file, {2000, 1000}));
    } catch (const UserError&) {}
  }
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace kilotwin::track
