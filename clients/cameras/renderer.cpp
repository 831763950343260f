#include "clients/cameras/renderer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "clients/cameras/background.hpp"
#include "clients/cameras/sensor_noise.hpp"

namespace kilotwin::cameras {
namespace {

/// The pixels around a point, cut at the picture's edges.
cv::Rect box_around(const cv::Point2d& centre, double reach_px, const cv::Mat& picture) {
  const int left = static_cast<int>(std::floor(centre.x - reach_px)),
            top = static_cast<int>(std::floor(centre.y - reach_px));
  const int right = static_cast<int>(std::ceil(centre.x + reach_px)),
            bottom = static_cast<int>(std::ceil(centre.y + reach_px));
  return cv::Rect(left, top, right - left + 1, bottom - top + 1) & cv::Rect(0, 0, picture.cols, picture.rows);
}

double scale_of(const cv::Matx22d& jacobian) { return std::sqrt(std::abs(cv::determinant(jacobian))); }

std::uint8_t level_of(float value) {
  return static_cast<std::uint8_t>(value < 0 ? 0 : value > 254.5f ? 255 : value + 0.5f);
}

/// From a pixel to the frame of something that lies at `pose`: the inverse of the projection, linear about its centre.
struct FromPixel {
  float ax, bx, ay, by;  // forward = ax du + bx dv; left = ay du + by dv
  float u0, v0;

  FromPixel(const CameraModel& camera, const cv::Matx22d& jacobian, const Pose& pose, double height_mm) {
    const cv::Point2d centre = camera.project({pose.x_mm, pose.y_mm, height_mm});
    const cv::Matx22d inverse = jacobian.inv();
    const double c = std::cos(pose.heading_rad), s = std::sin(pose.heading_rad);
    const cv::Matx22d to_robot = cv::Matx22d(c, s, -s, c) * inverse;
    ax = static_cast<float>(to_robot(0, 0));
    bx = static_cast<float>(to_robot(0, 1));
    ay = static_cast<float>(to_robot(1, 0));
    by = static_cast<float>(to_robot(1, 1));
    u0 = static_cast<float>(centre.x);
    v0 = static_cast<float>(centre.y);
  }
  [[nodiscard]] cv::Point2f operator()(int column, int row) const {
    const float du = static_cast<float>(column) - u0, dv = static_cast<float>(row) - v0;
    return {ax * du + bx * dv, ay * du + by * dv};
  }
};

Pose led_pose(const Pose& robot) {
  const double c = std::cos(robot.heading_rad), s = std::sin(robot.heading_rad);
  return {robot.x_mm + c * kLedForward_mm - s * kLedLeft_mm, robot.y_mm + s * kLedForward_mm + c * kLedLeft_mm,
          robot.heading_rad};
}

}  // namespace

Renderer::Renderer(const World& world, const CameraModel& camera, const Look& look)
    : camera_(camera), look_(look), background_(paint_background(world, camera, look)), sprites_(look) {
  for (const MovableBodyModel& movable : world.movables) movables_.push_back(movable.shape);
  if (camera.read_noise > 0 || camera.shot_noise > 0)
    noise_ = std::make_unique<SensorNoise>(camera.read_noise, camera.shot_noise, camera.seed);
}

Renderer::~Renderer() = default;
Renderer::Renderer(Renderer&&) noexcept = default;

cv::Point2d Renderer::centre_px(const Pose& pose) const {
  return camera_.project({pose.x_mm, pose.y_mm, look_.body_height_mm});
}

cv::Mat Renderer::render(const Scene& scene, std::uint64_t frame) {
  cv::Mat picture;
  render(scene, frame, picture);
  return picture;
}

void Renderer::render(const Scene& scene, std::uint64_t frame, cv::Mat& picture) {
  background_.copyTo(picture);
  for (std::size_t i = 0; i < std::min(movables_.size(), scene.movables.size()); ++i)
    paint_movable(picture, movables_[i], scene.movables[i], camera_, look_);
  if (look_.shadow > 0) {
    for (const RobotView& robot : scene.robots) draw_shadow(picture, robot);
  }
  for (const RobotView& robot : scene.robots) draw_robot(picture, robot);
  for (const RobotView& robot : scene.robots) {
    if ((robot.led & 0x3f) != 0) draw_led(picture, robot);
  }
  if (camera_.blur_px > 0)
    cv::GaussianBlur(picture, picture, {}, camera_.blur_px, camera_.blur_px, cv::BORDER_REPLICATE);
  if (noise_) noise_->add(picture, frame);
}

int Renderer::steps_of(const RobotView& robot, double px_per_mm) const {
  constexpr double kStepsPerPixel = 4;
  constexpr int kMost = 16;
  const double speed_mm_s = std::hypot(robot.vx_mm_s, robot.vy_mm_s) + kRobotRadius_mm * std::abs(robot.turn_rad_s);
  return std::clamp(static_cast<int>(std::ceil(kStepsPerPixel * speed_mm_s * camera_.exposure_s * px_per_mm)), 1,
                    kMost);
}

Pose Renderer::pose_at(const RobotView& robot, int step, int steps) const {
  const double late_s = ((step + 0.5) / steps - 0.5) * camera_.exposure_s;
  return {robot.pose.x_mm + robot.vx_mm_s * late_s, robot.pose.y_mm + robot.vy_mm_s * late_s,
          robot.pose.heading_rad + robot.turn_rad_s * late_s};
}

void Renderer::draw_shadow(cv::Mat& picture, const RobotView& robot) const {
  // Soft and wider than the disc, shifted away from the light: what one sees beside a low body under a window.
  constexpr double kShift_mm = 5, kSoft_mm = 9;
  const Pose pose{robot.pose.x_mm - kShift_mm * std::cos(camera_.light_from_rad),
                  robot.pose.y_mm - kShift_mm * std::sin(camera_.light_from_rad), 0};
  const cv::Matx22d jacobian = camera_.jacobian({pose.x_mm, pose.y_mm, 0});
  const FromPixel from(camera_, jacobian, pose, 0);
  const double reach_mm = kRobotRadius_mm + kSoft_mm;
  const cv::Rect box = box_around({from.u0, from.v0}, reach_mm * scale_of(jacobian) + 1, picture);
  for (int row = box.y; row < box.y + box.height; ++row) {
    auto* const pixels = picture.ptr<cv::Vec3b>(row);
    for (int column = box.x; column < box.x + box.width; ++column) {
      const cv::Point2f at = from(column, row);
      const double radius = std::hypot(at.x, at.y);
      if (radius >= reach_mm) continue;
      const double t = std::clamp((reach_mm - radius) / (2 * kSoft_mm), 0.0, 1.0);
      const auto light = static_cast<float>(1 - look_.shadow * t * t * (3 - 2 * t));
      for (int c = 0; c < 3; ++c) pixels[column][c] = level_of(static_cast<float>(pixels[column][c]) * light);
    }
  }
}

void Renderer::draw_robot(cv::Mat& picture, const RobotView& robot) {
  const double height_mm = look_.body_height_mm;
  const cv::Vec3d at_mm{robot.pose.x_mm, robot.pose.y_mm, height_mm};
  const cv::Matx22d jacobian = camera_.jacobian(at_mm);
  const double px_per_mm = scale_of(jacobian);
  const cv::Point2d centre = camera_.project(at_mm);
  const int steps = steps_of(robot, px_per_mm);
  const double smear_mm = steps == 1 ? 0 : std::hypot(robot.vx_mm_s, robot.vy_mm_s) * camera_.exposure_s / 2;
  const cv::Rect box = box_around(centre, 1.1 * (kRobotRadius_mm + smear_mm) * px_per_mm + 2, picture);
  if (box.empty()) return;
  patch_.create(box.height, box.width, CV_32FC4);
  patch_.setTo(cv::Scalar::all(0));
  const RobotSprite& sprite = sprites_.at_scale(px_per_mm, robot.robot);
  const auto weight = 1 / static_cast<float>(steps);
  for (int step = 0; step < steps; ++step) {
    const FromPixel from(camera_, jacobian, pose_at(robot, step, steps), height_mm);
    for (int row = 0; row < box.height; ++row) {
      auto* const sums = patch_.ptr<cv::Vec4f>(row);
      for (int column = 0; column < box.width; ++column) {
        const cv::Point2f at = from(box.x + column, box.y + row);
        sums[column] += weight * sprite.at(at.x, at.y);
      }
    }
  }
  const auto light = static_cast<float>(camera_.gain * camera_.lens_share(centre) *
                                        camera_.room_light(robot.pose.x_mm, robot.pose.y_mm));
  for (int row = 0; row < box.height; ++row) {
    auto* const pixels = picture.ptr<cv::Vec3b>(box.y + row) + box.x;
    const auto* const over = patch_.ptr<cv::Vec4f>(row);
    for (int column = 0; column < box.width; ++column) {
      const cv::Vec4f& o = over[column];
      if (o[3] <= 0) continue;
      for (int c = 0; c < 3; ++c)
        pixels[column][c] = level_of(static_cast<float>(pixels[column][c]) * (1 - o[3]) + light * o[c]);
    }
  }
}

void Renderer::draw_led(cv::Mat& picture, const RobotView& robot) const {
  const std::array<double, 3> levels{led_level((robot.led >> 4) & 3u), led_level((robot.led >> 2) & 3u),
                                     led_level(robot.led & 3u)};  // blue, green, red
  const double brightest = std::max({levels[0], levels[1], levels[2]});
  const Pose middle = led_pose(robot.pose);
  const cv::Vec3d at_mm{middle.x_mm, middle.y_mm, look_.body_height_mm};
  const cv::Matx22d jacobian = camera_.jacobian(at_mm);
  const double px_per_mm = scale_of(jacobian);
  const cv::Point2d centre = camera_.project(at_mm);
  const int steps = steps_of(robot, px_per_mm);
  const double smear_mm = steps == 1 ? 0
                                     : std::hypot(robot.vx_mm_s, robot.vy_mm_s) * camera_.exposure_s / 2 +
                                           kRobotRadius_mm * std::abs(robot.turn_rad_s) * camera_.exposure_s / 2;
  const cv::Rect box = box_around(centre, (kLedReach_mm + smear_mm) * px_per_mm + 1, picture);
  const auto light = static_cast<float>(camera_.gain * camera_.lens_share(centre));
  // A little of the light is white: the plastic scatters it, and the filters of a sensor overlap.
  constexpr double kScattered = 0.1;
  std::vector<FromPixel> from;
  from.reserve(static_cast<std::size_t>(steps));
  for (int step = 0; step < steps; ++step)
    from.emplace_back(camera_, jacobian, led_pose(pose_at(robot, step, steps)), look_.body_height_mm);
  for (int row = box.y; row < box.y + box.height; ++row) {
    auto* const pixels = picture.ptr<cv::Vec3b>(row);
    for (int column = box.x; column < box.x + box.width; ++column) {
      LedLight sum;
      for (const FromPixel& one : from) {
        const cv::Point2f at = one(column, row);
        const LedLight led = led_light(look_, std::sqrt(at.x * at.x + at.y * at.y));
        sum.opacity += led.opacity / static_cast<float>(steps);
        sum.white += led.white / static_cast<float>(steps);
        sum.glow += led.glow / static_cast<float>(steps);
      }
      if (sum.opacity <= 0 && sum.glow <= 0) continue;
      for (std::size_t c = 0; c < levels.size(); ++c) {
        const auto own = static_cast<float>(255 * (kScattered * brightest + (1 - kScattered) * levels[c]));
        const auto white = static_cast<float>(255 * brightest);
        const float face = light * (own + sum.white * (white - own));
        const auto channel = static_cast<int>(c);
        const auto under = static_cast<float>(pixels[column][channel]);
        pixels[column][channel] =
            level_of(under * (1 - sum.opacity) + face * sum.opacity + light * own * sum.glow * (1 - sum.opacity));
      }
    }
  }
}

}  // namespace kilotwin::cameras
