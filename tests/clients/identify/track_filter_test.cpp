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
