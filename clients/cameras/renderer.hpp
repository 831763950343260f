/// Renderer: from poses and LEDs to the picture of one camera.
///
/// A picture is made in this order: the background, painted once; movable bodies; shadows; robots; the light of LEDs; the
/// lens' point spread; noise. A robot's sprite is drawn by the camera's projection, linear about the robot's centre. Centres lie
/// within 0.05 px of the projection, whatever fraction of a pixel they fall on.
#pragma once

#include <cstdint>
#include <memory>
#include <opencv2/core.hpp>
#include <vector>

#include "clients/cameras/camera_model.hpp"
#include "clients/cameras/robot_look.hpp"
#include "clients/cameras/robot_sprite.hpp"
#include "core/base/pose.hpp"
#include "core/plan/world.hpp"

namespace kilotwin::cameras {

class SensorNoise;

/// One robot at the middle of the exposure.
struct RobotView {
  std::uint32_t robot = 0;
  Pose pose;
  std::uint8_t led = 0;                             ///< r | g << 2 | b << 4, each 0..3
  double vx_mm_s = 0, vy_mm_s = 0, turn_rad_s = 0;  ///< its motion during the exposure
};

/// The scene under a camera at one instant.
struct Scene {
  std::vector<RobotView> robots;
  std::vector<Pose> movables;  ///< of the world's movable bodies, in their order
};

class Renderer {
 public:
  /// Paints the background: some 100 ms per megapixel.
  Renderer(const World& world, const CameraModel& camera, const Look& look = {});
  ~Renderer();
  Renderer(Renderer&&) noexcept;
  Renderer& operator=(Renderer&&) = delete;

  [[nodiscard]] const CameraModel& camera() const { return camera_; }
  /// Where the centre of a robot's visible face appears.
  [[nodiscard]] cv::Point2d centre_px(const Pose& pose) const;

  /// The picture, CV_8UC3 in the order blue, green, red. `frame` numbers the frames of this camera: it seeds the noise. The
  /// result is a function of scene, frame and camera model.
  [[nodiscard]] cv::Mat render(const Scene& scene, std::uint64_t frame = 0);
  /// The same into a picture whose memory is reused.
  void render(const Scene& scene, std::uint64_t frame, cv::Mat& picture);

 private:
  void draw_shadow(cv::Mat& picture, const RobotView& robot) const;
  void draw_robot(cv::Mat& picture, const RobotView& robot);
  void draw_led(cv::Mat& picture, const RobotView& robot) const;
  [[nodiscard]] int steps_of(const RobotView& robot, double px_per_mm) const;
  [[nodiscard]] Pose pose_at(const RobotView& robot, int step, int steps) const;

  CameraModel camera_;
  Look look_;
  std::vector<Convex> movables_;
  cv::Mat background_;
  RobotSprites sprites_;
  cv::Mat patch_;  // one robot over the exposure, CV_32FC4
  std::unique_ptr<SensorNoise> noise_;
};

}  // namespace kilotwin::cameras
