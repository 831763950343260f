// `kilotwin identify` on films: it tracks them first.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <opencv2/videoio.hpp>

#include "clients/cameras/renderer.hpp"
#include "clients/identify/data/measured_set.hpp"
#include "idl/experiment.pb.h"
#include "tests/system/program.hpp"

namespace kilotwin::test {
namespace {

constexpr double kSpeed_mm_s = 8, kFrameRate_hz = 4;
constexpr int kRobots = 4, kFrames = 140;

/// Robots that drive to the right, each on its own line.
cameras::Scene scene(int frame, double offset_mm) {
  cameras::Scene scene;
  for (int i = 0; i < kRobots; ++i) {
    cameras::RobotView robot;
    robot.robot = static_cast<std::uint32_t>(i);
    robot.pose = {-320 + offset_mm + kSpeed_mm_s * frame / kFrameRate_hz, -210.0 + 140 * i, 0};
    robot.led = 12;
    scene.robots.push_back(robot);
  }
  return scene;
}

void film(const std::string& file, double offset_mm) {
  proto::Experiment experiment;
  experiment.mutable_arena()->set_width_mm(860);
  experiment.mutable_arena()->set_height_mm(600);
  const World world(experiment);
  cameras::Renderer renderer(world, cameras::CameraModel::overhead(780, 560, 0.8, 0, 0, 1300));
  cv::VideoWriter video(file, cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), kFrameRate_hz, {780, 560});
  ASSERT_TRUE(video.isOpened());
  cv::Mat picture;
  for (int frame = 0; frame < kFrames; ++frame) {
    renderer.render(scene(frame, offset_mm), static_cast<std::uint64_t>(frame), picture);
    video.write(picture);
  }
}

TEST(IdentifyFilms, TracksThemFirst) {
  const Scratch scratch;
  std::filesystem::create_directories(scratch / "films");
  film(scratch / "films/one.avi", 0);
  film(scratch / "films/two.avi", 60);
  const Outcome outcome =
      Process({KILOTWIN_IDENTIFY, "identify", "--train", scratch / "films", "--out", scratch / "found", "--quiet"},
              scratch.path())
          .wait(200);
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const identify::MeasuredSet set = identify::load_measured_set(scratch / "found/imported-train");
  ASSERT_EQ(set.runs.size(), 2U);
  EXPECT_EQ(set.runs[0].name, "one");
  EXPECT_EQ(set.robots().size(), 2U * kRobots) << "tracks of a film have no numbers that the other film shares";
  const nlohmann::json result = nlohmann::json::parse(read(scratch / "found/result.json"));
  // Without a calibration the discs give the scale, within some per cent.
  EXPECT_NEAR(result.at("base").at("straight_speed_mm_s").get<double>(), kSpeed_mm_s, 0.06 * kSpeed_mm_s);
}

TEST(IdentifyFilms, AFilmThatCannotBeReadIsNamed) {
  const Scratch scratch;
  std::filesystem::create_directories(scratch / "films");
  write(scratch / "films/broken.mp4", "no film");
  const Outcome outcome =
      Process({KILOTWIN_IDENTIFY, "identify", "--train", scratch / "films", "--out", scratch / "found", "--quiet"},
              scratch.path())
          .wait(100);
  EXPECT_EQ(outcome.status, 1);
  EXPECT_NE(outcome.err.find("broken.mp4: cannot be tracked: "), std::string::npos) << outcome.err;
  EXPECT_FALSE(std::filesystem::exists(scratch / "found")) << "an unfinished result is removed";
}

TEST(IdentifyFilms, TablesOfAStatedFormatCountBesideFilms) {
  const Scratch scratch;
  std::filesystem::create_directories(scratch / "data");
  write(scratch / "data/broken.mp4", "no film");
  std::string rows = "id,t,px,py\n";
  for (int robot = 0; robot < kRobots; ++robot)
    for (int k = 0; k < 80; ++k)
      rows += fmt::format("{},{},{},{}\n", robot, 0.5 * k, kSpeed_mm_s * 0.5 * k + 3 * std::sin(k), 90 * robot);
  write(scratch / "data/monday.csv", rows);
  const Outcome outcome = Process({KILOTWIN_IDENTIFY, "identify", "--train", scratch / "data", "--out",
                                   scratch / "found", "--quiet", "--columns", "time=t,robot=id,x=px,y=py"},
                                  scratch.path())
                              .wait(200);
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(identify::load_measured_set(scratch / "found/imported-train").runs.at(0).name, "monday");
}

}  // namespace
}  // namespace kilotwin::test
