// Camera scale: estimated by contacts, kept during the fit of a map, and consistent for all lengths.
#include "clients/identify/model/camera_scale.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "clients/identify/fit/fitter.hpp"
#include "core/random/random.hpp"

namespace kilotwin::identify {
namespace {

/// Distances of robots that pass each other outside `edge_mm`; every other pair stays in contact for a while.
std::vector<RobotPair> met(double edge_mm, double sd_mm, std::uint64_t seed, bool touching) {
  const Random random(seed);
  std::vector<RobotPair> pairs;
  for (std::uint32_t encounter = 1; encounter <= 200; ++encounter) {
    for (std::uint32_t i = 0; i < 4; ++i) {
      const double u = random.uniform(Stream::kLayout, encounter, Tick{i}, 0);
      // Uniform density in a ring.
      const double least = touching ? edge_mm : 20.0;
      const double passing = std::sqrt(least * least + u * (48.0 * 48 - least * least));
      const bool stays = touching && encounter % 2 == 0;
      RobotPair& pair = pairs.emplace_back();
      pair.distance_mm =
          (stays ? edge_mm : passing) + sd_mm * random.normal(Stream::kMeasurementNoise, encounter, Tick{i}, 0);
      pair.encounter = encounter;
    }
  }
  return pairs;
}

/// A model with a camera map.
MotionModel bent() {
  MotionModel model;
  model.walls = {-400, 380, -300, 310};
  Factor plane;
  plane.shape = Factor::Shape::kPolynomials2;
  plane.axis.of = Covariate::kX;
  plane.and_axis.of = Covariate::kY;
  plane.low = -500;
  plane.high = 520;
  plane.and_low = -480;
  plane.and_high = 470;
  plane.count = 3;
  Term term;
  term.name = "camera-by-position";
  term.blocks = {{Target::kMeasuredX, Basis{{plane}}, kAlways}, {Target::kMeasuredY, Basis{{plane}}, kAlways}};
  term.coefficients = Eigen::VectorXd::LinSpaced(18, -9, 8);
  term.precision = Eigen::VectorXd::Ones(18);
  model.terms.push_back(term);
  return model;
}

TEST(CameraScale, ContactsDetermineTheContactDistance) {
  for (const double edge : {31.0, 33.0, 35.5}) {
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      const auto found = contact_distance(met(edge, 0.6, seed, true));
      ASSERT_TRUE(found.has_value());
      EXPECT_NEAR(found->mm, edge, 3 * found->sd_mm);
      EXPECT_LT(found->sd_mm, 0.6);
    }
  }
}

TEST(CameraScale, RobotsWithoutCollisionsDetermineNone) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed)
    EXPECT_FALSE(contact_distance(met(33, 0.6, seed, false)).has_value()) << seed;
}

TEST(CameraScale, AllLengthsScaleTogether) {
  const MotionModel model = bent();
  MotionModel larger = model;
  ASSERT_TRUE(rescale(larger, 1.06));
  EXPECT_NEAR(larger.base.straight_mm_s, 1.06 * model.base.straight_mm_s, 1e-12);
  EXPECT_NEAR(larger.base.wheel_base_mm, 1.06 * model.base.wheel_base_mm, 1e-12);
  EXPECT_NEAR(larger.walls.x_high_mm - larger.walls.x_low_mm, 1.06 * 780, 1e-9);
  // The measurement of a robot's point stays; positions scale about the middle of the map, (10, -5).
  Situation at;
  const double centre = model.base.centre_mm, ahead = model.base.ahead_mm;
  for (const double x : {-350.0, 20.0, 300.0}) {
    for (const double y : {-280.0, 130.0}) {
      const Eigen::Vector3d before = model.measured(x - centre, y, 0, at);
      const double wide_x = 10 + 1.06 * (x - 10), wide_y = -5 + 1.06 * (y + 5);
      const Eigen::Vector3d after = larger.measured(wide_x - centre, wide_y, 0, at);
      // The offset of the tracked point scales too.
      EXPECT_NEAR(after[0] - (larger.base.ahead_mm - centre), before[0] - (ahead - centre), 1e-9);
      EXPECT_NEAR(after[1], before[1], 1e-9);
    }
  }
}

TEST(CameraScale, WithoutAMapNothingIsScaled) {
  MotionModel model;
  EXPECT_FALSE(rescale(model, 1.1));
  EXPECT_EQ(model.base.straight_mm_s, BaseParameters{}.straight_mm_s);
}

TEST(CameraScale, TheConstraintKeepsMeanLengths) {
  const MotionModel model = bent();
  std::vector<RobotPair> pairs = met(33, 0.6, 1, true);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    pairs[i].x_mm = -300 + 40.0 * static_cast<double>(i % 16);
    pairs[i].y_mm = -250 + 33.0 * static_cast<double>(i % 15);
  }
  const ScaleConstraint hold(model, pairs, 0.01);
  EXPECT_NEAR(hold.factor(model), 1, 1e-9);
  MotionModel larger = model;
  ASSERT_TRUE(rescale(larger, 1.04));
  EXPECT_NEAR(hold.factor(larger), 1 / 1.04, 1e-3);
}

TEST(CameraScale, WallsKeepTheirPlacesInTheImage) {
  MotionModel flat = bent();
  flat.terms.front().coefficients.setZero();
  MotionModel larger = flat;
  ASSERT_TRUE(rescale(larger, 1.05));
  const Walls walls = carried(flat.walls, flat, larger);
  EXPECT_NEAR(walls.x_high_mm, larger.walls.x_high_mm, 0.01);
  EXPECT_NEAR(walls.y_low_mm, larger.walls.y_low_mm, 0.01);
  flat.walls.x_low_mm = -INFINITY;
  EXPECT_TRUE(std::isinf(carried(flat.walls, flat, larger).x_low_mm));
}

TEST(CameraScale, OnlyLinearColumnsChangeTheScale) {
  EXPECT_EQ(log_scale_by_coefficients(MotionModel{}).size(), 0);
  // With another term before it, and a map with pruned columns.
  MotionModel model = bent();
  Factor clock;
  clock.axis.of = Covariate::kTime;
  clock.count = 3;
  const Term slow{"speed-by-time",
                  {{Target::kGain, Basis{{clock}}, kDriven}},
                  Eigen::VectorXd::Zero(3),
                  Eigen::VectorXd::Ones(3)};
  model.terms.insert(model.terms.begin(), slow);
  Term& map = model.terms.back();
  map.blocks[0].basis.chosen = {0, 2, 4};
  map.blocks[1].basis.chosen = {1, 5};
  map.coefficients = Eigen::VectorXd::LinSpaced(5, -9, 8);
  map.precision = Eigen::VectorXd::Ones(5);
  const Eigen::VectorXd by = log_scale_by_coefficients(model);
  ASSERT_EQ(by.size(), 8);
  // First order: the change of the coefficients by rescale() shrinks the image as the world grows.
  const double factor = 1.001;
  MotionModel larger = model;
  ASSERT_TRUE(rescale(larger, factor));
  Eigen::VectorXd change = Eigen::VectorXd::Zero(8);
  change.tail(5) = larger.terms.back().coefficients - map.coefficients;
  EXPECT_NEAR(by.dot(change), 1 - factor, 2e-6);
  EXPECT_EQ((by.array() != 0).count(), 2);
  // 1 % along x alone is half a per cent in scale.
  Eigen::VectorXd wider = Eigen::VectorXd::Zero(8);
  wider[3] = 0.01 * (520 + 500) / 2;
  EXPECT_NEAR(by.dot(wider), 0.005, 1e-12);
}

/// A constant shift or rotation of the image changes all measurements and initial poses alike, so it has no
/// likelihood gain.
TEST(CameraScale, ConstantShiftAndRotationAreNotIdentifiable) {
  MeasuredSet set;
  set.has_commands = set.has_headings = true;
  auto& run = set.runs.emplace_back();
  for (std::uint32_t robot = 0; robot < 2; ++robot) {
    Track& track = run.tracks.emplace_back();
    track.robot = robot;
    track.commands.push_back({-1e300, Motion::kStraight});
    for (int i = 0; i < 40; ++i)
      track.samples.push_back({0.5 * i, 5.0 * i + 0.3 * (i % 3), 200.0 * robot + 0.2 * (i % 4), 0.01 * (i % 2)});
  }
  // The tracked point is the turning centre, so that a rotation changes initial poses exactly.
  MotionModel model;
  model.base.ahead_mm = 0;
  PreparedSet prepared(set);
  prepared.find_headings(model, 1);
  Factor slope;
  slope.axis.of = Covariate::kX;
  slope.high = 200;
  const std::vector<Block> blocks = {{Target::kMeasuredX, Basis{}, kAlways},
                                     {Target::kMeasuredTurn, Basis{}, kAlways},
                                     {Target::kMeasuredX, Basis{{slope}}, kAlways},
                                     {Target::kMeasuredHeading, Basis{}, kAlways}};
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(kBaseColumns + 4, kBaseColumns + 4);
  for (const Unit& unit : linearise(model, prepared.units(), blocks, {100, 1})) information += unit.information;
  const auto known = [&](Eigen::Index block) { return information(kBaseColumns + block, kBaseColumns + block); };
  EXPECT_NEAR(known(0), 0, 1e-9);
  // Except for the filter's outlier weights, which do not rotate.
  EXPECT_LT(0.1 * 0.1 * known(1), 0.01);
  // A distortion of 30 mm and a heading offset of 0.1 rad do have a likelihood gain: motion and heading disagree.
  EXPECT_GT(30 * 30 * known(2), 1);
  EXPECT_GT(0.1 * 0.1 * known(3), 1);
}

}  // namespace
}  // namespace kilotwin::identify
