// Inference with contacts between robots, and forecasts of robots in contact.
#include <gtest/gtest.h>

#include <cmath>

#include "clients/identify/fit/fitter.hpp"
#include "clients/identify/predict/rollout.hpp"
#include "core/random/random.hpp"

namespace kilotwin::identify {
namespace {

constexpr double kSlow = 0.6;

/// Pairs of robots. One rests; the other leans against it and turns on the spot with gain kSlow.
MeasuredSet held_fast(bool headings) {
  const Random random(4);
  const double dt = 0.5, tracker_mm = 0.3, tracker_rad = 0.03;
  MeasuredSet set;
  set.has_commands = true;
  set.has_headings = headings;
  Run& run = set.runs.emplace_back();
  for (std::uint32_t r = 0; r < 16; ++r) {
    Track& track = run.tracks.emplace_back();
    track.robot = r;
    track.commands.push_back({-1e300, Motion::kStop});
    const bool turns = r % 2 == 0;
    double heading = 0.3 * r;
    for (int k = 0; k < 240; ++k) {
      const auto noise = [&](std::uint32_t draw) {
        return random.normal(Stream::kMeasurementNoise, r, Tick{k}, draw);
      };
      if (turns && k % 10 == 0) track.commands.push_back({k * dt, k % 20 == 0 ? Motion::kLeft : Motion::kRight});
      track.samples.push_back({k * dt, 200.0 * (r / 2) + (turns ? 0 : 33.5) + tracker_mm * noise(0),
                               tracker_mm * noise(1),
                               headings ? wrapped_angle(heading + tracker_rad * noise(2)) : std::nan("")});
      if (turns) heading += (k % 20 < 10 ? 1 : -1) * kSlow * 20 / 25 * dt;
    }
  }
  return set;
}

/// Fitted gain near other robots; elsewhere the gain is 1.
double gain_beside_others(bool headings) {
  const MeasuredSet set = held_fast(headings);
  const Fitter fitter(set, 2);
  FitState state(set);
  MotionModel& model = state.model;
  Factor near;
  near.shape = Factor::Shape::kTaper;
  near.axis = {Covariate::kNearest, 3};
  near.high = kNeighbourRadii_mm[3];
  model.terms.push_back({"effect",
                         {{Target::kGain, Basis{{near}}, kDriven}},
                         Eigen::VectorXd::Zero(1),
                         Eigen::VectorXd::Constant(1, 1)});
  fitter.fit(state, 4);
  Situation s;
  s.commands.command = Motion::kLeft;
  s.near.nearest_mm = 33.5;
  return model.rates(s, {0, 0}).right_gain * model.base.turn_mm_s / model.base.wheel_base_mm / 0.8;
}

TEST(Contacts, HeadingsDetermineTheGainInContact) { EXPECT_NEAR(gain_beside_others(true), kSlow, 0.03); }

TEST(Contacts, PositionsInContactCarryNoInformation) { EXPECT_NEAR(gain_beside_others(false), 1, 1e-6); }

TEST(Contacts, TheFullLikelihoodIncludesContacts) {
  // Without headings, contacts yield no information, and here all robots are in contact. Large contact noise must
  // explain that driven robots do not move.
  MeasuredSet set = held_fast(false);
  const Fitter fitter(set, 2);
  FitState much(set), little(set);
  little.model.noise.contact_mm2_s = much.model.noise.contact_mm2_s / 100;
  EXPECT_EQ(fitter.log_likelihood(much), 0);
  EXPECT_EQ(fitter.log_likelihood(little), 0);
  EXPECT_GT(fitter.log_likelihood_of_all(much), fitter.log_likelihood_of_all(little) + 100);
  // Without contacts both likelihoods are equal.
  FitState none = much;
  none.model.contacts = false;
  EXPECT_NEAR(fitter.log_likelihood_of_all(none), fitter.log_likelihood(none), 1e-6);
  EXPECT_NE(fitter.log_likelihood(none), 0);
  // Held-out tracks enter neither.
  const double before = fitter.log_likelihood_of_all(much);
  for (Track& track : set.runs.front().tracks) track.held_out = track.robot >= 8;
  const double half = fitter.log_likelihood_of_all(much);
  for (Track& track : set.runs.front().tracks) track.held_out = track.robot < 8;
  EXPECT_NEAR(fitter.log_likelihood_of_all(much) + half, before, 1e-6);
  EXPECT_NEAR(half / before, 0.5, 0.1);
}

TEST(Contacts, RolloutsConvergeInTheStep) {
  // One robot pushes two at rest, the second one off-centre.
  const double dt = 0.01, duration_s = 8;
  std::vector<double> x{0, 36, 70}, y{0, 5, -6};
  for (double t = 0; t < duration_s - dt / 2; t += dt) {
    x[0] += 10 * dt;
    for (int pass = 0; pass < 50 && push_apart(x, y); ++pass) continue;
  }
  identify::Run run;
  for (std::uint32_t r = 0; r < 3; ++r) {
    Track& track = run.tracks.emplace_back();
    track.robot = r;
    track.commands.push_back({-1e300, r == 0 ? Motion::kStraight : Motion::kStop});
    const std::array<double, 3> from_x{0, 36, 70}, from_y{0, 5, -6};
    track.samples.push_back({0, from_x[r], from_y[r], 0});
  }
  MotionModel model;
  model.noise = {1e-12, 1e-12, 1e-12, 1e-12, 1e-8, 1e-10};
  const RobotBias none{Eigen::Vector2d::Zero(), Eigen::Matrix2d::Zero()};
  const std::vector<CommandClock> clocks(run.tracks.begin(), run.tracks.end());
  std::vector<TrackView> views;
  std::vector<TrackFilter> filters;
  for (const Track& track : run.tracks) {
    views.push_back({&track, 0, 0, track.robot, nullptr, &clocks[track.robot]});
    filters.emplace_back(model, none, track.robot, 0);
    filters.back().start(track.samples.front(), {}, 0, 1e-6);
  }
  std::vector<RolloutStart> robots;
  for (std::size_t r = 0; r < 3; ++r) robots.push_back({&views[r], {&filters[r]}, {1.0}, 0});
  const std::vector<RolloutMoments> seen =
      rollouts(model, robots, TrafficGrids(model), 0, duration_s, 4, false, {1, 2});
  for (std::size_t r = 0; r < 3; ++r) {
    EXPECT_NEAR(seen[r].x_mm, x[r], 1.0);
    EXPECT_NEAR(seen[r].y_mm, y[r], 1.0);
  }
}

TEST(Contacts, PushApartReportsOverlaps) {
  std::vector<double> x{0, 40, 70}, y{0, 0, 0};
  EXPECT_TRUE(push_apart(x, y));
  EXPECT_NEAR(x[2] - x[1], 33, 1e-9);
  EXPECT_FALSE(push_apart(x, y));
}

TEST(FitState, ATrialOnACopyLeavesNoTrace) {
  const MeasuredSet set = held_fast(false);
  const Fitter fitter(set, 2);
  FitState state(set);
  state.tracks.find_centres(state.model, 2);
  state.tracks.find_headings(state.model, 2);
  const double likelihood = fitter.log_likelihood_of_all(state);
  // Another camera scale changes disc centres and initial headings; other cells change the traffic.
  FitState trial = state;
  trial.model.terms.push_back({"camera",
                               {{Target::kMeasuredScale, {}}},
                               Eigen::VectorXd::Constant(1, 0.3),
                               Eigen::VectorXd::Constant(1, 1)});
  trial.model.cells[0].side_mm = 20;
  trial.tracks.update_traffic(trial.model);
  trial.tracks.find_centres(trial.model, 2);
  fitter.fit(trial, 1);
  EXPECT_EQ(fitter.log_likelihood_of_all(state), likelihood);
  // The trial's own estimates of the tracks count.
  trial.model = state.model;
  EXPECT_GT(std::abs(fitter.log_likelihood_of_all(trial) - likelihood), 1);
  // Going back is assignment.
  trial = state;
  EXPECT_EQ(fitter.log_likelihood_of_all(trial), likelihood);
}

}  // namespace
}  // namespace kilotwin::identify
