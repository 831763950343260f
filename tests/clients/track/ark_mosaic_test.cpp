// ARK's calibration with lens and rotation: four rendered cameras become one picture, and robots are where they are.
#include "clients/track/ark_mosaic.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <random>

#include "clients/cameras/ark_rig.hpp"
#include "clients/cameras/renderer.hpp"
#include "clients/track/tracker.hpp"
#include "core/base/error.hpp"
#include "idl/experiment.pb.h"

namespace kilotwin::track {
namespace {

namespace fs = std::filesystem;

constexpr double kHalf_mm = 1000;
const cv::Size2d kArena{2 * kHalf_mm, 2 * kHalf_mm};

class ArkMosaics : public testing::Test {
 protected:
  void SetUp() override {
    directory_ = fs::temp_directory_path() / fmt::format("kilotwin-mosaic-{}", getpid());
    fs::remove_all(directory_);
    fs::create_directories(directory_);
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> place(-950, 950), turn(-3, 3);
    const auto add = [&](double x, double y) {
      cameras::RobotView robot;
      robot.robot = static_cast<std::uint32_t>(scene_.robots.size());
      robot.pose = {x, y, turn(random)};
      robot.led = static_cast<std::uint8_t>(3 << 2 * (robot.robot % 3));
      scene_.robots.push_back(robot);
    };
    // On the seams, in the corners, and anywhere.
    for (const double at : {-700.0, -150.0, 0.0, 330.0, 900.0}) {
      add(at, 3);
      if (at != 0) add(-2, at);
    }
    for (const double x : {-960.0, 960.0}) {
      for (const double y : {-960.0, 960.0}) add(x, y);
    }
    while (scene_.robots.size() < 45) {
      const double x = place(random), y = place(random);
      const bool free =
          std::none_of(scene_.robots.begin(), scene_.robots.end(), [&](const cameras::RobotView& other) {
            return std::hypot(other.pose.x_mm - x, other.pose.y_mm - y) < 40;
          });
      if (free) add(x, y);
    }
  }
  void TearDown() override { fs::remove_all(directory_); }

  void write_frame(int number, const std::array<cameras::CameraModel, 4>& cameras) const {
    const World world{proto::Experiment()};
    for (std::size_t i = 0; i < cameras.size(); ++i) {
      cameras::Renderer renderer(world, cameras.at(i));
      cv::imwrite((directory_ / fmt::format("frame_{:05}_{}.jpg", number, i)).string(), renderer.render(scene_, 1),
                  {cv::IMWRITE_JPEG_QUALITY, 92});
    }
  }
  [[nodiscard]] fs::path write_xml(const std::string& xml) const {
    std::ofstream(directory_ / "calibration.xml") << xml;
    return directory_ / "calibration.xml";
  }
  /// Root mean square distance of the tracked robots from the truth; counts those that belong to none.
  double error_mm(const fs::path& calibration, int* strangers, std::size_t* found) {
    ArkDirectory source(directory_, {}, *read_ark_calibration(calibration, kArena));
    PictureTracker tracker(source.floor());
    const std::optional<CapturedFrame> frame = source.next(stop_);
    EXPECT_TRUE(frame);
    const std::vector<TrackedRobot> robots = tracker.process(frame->picture, 0);
    *found = robots.size();
    double squares = 0;
    *strangers = 0;
    for (const TrackedRobot& robot : robots) {
      double nearest = 1e9;
      for (const cameras::RobotView& truth : scene_.robots)
        nearest = std::min(
            nearest, std::hypot(truth.pose.x_mm - robot.position.x_mm, truth.pose.y_mm - robot.position.y_mm));
      *strangers += nearest > 10 ? 1 : 0;
      squares += nearest > 10 ? 0 : nearest * nearest;
    }
    return std::sqrt(squares / static_cast<double>(std::max<std::size_t>(1, robots.size())));
  }

  fs::path directory_;
  cameras::Scene scene_;
  std::atomic<bool> stop_{false};
};

TEST_F(ArkMosaics, LensAndSeamsAreCorrected) {
  cameras::CameraModel like;
  like.distortion = {-0.11, 0.03, 0, 0.001, -0.0006};
  like.read_noise = 3;
  like.blur_px = 0.7;
  write_frame(0, cameras::ark_cameras(like));
  int strangers = 0;
  std::size_t found = 0;
  const double corrected = error_mm(write_xml(cameras::ark_calibration_xml(like.distortion)), &strangers, &found);
  EXPECT_EQ(strangers, 0);
  EXPECT_EQ(found, scene_.robots.size());
  EXPECT_LT(corrected, 0.2);
  // The lens matters: without it robots are far off.
  const double uncorrected = error_mm(write_xml(cameras::ark_calibration_xml()), &strangers, &found);
  EXPECT_GT(uncorrected, 2);
  std::printf("four cameras with a lens: %.3f mm; without the lens in the file: %.1f mm\n", corrected, uncorrected);
}

/// Four cameras in one place above the arena's middle, each turned to a quarter of it: what K and R of ARK's file describe.
TEST_F(ArkMosaics, RotatedCamerasAreJoined) {
  constexpr double kHeight_mm = 1900, kFocal_px = 1750;
  std::array<cameras::CameraModel, 4> turned;
  std::vector<cv::Mat> Ks, Rs;
  for (std::size_t i = 0; i < 4; ++i) {
    cameras::CameraModel& camera = turned.at(i);
    camera.width_px = kArkWidth_px;
    camera.height_px = kArkHeight_px;
    camera.K = cv::Matx33d(kFocal_px, 0, 1020 + 5.0 * static_cast<double>(i), 0, kFocal_px, 770, 0, 0, 1);
    camera.position_mm = {0, 0, kHeight_mm};
    camera.read_noise = 2;
    camera.blur_px = 0.6;
    cv::Mat turn;
    // Towards its quarter, and a little about the axis.
    const double right = i % 2 == 0 ? -1 : 1, down = i / 2 == 0 ? -1 : 1;
    cv::Rodrigues(cv::Vec3d(-0.27 * down, 0.27 * right, 0.03 * (static_cast<double>(i) - 1.5)), turn);
    const cv::Matx33d to_panorama(turn);
    // The panorama looks straight down: x right, y down.
    camera.R = to_panorama.t() * cv::Matx33d(1, 0, 0, 0, -1, 0, 0, 0, -1);
    Ks.emplace_back(cv::Mat(camera.K).clone());
    Rs.emplace_back(cv::Mat(to_panorama).clone());
  }
  write_frame(0, turned);
  // The arena's corners in the panorama, as ARK shrinks it: all pictures' corners bound it.
  double left = 1e9, top = 1e9, wide = -1e9, low = -1e9;
  for (std::size_t i = 0; i < 4; ++i) {
    double own_left = 1e9, own_top = 1e9, own_right = -1e9, own_low = -1e9;
    for (const double x : {0.0, kArkWidth_px - 1.0}) {
      for (const double y : {0.0, kArkHeight_px - 1.0}) {
        const cv::Vec3d ray = cv::Matx33d(Rs[i]) * (turned.at(i).K.inv() * cv::Vec3d(x, y, 1));
        own_left = std::min(own_left, 2000 * ray[0] / ray[2]);
        own_right = std::max(own_right, 2000 * ray[0] / ray[2]);
        own_top = std::min(own_top, 2000 * ray[1] / ray[2]);
        own_low = std::max(own_low, 2000 * ray[1] / ray[2]);
      }
    }
    left = std::min(left, std::trunc(own_left));
    top = std::min(top, std::trunc(own_top));
    wide = std::max(wide, std::trunc(own_right) + 1);
    low = std::max(low, std::trunc(own_low) + 1);
  }
  const double width = wide - left, height = low - top;
  cv::FileStorage file("c.xml", cv::FileStorage::WRITE | cv::FileStorage::MEMORY);
  for (int corner = 0; corner < 4; ++corner) {
    const double x = 2000 / kHeight_mm * (corner % 2 == 0 ? -kHalf_mm : kHalf_mm);
    const double y = 2000 / kHeight_mm * (corner / 2 == 0 ? -kHalf_mm : kHalf_mm);
    file << fmt::format("corner{}", corner + 1)
         << cv::Point2f(static_cast<float>((x - left + 0.5) * 1536 / width - 0.5),
                        static_cast<float>((y - top + 0.5) * 1536 / height - 0.5));
  }
  file << "R" << Rs << "K" << Ks;
  int strangers = 0;
  std::size_t found = 0;
  const double error = error_mm(write_xml(file.releaseAndGetString()), &strangers, &found);
  EXPECT_EQ(strangers, 0);
  EXPECT_EQ(found, scene_.robots.size());
  EXPECT_LT(error, 0.3);
  std::printf("four rotated cameras: %.3f mm\n", error);
}

TEST_F(ArkMosaics, WhatIsMissingIsNamed) {
  write_frame(4, cameras::ark_cameras({}));
  const fs::path xml = write_xml(cameras::ark_calibration_xml());
  EXPECT_TRUE(is_ark_directory(directory_));
  const auto refused = [&](const auto& action, const std::string& words) {
    try {
      action();
      ADD_FAILURE() << "accepted; expected: " << words;
    } catch (const UserError& error) {
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
    }
  };
  fs::remove(directory_ / "frame_00004_2.jpg");
  ArkDirectory source(directory_, {}, *read_ark_calibration(xml, kArena));
  refused([&] { static_cast<void>(source.next(stop_)); }, "frame_00004_2.jpg");
  cv::imwrite((directory_ / "frame_00004_2.jpg").string(), cv::Mat(20, 20, CV_8UC3, cv::Scalar::all(9)));
  ArkDirectory small(directory_, {}, *read_ark_calibration(xml, kArena));
  refused([&] { static_cast<void>(small.next(stop_)); }, "20x20");
  refused([&] { static_cast<void>(read_ark_calibration(xml, {})); }, "--arena");
  const std::string good = cameras::ark_calibration_xml();
  std::string three = good;
  three.replace(three.find("<R>"), 3, "<R><_>1</_>");
  refused([&] { static_cast<void>(read_ark_calibration(write_xml(three), kArena)); }, "calibration.xml");
  EXPECT_FALSE(read_ark_calibration(
      write_xml("<?xml version=\"1.0\"?><opencv_storage><corner1>1 2</corner1></opencv_storage>"), kArena));
  // Cut and damaged files end with an error, never otherwise.
  std::mt19937_64 random(8);
  int joined = 0;
  for (int trial = 0; trial < 300; ++trial) {
    std::string bad = good.substr(0, good.size() - random() % (good.size() / 2));
    for (int i = 0; i < 6; ++i) bad[random() % bad.size()] = static_cast<char>(random() % 96 + 32);
    try {
      const auto read = read_ark_calibration(write_xml(bad), kArena);
      if (read && ++joined <= 4) static_cast<void>(ArkMosaic(*read).floor());
    } catch (const UserError&) {}
  }
}

}  // namespace
}  // namespace kilotwin::track
