#include "clients/cli/vision/recorded_cameras.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/videoio.hpp>
#include <optional>
#include <vector>

#include "clients/cameras/ark_rig.hpp"
#include "clients/cameras/picture_file.hpp"
#include "clients/cameras/renderer.hpp"
#include "clients/cameras/scenes.hpp"
#include "clients/cli/commands.hpp"
#include "clients/cli/progress.hpp"
#include "clients/recorder/run_directory.hpp"
#include "core/base/error.hpp"
#include "core/os/files.hpp"
#include "idl/manifest.pb.h"

namespace kilotwin::cli {
namespace fs = std::filesystem;
namespace {

using cameras::FrameStamp;
using cameras::PictureFormat;
using cameras::Renderer;
using cameras::Scene;

/// Takes frames of one camera or of ARK's four.
class Film {
 public:
  Film(const RecordedCameras& recorded, const World& world) : recorded_(recorded) {
    if (recorded.ark) {
      for (const cameras::CameraModel& camera : cameras::ark_cameras(model_of(recorded.camera)))
        renderers_.emplace_back(world, camera, recorded.camera.look);
      os::write_file(recorded.out / "calibration.xml",
                     cameras::ark_calibration_xml(model_of(recorded.camera).distortion));
    } else {
      renderers_.emplace_back(world, big_camera(recorded.camera, world), recorded.camera.look);
      os::write_file(recorded.out / "camera.xml", camera_xml(renderers_.front().camera()));
    }
    truth_.emplace(recorded.out / "truth.csv", os::OutputFile::Existing::kReplace);
    truth_->buffer() = "frame,time_s,robot,x_mm,y_mm,heading_rad,led,x_px,y_px\n";
    if (!recorded.video.empty()) open_video();
  }

  void take(const Scene& scene, const FrameStamp& stamp) {
    for (std::size_t i = 0; i < renderers_.size(); ++i) {
      renderers_[i].render(scene, stamp.frame, picture_);
      if (video_.isOpened()) {
        video_.write(picture_);
        continue;
      }
      const std::string name =
          recorded_.ark ? fmt::format("frame_{:05}_{}", stamp.frame, i) : fmt::format("frame_{:05}", stamp.frame);
      os::write_file(recorded_.out / (name + (recorded_.png ? ".png" : ".jpg")),
                     cameras::encoded(picture_, recorded_.png ? PictureFormat::kPng : PictureFormat::kJpeg, stamp,
                                      recorded_.quality));
    }
    for (const cameras::RobotView& robot : scene.robots) {
      // In ARK's mosaic 1 px is 1 mm, and the upper left corner of the arena is the origin.
      const cv::Point2d at = recorded_.ark ? cv::Point2d{cameras::kArkHalf_mm + robot.pose.x_mm,
                                                         cameras::kArkHalf_mm - robot.pose.y_mm}
                                           : renderers_.front().centre_px(robot.pose);
      fmt::format_to(std::back_inserter(truth_->buffer()), "{},{:.6f},{},{:.4f},{:.4f},{:.6f},{},{:.3f},{:.3f}\n",
                     stamp.frame, stamp.simulated_s, robot.robot, robot.pose.x_mm, robot.pose.y_mm,
                     robot.pose.heading_rad, robot.led, at.x, at.y);
    }
    constexpr std::size_t kBlock = 1 << 16;
    truth_->flush_if_above(kBlock);
  }

  void close() {
    truth_->close();
    video_.release();
  }

 private:
  void open_video() {
    const std::string ending = recorded_.video.extension().string();
    if (ending != ".avi" && ending != ".mp4")
      throw UserError(fmt::format("--video {}: is no known format; give a name that ends in .avi or .mp4",
                                  recorded_.video.string()));
    const int code = ending == ".avi" ? cv::VideoWriter::fourcc('M', 'J', 'P', 'G')
                                      : cv::VideoWriter::fourcc('m', 'p', '4', 'v');
    const cameras::CameraModel& camera = renderers_.front().camera();
    if (!video_.open(recorded_.video.string(), code, recorded_.frames_per_s, {camera.width_px, camera.height_px}))
      throw RunError(fmt::format("{}: cannot be written as a video", recorded_.video.string()));
  }

  const RecordedCameras& recorded_;
  std::vector<Renderer> renderers_;
  std::optional<os::OutputFile> truth_;
  cv::VideoWriter video_;
  cv::Mat picture_;
};

}  // namespace

int show_recorded(const RecordedCameras& recorded) {
  const auto run = recorder::RunDirectory::open(recorded.run, recorder::RunDirectory::Needs::kManifest);
  const proto::Manifest manifest = run.read_manifest();
  const World world(manifest.experiment());
  cameras::RecordedScenes scenes(run.recording());
  Film film(recorded, world);
  Progress progress(!recorded.quiet);
  const double first_s = std::max(recorded.from_s, scenes.first_s());
  const double duration_s = recorded.to_s > 0 ? recorded.to_s : manifest.experiment().duration_s();
  FrameStamp stamp;
  stamp.run = manifest.run();
  for (;; ++stamp.frame) {
    stamp.simulated_s = first_s + static_cast<double>(stamp.frame) / recorded.frames_per_s;
    if (recorded.to_s > 0 && stamp.simulated_s > recorded.to_s) break;
    const std::optional<Scene> scene = scenes.at(stamp.simulated_s);
    if (!scene) break;
    stamp.tick = scenes.tick();
    // The capture's clock is the simulated one.
    stamp.capture_ns = std::llround(stamp.simulated_s * 1e9);
    film.take(*scene, stamp);
    progress.show(std::min(1.0, stamp.simulated_s / duration_s), fmt::format("frame {}", stamp.frame));
  }
  film.close();
  if (stamp.frame == 0)
    throw UserError(
        fmt::format("--from {}: the recording of {} ends before", recorded.from_s, recorded.run.string()));
  if (!recorded.quiet)
    fmt::print("{} frames in {}\n", stamp.frame,
               recorded.video.empty() ? recorded.out.string() : recorded.video.string());
  return kDone;
}

}  // namespace kilotwin::cli
