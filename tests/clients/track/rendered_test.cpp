// The whole tracker on rendered pictures of robots that drive: positions, headings and colours against the truth.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <random>
#include <set>

#include "clients/cameras/renderer.hpp"
#include "clients/track/tracker.hpp"
#include "core/base/pose.hpp"
#include "idl/experiment.pb.h"

namespace kilotwin::track {
namespace {

constexpr double kWheelBase_mm = 25, kAhead_mm = 9.2;
constexpr double kFrame_s = 1.0 / 30;

/// A robot by the kinematics of docs/explanation/motion.md under random commands.
struct Driver {
  double x_mm, y_mm, heading_rad;  ///< middle of the rear legs
  double bias_left, bias_right;
  int mode = 1;
  double until_s = 0, since_s = 0;
  Led led = Led::kOff;
  double led_since_s = 0;

  [[nodiscard]] Pose pose() const {
    return {x_mm + kAhead_mm * std::cos(heading_rad), y_mm + kAhead_mm * std::sin(heading_rad),
            kilotwin::wrapped(heading_rad)};
  }
  void step(double t, std::mt19937_64& random) {
    std::uniform_real_distribution<double> uniform(0, 1);
    if (t >= until_s) {
      mode = static_cast<int>(4 * uniform(random));
      since_s = t;
      until_s = t + 1 + 4 * uniform(random);
    }
    if (t - led_since_s > 1.5) {
      led = static_cast<Led>(static_cast<int>(8 * uniform(random)));
      led_since_s = t;
    }
    if (mode == 0) return;
    const double left = (mode == 1 ? 10 : mode == 2 ? 0 : 20) + bias_left;
    const double right = (mode == 1 ? 10 : mode == 2 ? 20 : 0) + bias_right;
    const double turn = (right - left) / kWheelBase_mm * kFrame_s, run = 0.5 * (left + right) * kFrame_s;
    heading_rad += 0.5 * turn;
    x_mm += run * std::cos(heading_rad);
    y_mm += run * std::sin(heading_rad);
    heading_rad += 0.5 * turn;
  }
};

/// Errors of one film.
struct Errors {
  double position = 0, heading = 0, straight = 0;
  int positions = 0, headings = 0, straights = 0;
  int led_all = 0, led_right = 0, unmatched = 0, doubts = 0;
  std::size_t tracks = 0;
};

/// The robot of the truth at a position; nothing where none is within 8 mm.
const Driver* robot_at(const std::vector<Driver>& robots, const FloorPoint& at, double* off) {
  const Driver* best = nullptr;
  *off = 8;
  for (const Driver& robot : robots) {
    const double d = std::hypot(robot.pose().x_mm - at.x_mm, robot.pose().y_mm - at.y_mm);
    if (d < *off) {
      *off = d;
      best = &robot;
    }
  }
  return best;
}

void judge(const std::vector<TrackedRobot>& seen, const std::vector<Driver>& robots, double t, Errors& errors) {
  std::set<const Driver*> used;
  for (const TrackedRobot& one : seen) {
    if (one.state != TrackState::kSeen && one.state != TrackState::kDoubt) continue;
    double off = 0;
    const Driver* robot = robot_at(robots, one.position, &off);
    if (robot == nullptr || !used.insert(robot).second) {
      ++errors.unmatched;
      continue;
    }
    errors.position += off * off;
    ++errors.positions;
    if (t - robot->led_since_s > 0.3) {
      ++errors.led_all;
      errors.led_right += one.led == robot->led ? 1 : 0;
    }
    if (!one.heading || t < 3) continue;
    const double error = kilotwin::wrapped(one.heading->heading_rad - robot->heading_rad);
    errors.heading += error * error;
    ++errors.headings;
    if (robot->mode != 1 || t - robot->since_s < 2) continue;
    errors.straight += error * error;
    ++errors.straights;
  }
}

struct Film {
  int robots;
  double px_per_mm, noise, uneven, blur_px;
};

Errors play(const Film& film, double duration_s) {
  proto::Experiment experiment;
  experiment.mutable_arena()->set_width_mm(900);
  experiment.mutable_arena()->set_height_mm(640);
  const World world(experiment);
  const int width = cvRound(940 * film.px_per_mm), height = cvRound(680 * film.px_per_mm);
  cameras::CameraModel camera = cameras::CameraModel::overhead(width, height, film.px_per_mm);
  camera.read_noise = film.noise;
  camera.uneven_light = film.uneven;
  camera.blur_px = film.blur_px;
  cameras::Renderer renderer(world, camera);
  PictureTracker tracker(
      FloorMap::plane({film.px_per_mm, 0, 0.5 * (width - 1), 0, -film.px_per_mm, 0.5 * (height - 1), 0, 0, 1}));
  std::mt19937_64 random(9);
  std::normal_distribution<double> normal(0, 1);
  std::vector<Driver> robots;
  for (int i = 0; i < film.robots; ++i) {
    const double x = -360 + 120.0 * (i % 7), y = -240 + 120.0 * (i / 7);
    robots.push_back({x, y, 2.0 * i, 1.86 * normal(random), 1.86 * normal(random)});
  }
  Errors errors;
  cv::Mat picture;
  for (int frame = 0; frame * kFrame_s < duration_s; ++frame) {
    const double t = frame * kFrame_s;
    cameras::Scene scene;
    for (std::uint32_t i = 0; i < robots.size(); ++i) {
      robots[i].step(t, random);
      cameras::RobotView view;
      view.robot = i;
      view.pose = robots[i].pose();
      view.led = bits_of(robots[i].led);
      scene.robots.push_back(view);
    }
    renderer.render(scene, static_cast<std::uint64_t>(frame), picture);
    const std::vector<TrackedRobot> seen = tracker.process(picture, t);
    errors.tracks = std::max(errors.tracks, seen.size());
    judge(seen, robots, t, errors);
  }
  errors.doubts = static_cast<int>(tracker.follower().doubts());
  return errors;
}

class Rendered : public testing::TestWithParam<Film> {};

TEST_P(Rendered, PosesAndColoursAreRight) {
  const Film& film = GetParam();
  const Errors errors = play(film, 9);
  const auto robots = static_cast<std::size_t>(film.robots);
  EXPECT_EQ(errors.tracks, robots);
  EXPECT_EQ(errors.unmatched, 0);
  EXPECT_EQ(errors.doubts, 0);
  EXPECT_GT(errors.positions, 0.99 * 270 * film.robots);
  const double position_mm = std::sqrt(errors.position / errors.positions);
  const double heading_deg = 180 / kPi * std::sqrt(errors.heading / std::max(1, errors.headings));
  const double straight_deg = 180 / kPi * std::sqrt(errors.straight / std::max(1, errors.straights));
  EXPECT_LT(position_mm, 1);
  EXPECT_LT(heading_deg, 10);
  EXPECT_LT(straight_deg, 5);
  EXPECT_GT(errors.led_right, 0.99 * errors.led_all);
  std::printf(
      "%d robots at %.1f px/mm: position %.3f mm, heading %.2f deg, after 2 s straight %.2f deg, LED %.2f %%\n",
      film.robots, film.px_per_mm, position_mm, heading_deg, straight_deg,
      100.0 * errors.led_right / std::max(1, errors.led_all));
}

INSTANTIATE_TEST_SUITE_P(Films, Rendered, testing::Values(Film{12, 0.6, 3, 0.2, 0.7}, Film{20, 1, 4, 0.25, 0.8}));

}  // namespace
}  // namespace kilotwin::track
