// Lamps, pictures and the sensor's position against closed forms.
#include <gtest/gtest.h>

#include <google/protobuf/text_format.h>

#include <array>
#include <cmath>

#include "core/plan/from_manifest.hpp"
#include "core/senses/light_field.hpp"
#include "idl/manifest.pb.h"
#include "tests/support/scenes.hpp"

namespace kilotwin::senses {
namespace {

using testing::make_plan;
using testing::ScenePose;

const char* const kQuiet = "sensor { gain_sd: 0 noise_floor: 0 noise_relative: 0 } ";

BodyFrame frame_of(const RunPlan& plan, Tick tick = {}) {
  BodyFrame frame;
  frame.tick = tick;
  for (std::uint32_t robot = 0; robot < plan.robots(); ++robot) {
    const Pose pose = plan.initial_pose(robot);
    frame.add(robot, pose.x_mm, pose.y_mm, pose.heading_rad);
  }
  return frame;
}

/// The swarm at its initial poses.
SwarmView swarm_of(const RunPlan& plan, Tick tick = {}) {
  const BodyFrame frame = frame_of(plan, tick);
  const BodyFrame* const frames[] = {&frame};
  SwarmView swarm(plan.robots(), 0, 0);
  swarm.gather(tick, frames);
  return swarm;
}

/// The robots' readings at `tick` in the poses of the scene.
std::vector<double> readings(const std::string& light, const std::vector<ScenePose>& poses, Tick tick = {}) {
  const RunPlan plan = make_plan("light { " + light + " }", poses);
  LightField field(plan, {0, plan.robots()});
  const SwarmView swarm = swarm_of(plan, tick);
  field.at(swarm);
  std::vector<double> result;
  for (std::uint32_t robot = 0; robot < plan.robots(); ++robot) result.push_back(field.reading(robot));
  return result;
}

TEST(Light, FallsWithTheSquareOfTheDistance) {
  std::vector<ScenePose> poses;
  for (int i = 0; i < 20; ++i) poses.push_back({100.0 * i + 50, -30.0 * i, 0.3 * i});
  const auto got = readings(
      "source { x_mm: 10 y_mm: -20 height_mm: 250 intensity: 123 } ambient: 7 sensor { radius_mm: 0 gain_sd: 0 "
      "cosine: false }",
      poses);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const double dx = poses[i].x_mm - 10, dy = poses[i].y_mm + 20, dz = 250 - 30;
    EXPECT_NEAR(got[i], 7 + 123 * 1e6 / (dx * dx + dy * dy + dz * dz), 1e-9 * got[i]);
  }
}

TEST(Light, ReadsItsIntensityAtOneMetre) {
  EXPECT_NEAR(
      readings(
          "source { height_mm: 30 intensity: 88 } sensor { radius_mm: 0 gain_sd: 0 angle_deg: 180 tilt_deg: 90 }",
          {{1000, 0, 0}})[0],
      88, 1e-9);
}

TEST(Light, FallsWithTheCosineIfTheSensorLooksUp) {
  const char* const source =
      "source { height_mm: 330 intensity: 50 } sensor { radius_mm: 0 gain_sd: 0 tilt_deg: 0 cosine: ";
  const double plain = readings(std::string(source) + "false }", {{400, 0, 0}})[0];
  const double cosine = readings(std::string(source) + "true }", {{400, 0, 0}})[0];
  EXPECT_NEAR(cosine / plain, 300.0 / 500, 1e-12);
  EXPECT_EQ(readings("source { height_mm: 20 } sensor { radius_mm: 0 gain_sd: 0 tilt_deg: 0 }", {{400, 0, 0}})[0],
            0)
      << "from below";
}

/// Lambert's law on a sensor tilted by t, lamp at elevation e: cos t sin e + sin t cos e cos a, with a the lamp's bearing from
/// the side to which the sensor looks. With t = e = 45 degrees that is (1 + cos a) / 2.
TEST(Light, FollowsASineAsTheRobotTurns) {
  const std::string lamp = "source { x_mm: 300 height_mm: 330 intensity: 100 } sensor { radius_mm: 0 gain_sd: 0 ";
  for (int degrees = -180; degrees < 180; degrees += 15) {
    const double heading = degrees * kPi / 180, from_axis = heading + 100 * kPi / 180;
    const double whole = 100e6 / (300.0 * 300 + 300.0 * 300);
    EXPECT_NEAR(readings(lamp + "}", {{0, 0, heading}})[0], whole * (1 + std::cos(from_axis)) / 2, 1e-9);
    const double low = std::cos(kPi / 6) * std::sqrt(0.5) + 0.5 * std::sqrt(0.5) * std::cos(from_axis);
    EXPECT_NEAR(readings(lamp + "tilt_deg: 30 }", {{0, 0, heading}})[0], whole * low, 1e-9);
    EXPECT_NEAR(readings(lamp + "tilt_deg: 90 angle_deg: 0 }", {{0, 0, heading}})[0],
                whole * std::max(0.0, std::sqrt(0.5) * std::cos(heading)), 1e-9)
        << "dark behind";
  }
}

TEST(Light, IsMeasuredAtTheSensorOnTheRim) {
  // Readings of a turning robot locate the sensor: 14.5 mm from the centre, at 100 degrees from the heading.
  for (int degrees = -180; degrees < 180; degrees += 15) {
    const double heading = degrees * kPi / 180, angle = heading + 100 * kPi / 180;
    const double x = 60 + 14.5 * std::cos(angle), y = -40 + 14.5 * std::sin(angle);
    const double expected = 100e6 / (x * x + y * y + 170.0 * 170.0);
    EXPECT_NEAR(readings("source { height_mm: 200 } sensor { gain_sd: 0 cosine: false }", {{60, -40, heading}})[0],
                expected, 1e-9 * expected);
  }
}

TEST(Light, OfSeveralSourcesAddsUp) {
  const std::string a = "source { x_mm: 300 } ", b = "source { y_mm: -500 intensity: 40 } ";
  const std::vector<ScenePose> at{{10, 20, 1}};
  const double both = readings(a + b + kQuiet, at)[0];
  EXPECT_NEAR(both, readings(a + kQuiet, at)[0] + readings(b + kQuiet, at)[0], 1e-9);
  EXPECT_NEAR(readings("ambient: 30 " + a + b + kQuiet, at)[0], both + 30, 1e-9);
}

TEST(Light, MovesOnACircle) {
  proto::LightSource source;
  source.set_x_mm(5);
  source.set_y_mm(-7);
  source.mutable_circle()->set_radius_mm(100);
  source.mutable_circle()->set_period_s(8);
  source.mutable_circle()->set_phase_deg(30);
  for (int k = 0; k < 100; ++k) {
    const double t = 0.37 * k, angle = 2 * kPi * t / 8 + kPi / 6;
    const Lamp lamp = lamp_at(settings_of(source), t);
    EXPECT_NEAR(lamp.x_mm, 5 + 100 * std::cos(angle), 1e-9);
    EXPECT_NEAR(lamp.y_mm, -7 + 100 * std::sin(angle), 1e-9);
  }
  source.mutable_circle()->set_clockwise(true);
  source.mutable_circle()->set_phase_deg(0);
  EXPECT_NEAR(lamp_at(settings_of(source), 2).y_mm, -107, 1e-9);
}

TEST(Light, GoesFromWayPointToWayPoint) {
  proto::LightSource source;
  source.set_height_mm(100);
  const auto add = [&](double t, double x, double y) {
    proto::LightWaypoint& point = *source.add_waypoint();
    point.set_time_s(t);
    point.set_x_mm(x);
    point.set_y_mm(y);
  };
  add(1, 0, 0);
  add(3, 100, 0);
  add(4, 100, 50);
  for (const auto& [t, x, y] : std::vector<std::array<double, 3>>{
           {0, 0, 0}, {1, 0, 0}, {1.5, 25, 0}, {3, 100, 0}, {3.5, 100, 25}, {4, 100, 50}, {99, 100, 50}}) {
    EXPECT_NEAR(lamp_at(settings_of(source), t).x_mm, x, 1e-12) << t;
    EXPECT_NEAR(lamp_at(settings_of(source), t).y_mm, y, 1e-12) << t;
    EXPECT_EQ(lamp_at(settings_of(source), t).z_mm, 100);
  }
  source.set_loop(true);
  EXPECT_NEAR(lamp_at(settings_of(source), 4 + 1.5).x_mm, 25, 1e-12);
  source.mutable_waypoint(1)->set_height_mm(20);
  source.mutable_waypoint(2)->set_height_mm(40);
  EXPECT_NEAR(lamp_at(settings_of(source), 3.5).z_mm, 30, 1e-12);
}

TEST(Light, IsSwitchedAtItsTimes) {
  proto::LightSource source;
  source.add_switch_s(2);
  source.add_switch_s(5);
  const auto on = [&](double t) { return lamp_at(settings_of(source), t).intensity > 0; };
  for (const double t : {0.0, 1.9, 5.0, 100.0}) EXPECT_TRUE(on(t)) << t;
  for (const double t : {2.0, 4.9}) EXPECT_FALSE(on(t)) << t;
  source.set_switch_period_s(6);
  for (const double t : {6.5, 11.0, 17.0}) EXPECT_TRUE(on(t)) << t;
  for (const double t : {8.0, 10.5, 15.0}) EXPECT_FALSE(on(t)) << t;
  source.set_on(false);
  EXPECT_FALSE(on(0));
  EXPECT_TRUE(on(3));
}

TEST(Light, GainsVaryBetweenRobotsAsStated) {
  // 2000 robots: the standard error of a standard deviation of 0.2 is 0.0032.
  const std::vector<ScenePose> poses = testing::grid_crowd(2000, 40, testing::Facing::kRight);
  double sum = 0, squares = 0;
  for (const double reading : readings("ambient: 100", poses)) {
    const double log = std::log(reading / 100);
    sum += log;
    squares += log * log;
  }
  EXPECT_NEAR(sum / 2000, 0, 4 * 0.2 / std::sqrt(2000.0));
  EXPECT_NEAR(std::sqrt(squares / 2000), 0.2, 4 * 0.0032);
  const RunPlan known = make_plan("light { ambient: 100 } robot_model { robot: 1 light_gain: 2 light_offset: -5 }",
                                  {{0, 0, 0}, {50, 0, 0}});
  LightField field(known, {1, 2});
  const SwarmView swarm = swarm_of(known);
  field.at(swarm);
  EXPECT_NEAR(field.reading(1), 195, 1e-12);
}

TEST(Light, NoiseGrowsWithTheReading) {
  const RunPlan plan = make_plan("light { sensor { noise_floor: 3 noise_relative: 0.04 } }", {{0, 0, 0}});
  const LightField field(plan, {0, 1});
  EXPECT_EQ(field.sd(0), 3);
  EXPECT_NEAR(field.sd(100), 5, 1e-12);
}

/// A plan with pictures in its manifest.
RunPlan with_picture(const std::string& image, std::uint32_t columns, std::uint32_t rows,
                     const std::vector<std::string>& pictures) {
  proto::Manifest manifest = make_plan("arena { width_mm: 400 height_mm: 200 }", {{0, 0, 0}}).manifest();
  proto::Light& light = *manifest.mutable_experiment()->mutable_light();
  EXPECT_TRUE(google::protobuf::TextFormat::ParseFromString("image { " + image + " }", &light));
  for (const std::string& picture : pictures) {
    light.mutable_image(0)->add_png("x.png");
    proto::LightRaster& raster = *manifest.add_light_raster();
    raster.set_columns(columns);
    raster.set_rows(rows);
    raster.set_brightness(picture);
  }
  return RunPlan(manifest);
}

TEST(LightImage, LiesOnTheArenaWithItsTopUp) {
  // 4 x 2 pixels of 100 mm, all black but the second of the upper row.
  const RunPlan plan = with_picture("black: 10 white: 110 gamma: 1", 4, 2, {std::string("\0\xff\0\0\0\0\0\0", 8)});
  LightField field(plan, {0, 1});
  const SwarmView swarm = swarm_of(plan);
  field.at(swarm);
  const auto at = [&](double x, double y) { return field.light(x, y, 30, 0); };
  EXPECT_NEAR(at(-50, 50), 110, 1e-9);  // the pixel's centre
  EXPECT_NEAR(at(-50, 99), 110, 1e-9);  // beyond the outermost centres
  EXPECT_NEAR(at(0, 50), 60, 1e-9);     // half-way between centres
  EXPECT_NEAR(at(-25, 25), 10 + 100 * 0.75 * 0.75, 1e-9);
  EXPECT_NEAR(at(150, -50), 10, 1e-9);
  EXPECT_EQ(at(201, 0), 0) << "off the picture";
  EXPECT_EQ(at(0, -101), 0);
}

TEST(LightImage, BrightnessGoesThroughGamma) {
  const RunPlan plan =
      with_picture("black: 0 white: 1000 gamma: 2", 1, 1, {std::string("\x33", 1)});  // 51 = 0.2 of 255
  LightField field(plan, {0, 1});
  const SwarmView swarm = swarm_of(plan);
  field.at(swarm);
  EXPECT_NEAR(field.light(0, 0, 30, 0), 40, 1e-9);
}

TEST(LightImage, SequencesFollowTime) {
  const std::vector<std::string> pictures{std::string("\0", 1), "\x7f", "\xff"};
  for (const bool loop : {true, false}) {
    const RunPlan plan =
        with_picture(std::string("black: 0 white: 255 gamma: 1 picture_s: 0.5 loop: ") + (loop ? "true" : "false"),
                     1, 1, pictures);
    LightField field(plan, {0, 1});
    for (std::int64_t k = 0; k < 100; ++k) {
      const SwarmView swarm = swarm_of(plan, Tick{k});
      field.at(swarm);
      const auto shown = static_cast<std::size_t>(plan.tick_length.seconds_at(Tick{k}) / 0.5);
      const std::size_t right = loop ? shown % 3 : std::min<std::size_t>(shown, 2);
      EXPECT_NEAR(field.light(0, 0, 30, 0), static_cast<unsigned char>(pictures[right][0]), 1e-9) << k;
    }
  }
}

TEST(Light, DoesNotDependOnPartitions) {
  const std::vector<ScenePose> poses = testing::random_crowd(300, 800, 800, 34, 5);
  const std::string light =
      "light { shadows: true source { x_mm: 100 y_mm: 50 height_mm: 35 circle {} } source { x_mm: -400 height_mm: "
      "300 } }";
  const RunPlan plan = make_plan(light, poses);
  LightField whole(plan, {0, 300}), part(plan, {100, 200});
  BodyFrame pieces[3];
  for (BodyFrame& piece : pieces) piece.tick = Tick{7};
  for (std::uint32_t robot = 0; robot < 300; ++robot)
    pieces[poses[robot].x_mm < -100  ? 2
           : poses[robot].x_mm < 150 ? 0
                                     : 1]
        .add(robot, poses[robot].x_mm, poses[robot].y_mm, poses[robot].heading_rad);
  const BodyFrame* const three[] = {&pieces[0], &pieces[1], &pieces[2]};
  SwarmView divided(plan.robots(), 0, 0);
  divided.gather(Tick{7}, three);
  const SwarmView swarm = swarm_of(plan, Tick{7});
  whole.at(swarm);
  part.at(divided);
  for (std::uint32_t robot = 100; robot < 200; ++robot) EXPECT_EQ(whole.reading(robot), part.reading(robot));
}

}  // namespace
}  // namespace kilotwin::senses
