// The command above a live run: what its pictures show is what the run recorded at the tick of their stamps.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <chrono>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "clients/cameras/ark_rig.hpp"
#include "clients/cameras/picture_file.hpp"
#include "clients/cameras/renderer.hpp"
#include "clients/cameras/scenes.hpp"
#include "core/dds/dds.hpp"
#include "core/os/files.hpp"
#include "idl/experiment.pb.h"
#include "tests/system/own_domain.hpp"
#include "tests/system/program.hpp"

namespace kilotwin::cameras {
namespace {

using test::Process;
using test::Scratch;

constexpr const char* kExperiment = R"(
name: "filmed"
duration_s: 6
arena { width_mm: 600 height_mm: 400 }
robots { count: 9 behaviour: "disperse.c" layout { grid { pitch_mm: 45 } } }
recording { every_s: 0.032768 }
)";

cv::Mat decoded(const std::string& file) {
  return cv::imdecode(std::vector<std::uint8_t>(file.begin(), file.end()), cv::IMREAD_COLOR);
}

/// The recorded scenes of a run by their ticks.
std::map<std::int64_t, Scene> recorded_scenes(const std::string& recording) {
  std::map<std::int64_t, Scene> scenes;
  recorder::Reader reader(recording);
  while (const proto::StateRecord* state = reader.next_state()) {
    Scene scene;
    for (int i = 0; i < state->x_mm_size(); ++i) {
      RobotView robot;
      robot.robot = static_cast<std::uint32_t>(i);
      robot.pose = {state->x_mm(i), state->y_mm(i), state->heading_rad(i)};
      robot.led = static_cast<std::uint8_t>(state->led()[static_cast<std::size_t>(i)]);
      scene.robots.push_back(robot);
    }
    scenes[state->tick()] = scene;
  }
  return scenes;
}

class LiveCamerasTest : public testing::Test {
 protected:
  void SetUp() override {
    test::write(scratch / "disperse.c", test::read(test::source("behaviours/disperse.c")));
    test::write(scratch / "filmed.txtpb", kExperiment);
  }
  Scratch scratch;
};

TEST_F(LiveCamerasTest, PicturesShowWhatWasRecordedAtTheirTick) {
  const test::OwnDomain domain;
  Process cameras(
      {KILOTWIN_VISION, "cameras", "--domain", domain.name, "--one-run", "--picture", scratch / "arena.png",
       "--dir", scratch / "frames", "--mjpeg", "0", "--size", "640x480", "--quality", "95"},
      scratch.path());
  ASSERT_TRUE(cameras.says("four cameras for ARK", 60));
  Process run({test::program(), "run", scratch / "filmed.txtpb", "--quiet", "--pace", "1", "--domain", domain.name,
               "--out", scratch / "run"},
              scratch.path());
  // Reads the big picture whenever it changes, and ARK's files as ARK does.
  std::map<std::int64_t, std::string> big, ark;
  std::uint32_t frame = 0;
  while (cameras.running()) {
    if (const auto file = os::read_if_there(scratch / "arena.png")) {
      const auto stamp = stamp_of(*file);
      ASSERT_TRUE(stamp) << file->size() << " bytes: " << file->substr(0, 200);
      const auto now =
          std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now().time_since_epoch())
              .count();
      EXPECT_LE(stamp->capture_ns, now);
      big[stamp->tick] = *file;
    }
    std::vector<std::string> files;
    for (int camera = 0; camera < kArkCameras; ++camera) {
      if (auto file = os::read_if_there(scratch / fmt::format("frames/frame_{:05}_{}.jpg", frame, camera)))
        files.push_back(std::move(*file));
    }
    if (files.size() == kArkCameras) {
      for (const std::string& file : files) EXPECT_EQ(stamp_of(file)->tick, stamp_of(files.front())->tick);
      ark[stamp_of(files.front())->tick] = files.front();
      ++frame;
    }
    test::sleep_briefly();
  }
  EXPECT_EQ(cameras.wait().status, 0);
  ASSERT_EQ(run.wait().status, 0);
  EXPECT_FALSE(test::read(scratch / "frames/calibration.xml").empty());

  const auto scenes = recorded_scenes(scratch / "run/recording.ktrec");
  proto::Experiment experiment;
  experiment.mutable_arena()->set_width_mm(600);
  experiment.mutable_arena()->set_height_mm(400);
  const World world(experiment);
  Renderer above(world, CameraModel::overhead(640, 480, 640.0 / 680));
  EXPECT_GE(big.size(), 5u);
  for (const auto& [tick, file] : big) {
    ASSERT_TRUE(scenes.contains(tick)) << tick;
    EXPECT_EQ(cv::norm(decoded(file), above.render(scenes.at(tick)), cv::NORM_INF), 0) << "tick " << tick;
  }
  Renderer first(world, ark_cameras({}).front());
  EXPECT_GE(ark.size(), 3u);
  for (const auto& [tick, file] : ark) {
    ASSERT_TRUE(scenes.contains(tick)) << tick;
    cv::Mat difference;
    cv::absdiff(decoded(file), first.render(scenes.at(tick)), difference);
    EXPECT_LT(cv::mean(difference)[0], 1) << "tick " << tick << ": more than JPEG loses";
  }
}

TEST_F(LiveCamerasTest, ArgumentsThatDoNotFitAreRefused) {
  const auto outcome = [&](test::Words words) {
    words.insert(words.begin(), {KILOTWIN_VISION, "cameras"});
    return Process(words, scratch.path()).wait(60);
  };
  EXPECT_EQ(outcome({}).status, 2);
  EXPECT_EQ(outcome({"--domain", "7"}).status, 2);
  EXPECT_EQ(outcome({"--domain", "7", "--picture", "arena.gif"}).status, 2);
  EXPECT_EQ(outcome({"--domain", "7", "--run", "somewhere"}).status, 2);
  const test::Outcome missing = outcome({"--run", scratch / "nowhere"});
  EXPECT_EQ(missing.status, 2);
  EXPECT_NE(missing.err.find("nowhere"), std::string::npos) << missing.err;
}

TEST_F(LiveCamerasTest, ARecordedRunBecomesPicturesWithTheirTruth) {
  ASSERT_EQ(test::kilotwin(
                {"run", scratch / "filmed.txtpb", "--mode", "local", "--quiet", "--out", scratch / "run"}, scratch)
                .status,
            0);
  const test::Outcome outcome =
      Process({KILOTWIN_VISION, "cameras", "--run", scratch / "run", "--out", scratch / "film", "--fps", "10",
               "--from", "1", "--to", "2", "--png", "--size", "640x480", "--quiet"},
              scratch.path())
          .wait();
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  // 1.0, 1.1, ... 2.0 s: 11 frames of 9 robots.
  const std::string truth = test::read(scratch / "film/truth.csv");
  EXPECT_EQ(std::count(truth.begin(), truth.end(), '\n'), 1 + 11 * 9);
  proto::Experiment experiment;
  experiment.mutable_arena()->set_width_mm(600);
  experiment.mutable_arena()->set_height_mm(400);
  Renderer above(World(experiment), CameraModel::overhead(640, 480, 640.0 / 680));
  RecordedScenes scenes(scratch / "run/recording.ktrec");
  for (int i = 0; i <= 10; ++i) {
    const std::string file = test::read(scratch / fmt::format("film/frame_{:05}.png", i));
    ASSERT_TRUE(stamp_of(file)) << i;
    EXPECT_NEAR(stamp_of(file)->simulated_s, 1 + 0.1 * i, 1e-6);
    const auto scene = scenes.at(1 + 0.1 * i);
    ASSERT_TRUE(scene);
    EXPECT_EQ(cv::norm(decoded(file), above.render(*scene), cv::NORM_INF), 0) << i;
  }
}

}  // namespace
}  // namespace kilotwin::cameras
