// Speed of the tracker on rendered pictures of 1920x1080 with noise. Usage: track_bench [ROBOTS [FRAMES [PITCH_mm]]]
//
// Without a pitch the robots drive in circles, far from each other. With one they are in a jam: a hexagonal packing in which every
// robot turns in place and shakes. At 33 mm discs touch.
//
// The pictures are made beforehand and packed as JPEG, as a camera would deliver them. Measured are unpacking and tracking, each on
// one thread; `kilotwin track` runs them side by side.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "clients/cameras/renderer.hpp"
#include "clients/track/tracker.hpp"
#include "core/base/pose.hpp"
#include "idl/experiment.pb.h"

namespace {

constexpr double kPixelsPerMm = 0.85;
constexpr double kFrame_s = 1 / 35.0;

/// Processor time of this thread, ms: other work on the machine does not count.
double cpu_ms() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

struct Times {
  std::vector<double> ms;
  void print(const char* what) {
    std::sort(ms.begin(), ms.end());
    double sum = 0;
    for (const double one : ms) sum += one;
    std::printf("| %s | %.1f | %.1f | %.1f | %.0f |\n", what, sum / static_cast<double>(ms.size()),
                ms[ms.size() / 2], ms[ms.size() * 99 / 100], 1000 * static_cast<double>(ms.size()) / sum);
  }
};

/// Robot i of a jam at a time. Its centre shakes by a tenth of a millimetre; pushed robots turn at about 0.5 rad/s.
kilotwin::Pose jammed_pose_at(int i, int robots, double pitch_mm, double t) {
  const int columns = static_cast<int>(std::ceil(std::sqrt(robots)));
  const int column = i % columns, row = i / columns;
  const double angle = 0.5 * (i % 2 == 0 ? 1 : -1) * t + 2.4 * i;
  const double x = pitch_mm * (column - 0.5 * columns + 0.5 * (row % 2)) + 0.1 * std::cos(3 * t + i);
  const double y = pitch_mm * std::sqrt(0.75) * (row - 0.5 * columns) + 0.1 * std::sin(4 * t + i);
  return {x, y, kilotwin::wrapped(std::remainder(angle, 2 * kilotwin::kPi))};
}

/// Robot i of a film at a time: a circle of its own radius at 10 mm/s.
kilotwin::Pose pose_at(int i, double t) {
  const double radius = 15.0 + i % 7, angle = 10 * t / radius + i;
  const double x = -1000 + 145.0 * (i % 15), y = -480 + 145.0 * (i / 15);
  return {x + radius * std::cos(angle), y + radius * std::sin(angle),
          kilotwin::wrapped(std::remainder(angle + kilotwin::kPi / 2, 2 * kilotwin::kPi))};
}

}  // namespace

int main(int count, char** words) {
  using namespace kilotwin;
  cv::setNumThreads(1);
  const int robots = count > 1 ? std::atoi(words[1]) : 100;
  const int frames = count > 2 ? std::atoi(words[2]) : 150;
  const double pitch_mm = count > 3 ? std::atof(words[3]) : 0;
  proto::Experiment experiment;
  experiment.mutable_arena()->set_width_mm(2200);
  experiment.mutable_arena()->set_height_mm(1200);
  const World world(experiment);
  cameras::CameraModel camera = cameras::CameraModel::overhead(1920, 1080, kPixelsPerMm);
  camera.read_noise = 3;
  camera.uneven_light = 0.2;
  camera.blur_px = 0.7;
  cameras::Renderer renderer(world, camera);
  std::vector<std::vector<unsigned char>> film;
  cv::Mat picture;
  for (int frame = 0; frame < frames; ++frame) {
    cameras::Scene scene;
    for (int i = 0; i < robots; ++i) {
      cameras::RobotView view;
      view.robot = static_cast<std::uint32_t>(i);
      const double t = frame * kFrame_s;
      view.pose = pitch_mm > 0 ? jammed_pose_at(i, robots, pitch_mm, t) : pose_at(i, t);
      view.led = static_cast<std::uint8_t>(3 << (2 * (i % 3)));
      scene.robots.push_back(view);
    }
    renderer.render(scene, static_cast<std::uint64_t>(frame), picture);
    cv::imencode(".jpg", picture, film.emplace_back(), {cv::IMWRITE_JPEG_QUALITY, 92});
  }
  track::PictureTracker tracker;
  Times first, unpacking, tracking;
  std::size_t most = 0, seen = 0;
  for (int frame = 0; frame < frames; ++frame) {
    const double start = cpu_ms();
    picture = cv::imdecode(film[static_cast<std::size_t>(frame)], cv::IMREAD_COLOR);
    unpacking.ms.push_back(cpu_ms() - start);
    const double unpacked = cpu_ms();
    const std::vector<track::TrackedRobot> found = tracker.process(picture, frame * kFrame_s);
    (frame == 0 ? first : tracking).ms.push_back(cpu_ms() - unpacked);
    most = std::max(most, found.size());
    for (const track::TrackedRobot& robot : found) seen += robot.state == track::TrackState::kSeen ? 1 : 0;
  }
  std::printf("%d robots, %d frames of 1920x1080; tracks at most %zu, robots seen %.2f %%\n\n", robots, frames,
              most, 100.0 * static_cast<double>(seen) / (static_cast<double>(robots) * frames));
  std::printf("| step | mean, ms of processor time | median | 99 %% | frames/s |\n|---|---|---|---|---|\n");
  first.print("first picture: size of the robots, all places");
  unpacking.print("unpacking JPEG");
  tracking.print("tracking");
  return 0;
}
