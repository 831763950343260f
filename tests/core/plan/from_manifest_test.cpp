#include "core/plan/from_manifest.hpp"

#include <google/protobuf/text_format.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "idl/manifest.pb.h"

namespace kilotwin {
namespace {

using F = proto::Function;
using E = proto::Effect;
using Target = EffectSettings::Target;

PlanSettings settings(const std::string& experiment) {
  proto::Manifest manifest;
  EXPECT_TRUE(google::protobuf::TextFormat::ParseFromString(experiment, manifest.mutable_experiment()));
  return settings_of(manifest);
}

TEST(FromManifest, EveryCovariateOfTheSchemaHasAnEnumerator) {
  const std::vector<std::pair<F::Covariate, Covariate>> pairs{
      {F::NOTHING, Covariate::kNothing},
      {F::TIME, Covariate::kTime},
      {F::X, Covariate::kX},
      {F::Y, Covariate::kY},
      {F::RADIUS, Covariate::kRadius},
      {F::HEADING, Covariate::kHeading},
      {F::COMMAND, Covariate::kCommand},
      {F::DUTY, Covariate::kDuty},
      {F::LEFT_DUTY, Covariate::kLeftDuty},
      {F::RIGHT_DUTY, Covariate::kRightDuty},
      {F::TIME_SINCE_COMMAND, Covariate::kTimeSinceCommand},
      {F::MOTOR_TIME, Covariate::kMotorTime},
      {F::LEFT_MOTOR_TIME, Covariate::kLeftMotorTime},
      {F::RIGHT_MOTOR_TIME, Covariate::kRightMotorTime},
      {F::DRIVEN_TIME, Covariate::kDrivenTime},
      {F::NEIGHBOURS, Covariate::kNeighbours},
      {F::NEAREST, Covariate::kNearest},
      {F::DENSITY, Covariate::kDensity},
      {F::NEAREST_BEARING, Covariate::kNearestBearing},
      {F::ROBOT, Covariate::kRobot},
      {F::RUN, Covariate::kRun},
      {F::PLACE, Covariate::kPlace},
      {F::PREVIOUS_FORWARD, Covariate::kPreviousForward},
      {F::PREVIOUS_SIDEWAYS, Covariate::kPreviousSideways},
      {F::PREVIOUS_TURN, Covariate::kPreviousTurn},
      {F::PREVIOUS_COMMAND, Covariate::kPreviousCommand},
      {F::LAST_TURN, Covariate::kLastTurn},
      {F::PREVIOUS_LASTED, Covariate::kPreviousLasted},
      {F::SINCE_REST, Covariate::kSinceRest},
      {F::MOTOR_TIME_DIFFERENCE, Covariate::kMotorTimeDifference},
      {F::MOTOR_TIME_SUM, Covariate::kMotorTimeSum},
      {F::EARLIER_TURN, Covariate::kEarlierTurn},
      {F::COMMAND_COUNT, Covariate::kCommandCount},
      {F::POINT_DISTANCE, Covariate::kPointDistance},
      {F::ALONG, Covariate::kAlong}};
  ASSERT_EQ(static_cast<int>(pairs.size()), F::Covariate_descriptor()->value_count());
  for (const auto& [schema, plain] : pairs) {
    F function;
    function.set_of(schema);
    function.set_and_of(schema);
    EXPECT_EQ(settings_of(function).of, plain) << F::Covariate_Name(schema);
    EXPECT_EQ(settings_of(function).and_of, plain) << F::Covariate_Name(schema);
  }
}

TEST(FromManifest, EveryTargetAndCommandOfTheSchemaHasAnEnumerator) {
  const std::vector<std::pair<E::Target, Target>> targets{{E::WHEEL_GAIN, Target::kWheelGain},
                                                          {E::WHEEL_OFFSET, Target::kWheelOffset},
                                                          {E::TURN_RATE, Target::kTurnRate},
                                                          {E::BODY_DRIFT, Target::kBodyDrift},
                                                          {E::WORLD_DRIFT, Target::kWorldDrift},
                                                          {E::MEASURED_OFFSET, Target::kMeasuredOffset},
                                                          {E::MEASURED_BODY_OFFSET, Target::kMeasuredBodyOffset},
                                                          {E::MEASURED_SCALE, Target::kMeasuredScale},
                                                          {E::MEASURED_HEADING, Target::kMeasuredHeading}};
  ASSERT_EQ(static_cast<int>(targets.size()), E::Target_descriptor()->value_count());
  for (const auto& [schema, plain] : targets) {
    E effect;
    effect.set_acts_on(schema);
    EXPECT_EQ(settings_of(effect).target, plain) << E::Target_Name(schema);
    EXPECT_EQ(settings_of(effect).is_measured(), E::Target_Name(schema).starts_with("MEASURED"));
  }
  const std::vector<std::pair<proto::Command, MotionCommand>> commands{{proto::STOP, MotionCommand::kStop},
                                                                       {proto::STRAIGHT, MotionCommand::kStraight},
                                                                       {proto::LEFT, MotionCommand::kTurnLeft},
                                                                       {proto::RIGHT, MotionCommand::kTurnRight}};
  ASSERT_EQ(static_cast<int>(commands.size()), proto::Command_descriptor()->value_count());
  for (const auto& [schema, plain] : commands) {
    E effect;
    effect.add_during(schema);
    EXPECT_EQ(settings_of(effect).during, std::vector<MotionCommand>{plain});
  }
}

TEST(FromManifest, AbsentFieldsHaveTheDefaultOfTheSchema) {
  const PlanSettings plain = settings("");
  const proto::Experiment schema;
  EXPECT_EQ(plain.motion.straight_speed_mm_s, schema.motion().straight_speed_mm_s());
  EXPECT_EQ(plain.motion.noise, schema.motion().noise());
  EXPECT_EQ(plain.physics.thrust_N, schema.physics().thrust_n());
  EXPECT_EQ(plain.physics.sub_steps, schema.physics().sub_steps());
  EXPECT_EQ(plain.radio.model, RadioSettings::Model::kDisc);
  EXPECT_EQ(plain.radio.propagation.capture_db, schema.radio().propagation().capture_db());
  EXPECT_EQ(plain.radio.simple.contention, schema.radio().simple().contention());
  EXPECT_EQ(plain.recording.every_s, schema.recording().every_s());
  EXPECT_FALSE(plain.light || plain.battery || plain.temperature);
  EXPECT_TRUE(plain.robots.empty() && plain.effects.empty() && plain.fields.empty());
}

TEST(FromManifest, SettingsOfSingleRobotsHoldOnlyStatedValues) {
  const PlanSettings some = settings(
      "robot_model { robot: 3 bias_left_mm_s: 0 turn_right: 80 light_gain: 1.5 }"
      "radio { propagation { robot { robot: 2 power_db: -1 ir_high: 9 } power_pattern_db: [1, 2, 3] "
      "link { sender: 1 receiver: 2 offset_db: 4 } } }");
  ASSERT_EQ(some.robots.size(), 1u);
  const RobotSettings& robot = some.robots.front();
  EXPECT_EQ(robot.robot, 3u);
  EXPECT_EQ(robot.bias_left_mm_s, 0.0);
  EXPECT_EQ(robot.bias_right_mm_s, std::nullopt);
  EXPECT_EQ(robot.turn_right, 80u);
  EXPECT_EQ(robot.turn_left, std::nullopt);
  EXPECT_EQ(robot.light_gain, 1.5);
  EXPECT_EQ(robot.light_offset, std::nullopt);
  const PropagationSettings& propagation = some.radio.propagation;
  ASSERT_EQ(propagation.robots.size(), 1u);
  EXPECT_EQ(propagation.robots.front().power_db, -1.0);
  EXPECT_EQ(propagation.robots.front().sensitivity_db, std::nullopt);
  EXPECT_EQ(propagation.robots.front().oscillator, std::nullopt);
  EXPECT_EQ(propagation.robots.front().ir_high, std::vector<std::uint32_t>{9});
  EXPECT_EQ(propagation.power_pattern_db, (std::vector<double>{1, 2, 3}));
  ASSERT_EQ(propagation.links.size(), 1u);
  EXPECT_EQ(propagation.links.front().offset_db, 4);
}

TEST(FromManifest, EachImageTakesItsOwnPictures) {
  proto::Manifest manifest;
  ASSERT_TRUE(
      google::protobuf::TextFormat::ParseFromString("arena { width_mm: 400 height_mm: 300 } light { image { png: "
                                                    "'a' png: 'b' } image { png: 'c' width_mm: 20 } }",
                                                    manifest.mutable_experiment()));
  for (const char* brightness : {"1", "2", "3"}) {
    proto::LightRaster& raster = *manifest.add_light_raster();
    raster.set_columns(1);
    raster.set_rows(1);
    raster.set_brightness(brightness);
  }
  const PlanSettings plan = settings_of(manifest);
  ASSERT_TRUE(plan.light && plan.light->images.size() == 2);
  const std::vector<LightImageSettings>& images = plan.light->images;
  ASSERT_EQ(images[0].pictures.size(), 2u);
  EXPECT_EQ(images[0].pictures[1].brightness, "2");
  EXPECT_EQ(images[0].width_mm, 400);
  EXPECT_EQ(images[0].height_mm, 300);
  ASSERT_EQ(images[1].pictures.size(), 1u);
  EXPECT_EQ(images[1].pictures[0].brightness, "3");
  EXPECT_EQ(images[1].width_mm, 20);
}

}  // namespace
}  // namespace kilotwin
