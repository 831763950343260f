// `kilotwin track` on each kind of source, as a user calls it: pictures, directories, videos, a board; and what it says when
// something is wrong. The stream over HTTP: live_test.cpp.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <sstream>

#include "clients/cameras/renderer.hpp"
#include "idl/experiment.pb.h"
#include "tests/system/program.hpp"

namespace kilotwin::test {
namespace {

constexpr int kRobots = 6, kFrames = 12;

cameras::CameraModel camera() {
  cameras::CameraModel model = cameras::CameraModel::overhead(900, 640, 0.9, 0, 0, 1300);
  model.distortion = {-0.12, 0.03, 0, 0, 0};
  model.read_noise = 2;
  model.blur_px = 0.6;
  return model;
}

/// Robots that drive to the right at 10 mm/s, seen 25 times a second.
cameras::Scene scene(int frame) {
  cameras::Scene scene;
  for (int i = 0; i < kRobots; ++i) {
    cameras::RobotView robot;
    robot.robot = static_cast<std::uint32_t>(i);
    robot.pose = {-330.0 + 110 * i + 10 * frame / 25.0, i % 2 == 0 ? -200.0 : 190.0, 0};
    robot.led = static_cast<std::uint8_t>(i % 3 == 0 ? 3 : i % 3 == 1 ? 12 : 48);
    scene.robots.push_back(robot);
  }
  return scene;
}

std::vector<cv::Mat> film() {
  proto::Experiment experiment;
  experiment.mutable_arena()->set_width_mm(860);
  experiment.mutable_arena()->set_height_mm(600);
  const World world(experiment);
  cameras::Renderer renderer(world, camera());
  std::vector<cv::Mat> pictures(kFrames);
  for (int frame = 0; frame < kFrames; ++frame)
    renderer.render(scene(frame), static_cast<std::uint64_t>(frame), pictures[static_cast<std::size_t>(frame)]);
  return pictures;
}

/// A board of 9x6 inner corners on the floor around the arena's middle, seen by a camera.
cv::Mat board(const cameras::CameraModel& model) {
  constexpr double kSquare_mm = 60, kHalfWidth_mm = 300, kHalfHeight_mm = 210;
  const cameras::CameraModel::ToPlane to_floor(model, 0);
  cv::Mat picture(model.height_px, model.width_px, CV_8UC3);
  for (int row = 0; row < picture.rows; ++row) {
    for (int column = 0; column < picture.cols; ++column) {
      int level = 0;
      for (int sample = 0; sample < 4; ++sample) {
        const cv::Point2d at = to_floor({column - 0.25 + 0.5 * (sample % 2), row - 0.25 + 0.5 * (sample / 2)});
        const double x = at.x + kHalfWidth_mm, y = at.y + kHalfHeight_mm;
        const bool inside = x >= 0 && y >= 0 && x < 2 * kHalfWidth_mm && y < 2 * kHalfHeight_mm;
        level +=
            inside && (static_cast<int>(x / kSquare_mm) + static_cast<int>(y / kSquare_mm)) % 2 == 0 ? 40 : 215;
      }
      picture.at<cv::Vec3b>(row, column) = cv::Vec3b::all(static_cast<unsigned char>(level / 4));
    }
  }
  return picture;
}

class TrackCommand : public testing::Test {
 protected:
  Outcome track(Words words) {
    words.insert(words.begin(), {KILOTWIN_VISION, "track"});
    return Process(words, scratch.path()).wait(100);
  }
  /// Rows per frame of a table.
  std::map<int, int> rows(const std::string& table) {
    std::map<int, int> count;
    std::istringstream lines(read(scratch / table));
    std::string line;
    std::getline(lines, line);
    EXPECT_TRUE(line.starts_with("frame,time_s,track,x_px,y_px,radius_px,heading_rad,led")) << line;
    while (std::getline(lines, line)) ++count[std::stoi(line)];
    return count;
  }
  void expect_all(const std::string& table) {
    const std::map<int, int> count = rows(table);
    ASSERT_EQ(count.size(), static_cast<std::size_t>(kFrames));
    for (const auto& [frame, robots] : count) EXPECT_EQ(robots, kRobots) << "frame " << frame;
  }
  void refused(const Words& words, const std::string& text) {
    const Outcome outcome = track(words);
    EXPECT_EQ(outcome.status, 2) << outcome.err;
    EXPECT_NE(outcome.err.find(text), std::string::npos) << outcome.err;
  }

  Scratch scratch;
};

TEST_F(TrackCommand, PicturesDirectoriesAndVideos) {
  const std::vector<cv::Mat> pictures = film();
  std::filesystem::create_directories(scratch / "pictures");
  cv::VideoWriter video(scratch / "film.avi", cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 25, pictures[0].size());
  ASSERT_TRUE(video.isOpened());
  for (int frame = 0; frame < kFrames; ++frame) {
    const cv::Mat& picture = pictures[static_cast<std::size_t>(frame)];
    cv::imwrite(scratch / fmt::format("pictures/{:03}.png", frame), picture);
    video.write(picture);
  }
  video.release();
  ASSERT_EQ(track({"pictures", "--out", "pictures.csv", "--rate", "25", "--quiet"}).status, 0);
  expect_all("pictures.csv");
  ASSERT_EQ(track({"film.avi", "--out", "film.csv", "--quiet"}).status, 0);
  expect_all("film.csv");
  EXPECT_NE(read(scratch / "film.csv").find("\n11,0.440000,"), std::string::npos) << "25 frames a second";
  ASSERT_EQ(track({"pictures/003.png", "--out", "one.csv", "--quiet"}).status, 0);
  EXPECT_EQ(rows("one.csv"), (std::map<int, int>{{0, kRobots}}));
  refused({"pictures", "--out", "one.csv"}, "--force");
}

TEST_F(TrackCommand, RobotsThatAreTooSmallAreTold) {
  cv::Mat small;
  const cv::Mat whole = film()[0];
  constexpr double kRadius_px = 6.5;
  const double by = kRadius_px / (16.5 * 0.9);
  cv::resize(whole, small, {}, by, by, cv::INTER_AREA);
  cv::imwrite(scratch / "small.png", small);
  cv::imwrite(scratch / "whole.png", whole);
  const Outcome told = track({"small.png", "--out", "small.csv", "--quiet"});
  EXPECT_EQ(told.status, 0);
  EXPECT_NE(told.err.find("radius of 6."), std::string::npos) << told.err;
  EXPECT_NE(told.err.find("times the resolution"), std::string::npos) << told.err;
  EXPECT_EQ(track({"whole.png", "--out", "whole.csv", "--quiet"}).err, "");
}

TEST_F(TrackCommand, ABoardGivesMillimetres) {
  std::filesystem::create_directories(scratch / "board");
  cv::imwrite(scratch / "board/0.png", board(camera()));
  int number = 1;
  for (const auto& [tilt_x, tilt_y] : {std::pair{0.3, 0.0}, {-0.25, 0.2}, {0.1, -0.3}, {-0.1, -0.3}, {0.2, 0.25}}) {
    cameras::CameraModel tilted = camera();
    cv::Mat turn;
    cv::Rodrigues(cv::Vec3d(tilt_x, tilt_y, 0.1 * number), turn);
    tilted.R = cv::Matx33d(turn) * tilted.R;
    // It still looks at the board's middle.
    tilted.position_mm = tilted.R.t() * cv::Vec3d(12.0 * number - 40, 8.0 * number - 20, -1350);
    cv::imwrite(scratch / fmt::format("board/{}.png", number++), board(tilted));
  }
  const Outcome outcome = track({"board", "--calibrate", "camera.yaml", "--board", "9x6", "--square", "60"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("lens and pose, from 6 of 6 pictures"), std::string::npos) << outcome.out;

  cv::imwrite(scratch / "robots.png", film()[0]);
  ASSERT_EQ(track({"robots.png", "--calibration", "camera.yaml", "--out", "robots.csv", "--quiet"}).status, 0);
  std::istringstream lines(read(scratch / "robots.csv"));
  std::string line;
  std::getline(lines, line);
  EXPECT_TRUE(line.ends_with(",x_mm,y_mm")) << line;
  const cameras::Scene truth = scene(0);
  double squares = 0;
  int robots = 0;
  while (std::getline(lines, line)) {
    const std::size_t last = line.rfind(','), before = line.rfind(',', last - 1);
    const double x = std::stod(line.substr(before + 1)), y = std::stod(line.substr(last + 1));
    double nearest = 1e9;
    for (const cameras::RobotView& robot : truth.robots)
      nearest = std::min(nearest, std::hypot(robot.pose.x_mm - x, robot.pose.y_mm - y));
    squares += nearest * nearest;
    ++robots;
  }
  ASSERT_EQ(robots, kRobots);
  EXPECT_LT(std::sqrt(squares / robots), 1);
  std::printf("checkerboard by the command: %.3f mm\n", std::sqrt(squares / robots));
  refused({"robots.png", "--calibrate", "none.yaml", "--board", "9x6", "--square", "60"}, "no such board");
  refused({"board", "--calibrate", "none.yaml"}, "--board 9x6 --square 25");
  refused({"board", "--calibrate", "none.yaml", "--board", "nine", "--square", "60"}, "--board nine");
}

TEST_F(TrackCommand, WhatIsWrongIsSaid) {
  write(scratch / "text.avi", "no video");
  write(scratch / "text.png", "no picture");
  std::filesystem::create_directories(scratch / "empty");
  refused({"nowhere.mp4", "--out", "t.csv"}, "nowhere.mp4: does not exist");
  refused({"text.avi", "--out", "t.csv"}, "text.avi: is neither a picture nor a video");
  refused({"text.png", "--out", "t.csv"}, "text.png: is no picture");
  refused({"empty", "--out", "t.csv"}, "empty: holds no pictures");
  refused({"97", "--out", "t.csv"}, "97: no camera or stream");
  refused({"http://127.0.0.1:1/camera.mjpg", "--out", "t.csv"}, "no camera or stream");
  refused({"empty"}, "--out F.csv, --domain N");
  refused({"empty", "--out", "t.csv", "--identify"}, "--identify");
  refused({"empty", "--out", "t.csv", "--calibration", "missing.xml", "--arena", "2000x2000"}, "missing.xml");
  cv::imwrite(scratch / "dark.png", cv::Mat(480, 640, CV_8UC3, cv::Scalar::all(30)));
  const Outcome dark = track({"dark.png", "--out", "dark.csv"});
  EXPECT_EQ(dark.status, 0);
  EXPECT_NE(dark.err.find("no robots are found; their discs must be darker than the floor"), std::string::npos)
      << dark.err;
  EXPECT_TRUE(rows("dark.csv").empty()) << "a picture without robots is no error";
}

}  // namespace
}  // namespace kilotwin::test
