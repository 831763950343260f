// Initial state of the filter: the predicted measurement equals the first sample.
#include "clients/identify/fit/track_filter.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "clients/identify/fit/filter_bank.hpp"
#include "clients/identify/fit/prepared_set.hpp"

namespace kilotwin::identify {
namespace {

/// A camera with shift, rotation and scale, and a heading error that depends on the heading.
MotionModel through_a_bad_tracker() {
  MotionModel model;
  Factor round;
  round.shape = Factor::Shape::kHarmonics;
  round.axis.of = Covariate::kHeading;
  round.count = 1;
  Term term;
  term.name = "camera";
  term.blocks = {{Target::kMeasuredX, Basis{}, kAlways},
                 {Target::kMeasuredTurn, Basis{}, kAlways},
                 {Target::kMeasuredScale, Basis{}, kAlways},
                 {Target::kMeasuredHeading, Basis{}, kAlways},
                 {Target::kMeasuredHeading, Basis{{round}}, kAlways}};
  term.coefficients.resize(6);
  term.coefficients << 12, 0.1, -0.06, 0.3, 0.08, -0.05;
  term.precision = Eigen::VectorXd::Ones(6);
  model.terms.push_back(term);
  return model;
}

TEST(TrackFilter, MeasurementEffectsAreRemovedFromTheFirstHeading) {
  const MotionModel model = through_a_bad_tracker();
  const RobotBias none{Eigen::Vector2d::Zero(), Eigen::Matrix2d::Zero()};
  for (double heading = -3; heading <= 3; heading += 0.75) {
    const Sample sample{2, 150 + 20 * heading, -90, heading};
    TrackFilter filter(model, none, 1, 0);
    filter.start(sample, {}, heading, 0.05);
    // Far below any tracker noise.
    const Eigen::Vector3d seen = filter.expected(sample.time_s, {});
    EXPECT_NEAR(seen[0], sample.x_mm, 0.01) << heading;
    EXPECT_NEAR(seen[1], sample.y_mm, 0.01) << heading;
    EXPECT_NEAR(wrapped_angle(seen[2] - heading), 0, 1e-4) << heading;
    EXPECT_GT(std::abs(wrapped_angle(filter.belief().mean[2] - heading)), 0.2) << heading;
  }
}

TEST(TrackFilter, AnUnmeasuredHeadingKeepsItsInitialValue) {
  const MotionModel model = through_a_bad_tracker();
  const RobotBias none{Eigen::Vector2d::Zero(), Eigen::Matrix2d::Zero()};
  const Sample sample{2, 150, -90, std::nan("")};
  TrackFilter filter(model, none, 1, 0);
  filter.start(sample, {}, 0.7, 0.3);
  EXPECT_EQ(filter.belief().mean[2], 0.7);
  EXPECT_NEAR(filter.expected(2, {})[0], sample.x_mm, 0.01);
  EXPECT_NEAR(filter.expected(2, {})[1], sample.y_mm, 0.01);
}

/// A track without headings of a robot that drives straight at the model's speed.
MeasuredSet straight_track(const MotionModel& model, double heading_rad, double pushed_at_s, double pushed_mm) {
  MeasuredSet set;
  Track& track = set.runs.emplace_back(identify::Run{"r", {}}).tracks.emplace_back();
  track.commands = {{-1e300, Motion::kStraight}};
  for (double t = 0; t < 40; t += 0.5) {
    const double way_mm = model.base.straight_mm_s * t, aside_mm = t >= pushed_at_s ? pushed_mm : 0;
    track.samples.push_back({t, way_mm * std::cos(heading_rad) - aside_mm * std::sin(heading_rad),
                             way_mm * std::sin(heading_rad) + aside_mm * std::cos(heading_rad), std::nan("")});
  }
  return set;
}

/// The weight of hypotheses within 0.6 rad of a heading.
double weight_near(const FilterBank& bank, double heading_rad) {
  constexpr double kNear_rad = 0.6;
  double near = 0, all = 0;
  for (const FilterBank::Hypothesis& h : bank.hypotheses()) {
    const double weight = std::exp(h.log_weight);
    all += weight;
    if (std::abs(wrapped_angle(h.filter.belief().mean[2] - heading_rad)) < kNear_rad) near += weight;
  }
  return near / all;
}

TEST(FilterBank, APushLeavesTheHeadingLikely) {
  constexpr double kHeading_rad = 0.7, kPushed_s = 20;
  MotionModel model;
  model.robots[0] = {Eigen::Vector2d::Zero(), 1e-4 * Eigen::Matrix2d::Identity()};
  const MeasuredSet set = straight_track(model, kHeading_rad, kPushed_s, 60);
  const PreparedSet prepared(set);
  FilterBank bank(model, prepared.views().front());
  bank.advance_to(kPushed_s - 0.5);
  EXPECT_EQ(bank.hypotheses().size(), 1u);
  EXPECT_GT(weight_near(bank, kHeading_rad), 0.99);
  // The track is lost after some samples: all headings are possible, the one so far is the likeliest.
  double restarted_s = 0;
  for (double t = kPushed_s; t < 30 && restarted_s == 0; t += 0.5) {
    bank.advance_to(t);
    if (bank.hypotheses().size() > 9) restarted_s = t;
  }
  ASSERT_GT(restarted_s, 0);
  EXPECT_GT(weight_near(bank, kHeading_rad), 0.6);
  EXPECT_GT(weight_near(bank, kHeading_rad + M_PI), 0.01);
  bank.advance_to(39);
  EXPECT_GT(weight_near(bank, kHeading_rad), 0.99);
}

TEST(FilterBank, ACameraMapThatShowsRobotsBeyondAWallIsWrongThere) {
  // By the map, robots are 12 mm further right than they are: beyond the wall along which this one slides.
  constexpr double kHeading_rad = 0.5, kWall_mm = 200;
  MotionModel model;
  model.base.ahead_mm = 0;
  model.walls.x_high_mm = kWall_mm;
  model.robots[0] = {Eigen::Vector2d::Zero(), 1e-4 * Eigen::Matrix2d::Identity()};
  model.terms.push_back({"camera",
                         {{Target::kMeasuredX, Basis{}, kAlways}},
                         Eigen::VectorXd::Constant(1, -12),
                         Eigen::VectorXd::Ones(1)});
  MeasuredSet set;
  Track& track = set.runs.emplace_back(identify::Run{"r", {}}).tracks.emplace_back();
  track.commands = {{-1e300, Motion::kStraight}};
  const double ahead_mm = model.base.centre_mm * std::cos(kHeading_rad);
  for (double t = 0; t < 25; t += 0.5) {
    const double way_mm = model.base.straight_mm_s * t;
    track.samples.push_back({t, std::min(100 + way_mm * std::cos(kHeading_rad), kWall_mm - ahead_mm),
                             way_mm * std::sin(kHeading_rad), std::nan("")});
  }
  const PreparedSet prepared(set);
  FilterBank bank(model, prepared.views().front());
  bank.advance_to(25);
  EXPECT_EQ(bank.hypotheses().size(), 1u);  // not lost
  const Belief& belief = bank.hypotheses().front().filter.belief();
  EXPECT_NEAR(belief.mean[2], kHeading_rad, 0.2);
  EXPECT_NEAR(belief.centre_x_mm(), kWall_mm, 3);
}

/// Robot 0 drives straight, meets robot 1, which rests, and is jammed there. It creeps aside, for the contact yields.
MeasuredSet jammed(const MotionModel& model, double heading_rad, double meets_s) {
  constexpr double kCreep_mm_s = 1.5;
  MeasuredSet set;
  std::vector<Track>& tracks = set.runs.emplace_back().tracks;
  tracks.resize(2);
  Track &moves = tracks.front(), &rests = tracks.back();
  moves.commands = {{-1e300, Motion::kStraight}};
  rests.robot = 1;
  rests.commands = {{-1e300, Motion::kStop}};
  const double c = std::cos(heading_rad), s = std::sin(heading_rad);
  const double apart_mm = model.base.straight_mm_s * meets_s + model.base.centre_mm + kDiscDiameter_mm;
  for (double t = 0; t < 45; t += 0.5) {
    const double way_mm = model.base.straight_mm_s * std::min(t, meets_s);
    const double aside_mm = kCreep_mm_s * std::max(0.0, t - meets_s);
    moves.samples.push_back({t, way_mm * c - aside_mm * s, way_mm * s + aside_mm * c, std::nan("")});
    rests.samples.push_back({t, apart_mm * c - aside_mm * s, apart_mm * s + aside_mm * c, std::nan("")});
  }
  return set;
}

TEST(FilterBank, ARobotThatIsJammedKeepsItsHeading) {
  constexpr double kHeading_rad = 0.7, kMeets_s = 20;
  MotionModel model;
  model.base.ahead_mm = 0;
  model.contacts = true;
  for (std::uint32_t robot = 0; robot < 2; ++robot)
    model.robots[robot] = {Eigen::Vector2d::Zero(), 1e-4 * Eigen::Matrix2d::Identity()};
  const MeasuredSet set = jammed(model, kHeading_rad, kMeets_s);
  PreparedSet prepared(set);
  prepared.find_centres(model, 1);
  FilterBank bank(model, prepared.views().front());
  bank.advance_to(45);
  EXPECT_EQ(bank.hypotheses().size(), 1u);
  EXPECT_NEAR(wrapped_angle(bank.hypotheses().front().filter.belief().mean[2] - kHeading_rad), 0, 0.1);
  // Where robots do not touch each other, the same track shows another heading.
  model.contacts = false;
  FilterBank alone(model, prepared.views().front());
  alone.advance_to(45);
  EXPECT_LT(weight_near(alone, kHeading_rad), 0.5);
}

TEST(FilterBank, KeepsAHypothesisIfNoWeightIsFinite) {
  MeasuredSet set;
  Track& track = set.runs.emplace_back(identify::Run{"r", {}}).tracks.emplace_back();
  track.commands = {{-1e300, Motion::kStraight}};
  for (int k = 0; k < 5; ++k) track.samples.push_back({1.0 * k, 10.0 * k, 0, std::nan("")});
  const PreparedSet prepared(set);
  MotionModel model;
  // The determinant of the innovations' covariance is beyond the largest number.
  model.noise.position_mm2 = 1e200;
  FilterBank bank(model, prepared.views().front());
  for (const Sample& sample : track.samples) {
    bank.advance_to(sample.time_s);
    ASSERT_FALSE(bank.hypotheses().empty()) << sample.time_s;
    for (const FilterBank::Hypothesis& h : bank.hypotheses()) EXPECT_TRUE(std::isfinite(h.log_weight));
  }
}

}  // namespace
}  // namespace kilotwin::identify
