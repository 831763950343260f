// The cost of a picture of the arena: 100 robots with lit LEDs, one big picture or ARK's four, on one thread.
#include <benchmark/benchmark.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "clients/cameras/ark_rig.hpp"
#include "clients/cameras/picture_file.hpp"
#include "clients/cameras/renderer.hpp"
#include "idl/experiment.pb.h"

namespace kilotwin::cameras {
namespace {

World arena_of(double width_mm, double height_mm) {
  proto::Experiment experiment;
  experiment.mutable_arena()->set_width_mm(width_mm);
  experiment.mutable_arena()->set_height_mm(height_mm);
  return World(experiment);
}

/// A grid of 100 robots that move and shine.
Scene hundred_robots(double pitch_x_mm, double pitch_y_mm) {
  Scene scene;
  for (std::uint32_t i = 0; i < 100; ++i) {
    RobotView robot;
    robot.robot = i;
    robot.pose = {(i % 10 - 4.5) * pitch_x_mm, (i / 10 - 4.5) * pitch_y_mm, 0.7 * i};
    robot.led = static_cast<std::uint8_t>(std::array<int, 4>{3, 12, 48, 63}.at(i % 4));
    robot.vx_mm_s = 10;
    scene.robots.push_back(robot);
  }
  return scene;
}

CameraModel hd() { return CameraModel::overhead(1920, 1080, 0.9); }

CameraModel realistic(CameraModel camera) {
  camera.exposure_s = 0.01;
  camera.blur_px = 0.7;
  camera.read_noise = 2;
  camera.shot_noise = 3;
  camera.vignetting = 0.2;
  return camera;
}

void one_big_picture(benchmark::State& state, const CameraModel& camera) {
  Renderer renderer(arena_of(2000, 1100), camera);
  const Scene scene = hundred_robots(190, 100);
  cv::Mat picture;
  std::uint64_t frame = 0;
  for (auto _ : state) renderer.render(scene, frame++, picture);
}
BENCHMARK_CAPTURE(one_big_picture, 1920x1080_perfect, hd())->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(one_big_picture, 1920x1080_blur_noise_exposure, realistic(hd()))->Unit(benchmark::kMillisecond);

void one_big_jpeg(benchmark::State& state) {
  Renderer renderer(arena_of(2000, 1100), hd());
  const Scene scene = hundred_robots(190, 100);
  cv::Mat picture;
  std::uint64_t frame = 0;
  for (auto _ : state) {
    renderer.render(scene, frame++, picture);
    benchmark::DoNotOptimize(encoded(picture, PictureFormat::kJpeg, {}));
  }
}
BENCHMARK(one_big_jpeg)->Unit(benchmark::kMillisecond);

void four_ark_pictures(benchmark::State& state, bool encode) {
  std::vector<Renderer> renderers;
  for (const CameraModel& camera : ark_cameras({})) renderers.emplace_back(arena_of(2000, 2000), camera);
  const Scene scene = hundred_robots(190, 190);
  cv::Mat picture;
  std::uint64_t frame = 0;
  for (auto _ : state) {
    ++frame;
    for (Renderer& renderer : renderers) {
      renderer.render(scene, frame, picture);
      if (encode) benchmark::DoNotOptimize(encoded(picture, PictureFormat::kJpeg, {}));
    }
  }
}
BENCHMARK_CAPTURE(four_ark_pictures, 2048x1536, false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(four_ark_pictures, 2048x1536_as_jpeg, true)->Unit(benchmark::kMillisecond);

void background(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(Renderer(arena_of(2000, 1100), hd()).camera().width_px);
}
BENCHMARK(background)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace kilotwin::cameras
