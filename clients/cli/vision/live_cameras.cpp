#include "clients/cli/vision/live_cameras.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "clients/cameras/ark_rig.hpp"
#include "clients/cameras/frame_directory.hpp"
#include "clients/cameras/mjpeg_server.hpp"
#include "clients/cameras/picture_file.hpp"
#include "clients/cameras/renderer.hpp"
#include "clients/cameras/scenes.hpp"
#include "clients/cli/commands.hpp"
#include "core/base/clocks.hpp"
#include "core/base/error.hpp"
#include "core/base/say.hpp"
#include "core/os/files.hpp"
#include "core/os/interrupt.hpp"
#include "core/os/worker_pool.hpp"

namespace kilotwin::cli {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
using cameras::FrameStamp;
using cameras::PictureFormat;
using cameras::Renderer;
using cameras::Scene;

/// Where the state stands still, a picture is taken as often as this: its stamp tells that the arena still looks so.
constexpr auto kRetake = 250ms;

/// Lets through at most so many frames per second, on average, of states that come when they come.
class FrameRate {
 public:
  explicit FrameRate(double per_s) : per_s_(per_s), counted_(Clock::now()) {}
  [[nodiscard]] bool due(Clock::time_point now) {
    credit_ = std::min(kMost, credit_ + per_s_ * std::chrono::duration<double>(now - counted_).count());
    counted_ = now;
    return credit_ >= kEnough;
  }
  void spend() { credit_ -= 1; }

 private:
  // A state that comes a little early is taken; what was missed is not made up for.
  static constexpr double kEnough = 0.9, kMost = 1.5;
  double per_s_, credit_ = 1;
  Clock::time_point counted_;
};

/// The pictures of one run: a renderer per camera that somebody looks through.
class Studio {
 public:
  Studio(const LiveCameras& live, const World& world) {
    if (!live.picture.empty() || live.mjpeg)
      big_ = std::make_unique<Renderer>(world, big_camera(live.camera, world), live.camera.look);
    if (live.directory.empty()) return;
    // Backgrounds take long: they are painted at the same time.
    const auto models = cameras::ark_cameras(model_of(live.camera));
    std::vector<std::optional<Renderer>> painted(models.size());
    os::in_parallel(models.size(), static_cast<std::uint32_t>(models.size()),
                    [&](std::size_t i) { painted[i].emplace(world, models[i], live.camera.look); });
    for (std::optional<Renderer>& one : painted) ark_.push_back(std::move(*one));
    if (std::max(world.arena.half_width_mm(), world.arena.half_height_mm()) > cameras::kArkHalf_mm)
      warn(
          fmt::format("kilotwin: --dir: the arena ({}) is larger than the 2000 mm x 2000 mm that ARK sees; robots "
                      "beyond are not in its pictures",
                      world.arena.described()));
  }
  [[nodiscard]] Renderer* big() { return big_.get(); }
  [[nodiscard]] std::vector<Renderer>& ark() { return ark_; }

 private:
  std::unique_ptr<Renderer> big_;
  std::vector<Renderer> ark_;
};

class Live {
 public:
  explicit Live(const LiveCameras& live) : live_(live), observer_(live.transport), rate_(live.frames_per_s) {
    if (live.mjpeg) {
      server_ = std::make_unique<cameras::MjpegServer>(*live.mjpeg);
      tell(fmt::format("kilotwin: stream http://127.0.0.1:{}/camera.mjpg", server_->port()));
    }
    if (!live.directory.empty()) {
      directory_ = std::make_unique<cameras::FrameDirectory>(live.directory, cameras::kArkCameras);
      os::write_file(live.directory / "calibration.xml",
                     cameras::ark_calibration_xml(model_of(live.camera).distortion));
      tell(fmt::format("kilotwin: four cameras for ARK in {}, with calibration.xml", live.directory.string()));
    }
  }

  int work() {
    while (interrupted() == 0) {
      if (directory_) directory_->look();
      if (take_news() == observe::News::kRunEnded && live_.one_run) return kDone;
      if (studio_) take_pictures();
    }
    return kDone;
  }

 private:
  void tell(const std::string& line) const {
    if (!live_.quiet) say(line);
  }

  observe::News take_news() {
    // Short enough to notice a reader of the directory in time.
    const observe::News news = observer_.wait(directory_ ? 4ms : 50ms);
    if (news == observe::News::kRunBegan) {
      const observe::RunFacts& run = *observer_.run();
      tell(fmt::format("kilotwin: sees run {}, {} robots", run.name, run.robots));
      studio_ = std::make_unique<Studio>(live_, World(*run.experiment));
      has_scene_ = false;
    } else if (news == observe::News::kState) {
      const observe::SwarmAt& state = *observer_.state();
      // A repeated state says that nothing has moved since.
      const observe::SwarmAt* const earlier = observer_.earlier_state();
      scene_ = cameras::scene_of(state, earlier);
      stamp_.run = observer_.run()->run;
      stamp_.tick = state.swarm.tick.count();
      stamp_.simulated_s = state.time_s;
      stamp_.capture_ns = state.wall_ns;
      has_scene_ = is_new_ = true;
    } else if (news == observe::News::kRunEnded) {
      tell("kilotwin: the run has ended");
      for (cameras::RobotView& robot : scene_.robots) robot.vx_mm_s = robot.vy_mm_s = robot.turn_rad_s = 0;
    }
    return news;
  }

  void take_pictures() {
    const auto now = Clock::now();
    if (!has_scene_ || !rate_.due(now)) return;
    // The picture of a state that has lasted shows that state as it is at this moment.
    if (!is_new_ && now < taken_ + kRetake && !(directory_ && directory_->wants_pictures())) return;
    // Without a client of the stream, now and then a picture is enough.
    const bool looked_at = !live_.picture.empty() || (server_ && server_->clients() > 0) || now >= taken_ + kRetake;
    const bool for_big = studio_->big() != nullptr && looked_at;
    const bool for_ark = directory_ && directory_->wants_pictures();
    if (!for_big && !for_ark) return;
    if (!is_new_) stamp_.capture_ns = std::max(stamp_.capture_ns, utc_ns());
    rate_.spend();
    if (for_big) take_big();
    if (for_ark) take_ark();
    is_new_ = false;
    taken_ = now;
    ++stamp_.frame;
  }

  void take_big() {
    studio_->big()->render(scene_, stamp_.frame, picture_);
    std::string jpeg;
    if (server_ || cameras::format_of(live_.picture.string()) == PictureFormat::kJpeg)
      jpeg = cameras::encoded(picture_, PictureFormat::kJpeg, stamp_, live_.quality);
    if (!live_.picture.empty()) {
      os::write_file(live_.picture, cameras::format_of(live_.picture.string()) == PictureFormat::kPng
                                        ? cameras::encoded(picture_, PictureFormat::kPng, stamp_)
                                        : jpeg);
    }
    if (server_) server_->post(jpeg, stamp_);
  }

  /// The four cameras at once, on as many threads.
  void take_ark() {
    std::vector<Renderer>& renderers = studio_->ark();
    std::vector<std::string> pictures(renderers.size());
    ark_pictures_.resize(renderers.size());
    os::in_parallel(renderers.size(), static_cast<std::uint32_t>(renderers.size()), [&](std::size_t i) {
      renderers[i].render(scene_, stamp_.frame, ark_pictures_[i]);
      pictures[i] = cameras::encoded(ark_pictures_[i], PictureFormat::kJpeg, stamp_, live_.quality);
    });
    directory_->look();
    directory_->put(std::move(pictures));
  }

  const LiveCameras& live_;
  observe::Observer observer_;
  FrameRate rate_;
  std::unique_ptr<cameras::MjpegServer> server_;
  std::unique_ptr<cameras::FrameDirectory> directory_;
  std::unique_ptr<Studio> studio_;  // of the run at hand, or of the last one
  Scene scene_;
  FrameStamp stamp_;
  cv::Mat picture_;
  std::vector<cv::Mat> ark_pictures_;
  Clock::time_point taken_{};
  bool has_scene_ = false, is_new_ = false;
};

}  // namespace

int show_live(const LiveCameras& live) {
  catch_interrupts();
  return Live(live).work();
}

}  // namespace kilotwin::cli
