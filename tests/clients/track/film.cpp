#include "tests/clients/track/film.hpp"

#include <cmath>

#include "clients/cameras/renderer.hpp"
#include "clients/track/led.hpp"
#include "idl/experiment.pb.h"

namespace kilotwin::track {
namespace {

constexpr double kWheelBase_mm = 25, kAhead_mm = 9.2;
constexpr double kFrame_s = 1.0 / 30;
constexpr double kWidth_mm = 900, kHeight_mm = 640, kMargin_mm = 20;

void show(Driver& robot, double t, FilmLeds leds, std::mt19937_64& random) {
  constexpr double kEvery_s = 1.5;
  if (leds == FilmLeds::kOff || t - robot.led_since_s <= kEvery_s) return;
  std::uniform_real_distribution<double> uniform(0, 1);
  robot.led = leds == FilmLeds::kFull ? bits_of(static_cast<Led>(static_cast<int>(8 * uniform(random))))
                                      : static_cast<std::uint8_t>(64 * uniform(random));
  robot.led_since_s = t;
}

void step(Driver& robot, double t, double factor_sd, std::mt19937_64& random) {
  std::uniform_real_distribution<double> uniform(0, 1);
  if (t >= robot.until_s) {
    robot.mode = static_cast<int>(4 * uniform(random));
    robot.since_s = t;
    robot.until_s = t + 1 + 4 * uniform(random);
  }
  if (robot.mode == 0) return;
  std::normal_distribution<double> normal(0, 1);
  double left = (robot.mode == 1 ? 10 : robot.mode == 2 ? 0 : 20) + robot.bias_left;
  double right = (robot.mode == 1 ? 10 : robot.mode == 2 ? 20 : 0) + robot.bias_right;
  if (factor_sd > 0) {
    left *= 1 + factor_sd * normal(random);
    right *= 1 + factor_sd * normal(random);
  }
  const double turn = (right - left) / kWheelBase_mm * kFrame_s, run = 0.5 * (left + right) * kFrame_s;
  robot.heading_rad += 0.5 * turn;
  robot.x_mm += run * std::cos(robot.heading_rad);
  robot.y_mm += run * std::sin(robot.heading_rad);
  robot.heading_rad += 0.5 * turn;
}

/// A robot that another one holds turns about its centre, at a rate that changes.
void turn_in_place(Driver& robot, double t) {
  const Pose before = robot.pose();
  robot.heading_rad += 0.6 * std::sin(0.7 * t + before.x_mm) * kFrame_s;
  robot.x_mm = before.x_mm - kAhead_mm * std::cos(robot.heading_rad);
  robot.y_mm = before.y_mm - kAhead_mm * std::sin(robot.heading_rad);
}

std::vector<Driver> starting(const Film& film, std::mt19937_64& random) {
  constexpr double kBias_mm_s = 1.86;  // of the ARGoS paper
  std::normal_distribution<double> normal(0, 1);
  std::vector<Driver> robots;
  const int columns = std::max(1, static_cast<int>(720 / film.pitch_mm) + 1);
  for (int i = 0; i < film.robots; ++i) {
    const double x = -360 + film.pitch_mm * (i % columns), y = -240 + film.pitch_mm * (i / columns);
    // Discs on the grid.
    const double heading = 2.0 * i;
    robots.push_back({x - kAhead_mm * std::cos(heading), y - kAhead_mm * std::sin(heading), heading,
                      kBias_mm_s * normal(random), kBias_mm_s * normal(random)});
  }
  return robots;
}

}  // namespace

Pose Driver::pose() const {
  return {x_mm + kAhead_mm * std::cos(heading_rad), y_mm + kAhead_mm * std::sin(heading_rad),
          kilotwin::wrapped(heading_rad)};
}

const Driver* robot_at(const std::vector<Driver>& robots, const FloorPoint& at, double* off_mm) {
  const Driver* best = nullptr;
  *off_mm = 8;
  for (const Driver& robot : robots) {
    const double d = std::hypot(robot.pose().x_mm - at.x_mm, robot.pose().y_mm - at.y_mm);
    if (d < *off_mm) {
      *off_mm = d;
      best = &robot;
    }
  }
  return best;
}

std::uint64_t play(const Film& film, const Judge& judge) {
  proto::Experiment experiment;
  experiment.mutable_arena()->set_width_mm(kWidth_mm);
  experiment.mutable_arena()->set_height_mm(kHeight_mm);
  const World world(experiment);
  const int width = cvRound((kWidth_mm + 2 * kMargin_mm) * film.px_per_mm);
  const int height = cvRound((kHeight_mm + 2 * kMargin_mm) * film.px_per_mm);
  cameras::CameraModel camera = cameras::CameraModel::overhead(width, height, film.px_per_mm);
  camera.read_noise = film.noise;
  camera.uneven_light = film.uneven;
  camera.blur_px = film.blur_px;
  camera.gain = film.gain;
  cameras::Renderer renderer(world, camera);
  PictureTracker tracker(
      FloorMap::plane({film.px_per_mm, 0, 0.5 * (width - 1), 0, -film.px_per_mm, 0.5 * (height - 1), 0, 0, 1}));
  std::mt19937_64 random(film.seed);
  std::vector<Driver> robots = starting(film, random);
  cv::Mat picture;
  for (int frame = 0; frame * kFrame_s < film.duration_s; ++frame) {
    const double t = frame * kFrame_s;
    cameras::Scene scene;
    for (std::uint32_t i = 0; i < robots.size(); ++i) {
      if (t >= film.held_from_s)
        turn_in_place(robots[i], t);
      else if (film.moves)
        step(robots[i], t, std::sqrt(film.factor_variance_s / kFrame_s), random);
      show(robots[i], t, film.leds, random);
      cameras::RobotView view;
      view.robot = i;
      view.pose = robots[i].pose();
      view.led = robots[i].led;
      scene.robots.push_back(view);
    }
    renderer.render(scene, static_cast<std::uint64_t>(frame), picture);
    if (film.light) picture.convertTo(picture, -1, film.light(t));
    judge(t, robots, tracker.process(picture, t));
  }
  return tracker.follower().doubts();
}

}  // namespace kilotwin::track
