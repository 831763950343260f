// The whole tracker on rendered pictures of robots that drive: positions, headings and colours against the truth.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <opencv2/imgcodecs.hpp>
#include <random>
#include <set>
#include <tuple>

#include "clients/cameras/renderer.hpp"
#include "clients/cameras/robot_look.hpp"
#include "clients/track/brightness.hpp"
#include "core/plan/world.hpp"
#include "idl/experiment.pb.h"
#include "tests/clients/track/film.hpp"

namespace kilotwin::track {
namespace {

/// Errors of one film.
struct Errors {
  double position = 0, heading = 0, straight = 0;
  int positions = 0, headings = 0, straights = 0;
  int led_all = 0, led_right = 0, led_any = 0, led_any_right = 0, unmatched = 0, doubts = 0;
  std::size_t tracks = 0;
};

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
    ++errors.led_any;
    errors.led_any_right += bits_of(one.led) == robot->led ? 1 : 0;
    if (t - robot->led_since_s > 0.3) {
      ++errors.led_all;
      errors.led_right += bits_of(one.led) == robot->led ? 1 : 0;
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

Errors errors_of(const Film& film) {
  Errors errors;
  errors.doubts = static_cast<int>(
      play(film, [&](double t, const std::vector<Driver>& robots, const std::vector<TrackedRobot>& seen) {
        errors.tracks = std::max(errors.tracks, seen.size());
        judge(seen, robots, t, errors);
      }));
  return errors;
}

class Rendered : public testing::TestWithParam<Film> {};

TEST_P(Rendered, PosesAndColoursAreRight) {
  const Film& film = GetParam();
  const Errors errors = errors_of(film);
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
  // LEDs change every 45 pictures: three pictures of delay would be 93 %.
  EXPECT_GT(errors.led_any_right, 0.98 * errors.led_any);
  std::printf(
      "%d robots at %.1f px/mm: position %.3f mm, heading %.2f deg, after 2 s straight %.2f deg, LED %.2f %%, just "
      "after changes too %.2f %%\n",
      film.robots, film.px_per_mm, position_mm, heading_deg, straight_deg,
      100.0 * errors.led_right / std::max(1, errors.led_all),
      100.0 * errors.led_any_right / std::max(1, errors.led_any));
}

INSTANTIATE_TEST_SUITE_P(Films, Rendered, testing::Values(Film{12, 0.6, 3, 0.2, 0.7}, Film{20, 1, 4, 0.25, 0.8}));

/// A cloud: the light falls by half within the fifth second.
double cloud(double t_s) { return 1 - 0.5 * std::clamp(t_s - 4, 0.0, 1.0); }
/// A lamp at the mains: the light of a picture is off by up to 10 %, seen at 30 frames a second.
double lamp(double t_s) { return 1 + 0.1 * std::sin(2 * kPi * 101.3 * t_s); }

Film lit_by(double (*light)(double)) {
  Film film{12, 0.8, 3, 0.2, 0.7};
  film.light = light;
  return film;
}

INSTANTIATE_TEST_SUITE_P(ChangingLight, Rendered, testing::Values(lit_by(cloud), lit_by(lamp)));

/// Robots that are held turn without moving, and their LEDs are dark: the pattern of their bodies alone tells their headings.
TEST(DarkRobots, ThatTurnInPlaceKeepTheirHeadings) {
  for (const double px_per_mm : {0.6, 0.9}) {
    Film film{12, px_per_mm, 3, 0.2, 0.7};
    film.leds = FilmLeds::kOff;
    film.held_from_s = 14;
    film.duration_s = 22;
    double squares = 0, most = 0;
    int count = 0;
    play(film, [&](double t, const std::vector<Driver>& robots, const std::vector<TrackedRobot>& seen) {
      if (t < film.held_from_s) return;
      for (const TrackedRobot& one : seen) {
        double off = 0;
        const Driver* robot = robot_at(robots, one.position, &off);
        if (robot == nullptr || !one.heading) continue;
        const double error = wrapped(one.heading->heading_rad - wrapped(robot->heading_rad));
        squares += error * error;
        most = std::max(most, std::abs(error));
        ++count;
      }
    });
    const double rms_deg = 180 / kPi * std::sqrt(squares / std::max(1, count));
    std::printf("held and dark, %.1f px/mm: heading %.2f deg, at most %.1f deg\n", px_per_mm, rms_deg,
                180 / kPi * most);
    EXPECT_GT(count, 11 * 8 * 30);
    EXPECT_LT(rms_deg, 10);
  }
}

/// Looks down on the middle of an empty floor: noise of 3 grey levels, uneven light, a lens that is a bit out of focus.
cameras::Renderer camera_above(double width_mm, double height_mm, double px_per_mm) {
  proto::Experiment experiment;
  experiment.mutable_arena()->set_width_mm(width_mm);
  experiment.mutable_arena()->set_height_mm(height_mm);
  cameras::CameraModel camera =
      cameras::CameraModel::overhead(cvRound(width_mm * px_per_mm), cvRound(height_mm * px_per_mm), px_per_mm);
  camera.read_noise = 3;
  camera.uneven_light = 0.2;
  camera.blur_px = 0.7;
  return {World(experiment), camera};
}

/// For each robot, whether its LED is read as what it is.
std::vector<bool> leds_that_are_right(const cv::Mat& picture, const std::vector<Circle>& discs,
                                      const cameras::Scene& scene) {
  std::vector<bool> right;
  for (std::size_t i = 0; i < discs.size(); ++i) {
    std::vector<Circle> others = discs;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
    right.push_back(bits_of(read_led(picture, discs[i], others).led) == scene.robots[i].led);
  }
  return right;
}

// A third of the LEDs are dark beside lit ones of neighbours that they touch: the neighbours' glow is not theirs.
TEST(Crowd, RobotsThatTouchKeepTheirColours) {
  constexpr double kPitch_mm = 33.3, kSide_mm = 400;
  constexpr std::uint32_t kRobots = 64, kColumns = 8;
  std::mt19937 random(5);
  std::uniform_real_distribution<double> heading(-kPi, kPi);
  constexpr std::array<std::uint8_t, 5> kColours{0, 3, 3 << 2, 3 << 4, 0};
  for (const double px_per_mm : {0.85, 1.3, 2.0}) {
    cameras::Renderer renderer = camera_above(kSide_mm, kSide_mm, px_per_mm);
    int all = 0, right = 0;
    for (std::uint64_t frame = 0; frame < 6; ++frame) {
      cameras::Scene scene;
      std::vector<Circle> discs;
      for (std::uint32_t i = 0; i < kRobots; ++i) {
        const Pose pose{kPitch_mm * (i % kColumns - 3.5), kPitch_mm * (i / kColumns - 3.5), heading(random)};
        scene.robots.push_back({i, pose, kColours[random() % kColours.size()], 0, 0, 0});
        const cv::Point2d centre = renderer.centre_px(pose);
        discs.push_back({{centre.x, centre.y}, 16.5 * px_per_mm});
      }
      for (const bool is_right : leds_that_are_right(renderer.render(scene, frame), discs, scene)) {
        ++all;
        right += is_right ? 1 : 0;
      }
    }
    std::printf("64 robots that touch, %.2f px/mm: LED %.2f %%\n", px_per_mm, 100.0 * right / all);
    EXPECT_GT(right, 0.99 * all) << px_per_mm;
  }
}

/// Two robots touch, and their LEDs stand opposite: each of the 64 pairs of colours, with and without JPEG, whose colours have half
/// the resolution.
TEST(Crowd, PairsThatTouchWithTheirLedsKeepTheirColours) {
  constexpr double kSide_mm = 920, kPitch_mm = 110, kApart_mm = 33.1;
  const double led_rad = std::atan2(cameras::kLedLeft_mm, cameras::kLedForward_mm);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> direction(-kPi, kPi), off(-0.6, 0.6);
  for (const double px_per_mm : {0.82, 1.3, 2.0}) {
    cameras::Renderer renderer = camera_above(kSide_mm, kSide_mm, px_per_mm);
    int all = 0, right = 0, colours = 0, colours_right = 0;
    for (std::uint64_t frame = 0; frame < 6; ++frame) {
      cameras::Scene scene;
      std::vector<Circle> discs;
      const auto add = [&](const Pose& pose, std::uint32_t led) {
        scene.robots.push_back(
            {static_cast<std::uint32_t>(scene.robots.size()), pose, bits_of(static_cast<Led>(led)), 0, 0, 0});
        const cv::Point2d centre = renderer.centre_px(pose);
        discs.push_back({{centre.x, centre.y}, kRobotRadius_mm * px_per_mm});
      };
      for (std::uint32_t pair = 0; pair < 64; ++pair) {
        const double x = kPitch_mm * (pair % 8 - 3.5), y = kPitch_mm * (pair / 8 - 3.5),
                     to_other = direction(random);
        add({x, y, to_other + off(random) - led_rad}, pair % 8);
        add({x + kApart_mm * std::cos(to_other), y + kApart_mm * std::sin(to_other),
             to_other + kPi + off(random) - led_rad},
            pair / 8);
      }
      cv::Mat picture = renderer.render(scene, frame);
      if (frame % 2 == 1) {
        std::vector<unsigned char> octets;
        cv::imencode(".jpg", picture, octets, {cv::IMWRITE_JPEG_QUALITY, 90});
        picture = cv::imdecode(octets, cv::IMREAD_COLOR);
      }
      const std::vector<bool> is_right = leds_that_are_right(picture, discs, scene);
      for (std::size_t i = 0; i < discs.size(); ++i) {
        ++all;
        right += is_right[i] ? 1 : 0;
        if (scene.robots[i].led == bits_of(Led::kWhite)) continue;
        ++colours;
        colours_right += is_right[i] ? 1 : 0;
      }
    }
    std::printf("pairs whose LEDs stand opposite, %.2f px/mm: LED %.2f %%, without white ones %.2f %%\n", px_per_mm,
                100.0 * right / all, 100.0 * colours_right / colours);
    EXPECT_GE(colours_right, 0.99 * colours) << px_per_mm;
    // White light has no hue of its own: a neighbour's may be taken for it.
    EXPECT_GE(right, 0.98 * all) << px_per_mm;
  }
}

/// Four by three robots that stand still, seen by a tracker that knows nothing of the scale.
class TightGrid : public testing::TestWithParam<std::tuple<double, double>> {};

TEST_P(TightGrid, HasNoRobotsInItsGaps) {
  const auto [pitch_mm, px_per_mm] = GetParam();
  constexpr double kWidth_mm = 700, kHeight_mm = 500;
  constexpr std::uint32_t kRobots = 12, kColumns = 4;
  cameras::Renderer renderer = camera_above(kWidth_mm, kHeight_mm, px_per_mm);
  cameras::Scene scene;
  for (std::uint32_t i = 0; i < kRobots; ++i) {
    cameras::RobotView& view = scene.robots.emplace_back();
    view.robot = i;
    view.pose = {pitch_mm * (i % kColumns), pitch_mm * (i / kColumns), 2.0 * i};
  }
  Detector detector;
  EXPECT_EQ(detector.find(grey_of(renderer.render(scene))).size(), kRobots);
}

INSTANTIATE_TEST_SUITE_P(Pitches, TightGrid,
                         testing::Combine(testing::Values(34, 36, 38, 40, 42, 44, 47),
                                          testing::Values(0.85, 1.3, 2.4)));

}  // namespace
}  // namespace kilotwin::track
