// Laws of the refinement: closed-form evidence, smoothness, recovered shapes and change points.
#include "clients/identify/search/shape_refinement.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "clients/identify/search/amplitudes.hpp"
#include "clients/identify/search/change_points.hpp"
#include "clients/identify/search/neighbour_shape.hpp"
#include "clients/identify/search/simplification.hpp"
#include "clients/identify/search/target_extension.hpp"
#include "core/random/random.hpp"

namespace kilotwin::identify {
namespace {

/// Effects on the robots of a set.
struct TargetGroup {
  std::function<double(double since_s)> gain = [](double) { return 1.0; };
  std::function<double(std::uint32_t robot, double time_s)> own_gain = [](std::uint32_t, double) { return 1.0; };
  std::function<double(double time_s)> drift_x_mm_s = [](double) { return 0.0; };
  /// Gain by the motor-on time of the wheel's own motor.
  std::function<double(double used_s)> left = [](double) { return 1.0; }, right = [](double) { return 1.0; };
};

/// Distant robots that drive straight and turn alternately, with arcs of 20 ms, wheel and tracker noise.
MeasuredSet played(const TargetGroup& acting, std::uint64_t seed, std::uint32_t robots, double duration_s) {
  const Random random(seed);
  const double dt = 0.02, factor_s = 0.001, tracker_mm = 0.5, tracker_rad = 0.03;
  MeasuredSet set;
  set.has_commands = set.has_headings = true;
  Run& run = set.runs.emplace_back();
  run.name = "r";
  for (std::uint32_t robot = 0; robot < robots; ++robot) {
    Track& track = run.tracks.emplace_back();
    track.robot = robot;
    double x = 3000.0 * robot, y = 0, heading = robot, since_s = 0, next_s = 0;
    double left_s = 0, right_s = 0;
    track.commands.push_back({-1e300, Motion::kStop});
    for (int k = 0; k * dt <= duration_s; ++k) {
      const double t = k * dt;
      const auto noise = [&](Stream stream, std::uint32_t draw) {
        return random.normal(stream, robot, Tick{k}, draw);
      };
      if (k % 25 == 0)
        track.samples.push_back({t, x + 9.2 * std::cos(heading) + tracker_mm * noise(Stream::kMeasurementNoise, 0),
                                 y + 9.2 * std::sin(heading) + tracker_mm * noise(Stream::kMeasurementNoise, 1),
                                 wrapped_angle(heading + tracker_rad * noise(Stream::kMeasurementNoise, 2))});
      if (t >= next_s - 1e-9) {
        const bool straight = track.commands.back().motion != Motion::kStraight;
        const double draw = random.uniform(Stream::kLayout, robot, Tick{k}, 0);
        track.commands.push_back({t, straight ? Motion::kStraight : draw < 0.5 ? Motion::kLeft : Motion::kRight});
        next_s = t + (straight ? 3 + 6 * draw : 1 + 2 * draw);
        since_s = 0;
      }
      const Eigen::Vector2d v = acting.own_gain(robot, t) * acting.gain(since_s) *
                                nominal_speeds(BaseParameters{}, track.commands.back().motion);
      const double sd = std::sqrt(factor_s / dt);
      Rates rates;
      rates.left_mm_s = acting.left(left_s) * v[0] * (1 + sd * noise(Stream::kWheelFactor, 0));
      rates.right_mm_s = acting.right(right_s) * v[1] * (1 + sd * noise(Stream::kWheelFactor, 1));
      rates.drift_x_mm_s = acting.drift_x_mm_s(t);
      const Arc arc = arc_of(rates, 25, heading, dt);
      x += arc.dx_mm;
      y += arc.dy_mm;
      heading += arc.dheading_rad;
      since_s += dt;
      left_s += v[0] > 0 ? dt : 0;
      right_s += v[1] > 0 ? dt : 0;
    }
  }
  return set;
}

Factor cosines(Covariate of, double high, std::uint32_t count, double warp) {
  Factor f;
  f.shape = Factor::Shape::kCosines;
  f.axis.of = of;
  f.high = high;
  f.count = count;
  f.warp = warp;
  return f;
}

Term unfitted(const std::string& name, std::vector<Block> blocks) {
  Eigen::Index columns = 0;
  for (const Block& block : blocks) columns += static_cast<Eigen::Index>(block.basis.size());
  return {name, std::move(blocks), Eigen::VectorXd::Zero(columns), Eigen::VectorXd::Constant(columns, 0.01)};
}

TEST(ShapeRefinement, EvidenceOfOneColumnHasAClosedForm) {
  const double information = 7, score = 3, sd = 0.8;
  const Eigen::MatrixXd i = Eigen::MatrixXd::Constant(1, 1, information);
  const double expected =
      0.5 * score * score / (information + 1 / (sd * sd)) - 0.5 * std::log(1 + sd * sd * information);
  EXPECT_NEAR(log_evidence(i, Eigen::VectorXd::Constant(1, score), Eigen::VectorXd::Constant(1, sd)), expected,
              1e-12);
}

TEST(ShapeRefinement, SmoothnessFollowsTheData) {
  // Twenty orthogonal columns; the first four have an effect.
  const Eigen::MatrixXd information = 400 * Eigen::MatrixXd::Identity(20, 20);
  ColumnGroup group;
  Eigen::VectorXd coefficients = Eigen::VectorXd::Zero(20);
  for (Eigen::Index k = 0; k < 20; ++k) {
    group.columns.push_back(k);
    group.roughness.push_back(static_cast<double>(k + 1));
    if (k < 4) coefficients[k] = 1;
  }
  std::vector<Smoothness> smoothness;
  Eigen::VectorXd sd;
  EXPECT_GT(choose_smoothness(information, information * coefficients, {group}, smoothness, sd), 500);
  EXPECT_GT(sd[0], 0.4);
  EXPECT_LT(sd[19], 0.05 * sd[0]);
  // No effect, nothing chosen.
  smoothness.clear();
  EXPECT_EQ(choose_smoothness(information, Eigen::VectorXd::Zero(20), {group}, smoothness, sd), 0);
  EXPECT_EQ(sd.maxCoeff(), 0);
}

TEST(ShapeRefinement, ASharpShapeIsRecovered) {
  TargetGroup acting;
  acting.gain = [](double s) { return s < 0.8 ? 0.4 : std::min(1.0, 0.4 + 0.5 * (s - 0.8)); };
  const MeasuredSet set = played(acting, 5, 8, 120);
  const Fitter fitter(set, 2);
  FitState state(set);
  MotionModel& model = state.model;
  fitter.fit_base(state);
  const double before = fitter.log_likelihood(state);
  model.terms.push_back(
      unfitted("start", {{Target::kGain, Basis{{cosines(Covariate::kSinceCommand, 10, 3, 1)}}, kDriven}}));
  fitter.fit(state, 2);
  const double coarse = fitter.log_likelihood(state);
  refine_curves(fitter, state, 0);
  EXPECT_GT(coarse, before + 100);
  EXPECT_GT(fitter.log_likelihood(state), coarse + 100);
  // Identifiable relative to later times.
  const auto gain_at = [&](double since_s) {
    Situation s;
    s.commands.command = Motion::kStraight;
    s.commands.since_s = since_s;
    return model.rates(s, Eigen::Vector2d::Zero()).left_gain;
  };
  const double late = gain_at(5);
  for (const double s : {0.4, 1.4, 2.5}) EXPECT_NEAR(gain_at(s) / late, acting.gain(s), 0.06) << s;
}

/// Speed by the time since the command, fitted as a free curve, then simplified.
MotionModel simplified(const TargetGroup& acting, std::uint64_t seed, bool& simpler) {
  const MeasuredSet set = played(acting, seed, 6, 100);
  const Fitter fitter(set, 2);
  FitState state(set);
  MotionModel& model = state.model;
  fitter.fit_base(state);
  model.terms.push_back(
      unfitted("start", {{Target::kGain, Basis{{cosines(Covariate::kSinceCommand, 10, 3, 1)}}, kDriven}}));
  fitter.fit(state, 2);
  refine_curves(fitter, state, 0);
  simpler = simplify(fitter, state, 0);
  return model;
}

TEST(Simplification, AnExponentialIsRecognised) {
  TargetGroup acting;
  acting.gain = [](double s) { return 1 - 0.6 * std::exp(-s / 1.5); };
  bool simpler = false;
  const MotionModel model = simplified(acting, 6, simpler);
  ASSERT_TRUE(simpler);
  const Term& term = model.terms[0];
  ASSERT_EQ(term.coefficients.size(), 1);
  const Factor& factor = term.blocks[0].basis.factors.front();
  ASSERT_EQ(factor.shape, Factor::Shape::kExponential);
  EXPECT_NEAR(factor.points[0], 1.5, 0.3);
  EXPECT_NEAR(term.coefficients[0], -0.6, 0.06);
}

TEST(Simplification, AStepIsRecognised) {
  TargetGroup acting;
  acting.gain = [](double s) { return s < 2.2 ? 0.6 : 1.0; };
  bool simpler = false;
  const MotionModel model = simplified(acting, 7, simpler);
  ASSERT_TRUE(simpler);
  const Factor& factor = model.terms[0].blocks[0].basis.factors.front();
  ASSERT_EQ(factor.shape, Factor::Shape::kAtLeast);
  EXPECT_NEAR(factor.points[0], 2.2, 0.15);
}

TEST(Simplification, ACurveWithoutSimpleFormStays) {
  TargetGroup acting;
  acting.gain = [](double s) { return 1 - 0.5 * std::exp(-(s - 2) * (s - 2)); };
  bool simpler = false;
  const MotionModel model = simplified(acting, 8, simpler);
  EXPECT_FALSE(simpler);
  EXPECT_GT(model.terms[0].coefficients.size(), 3);
}

/// A smooth curve over 80 s, fitted and refined.
void add_drift_by_time(const Fitter& fitter, FitState& state) {
  const Basis basis{{cosines(Covariate::kTime, 80, 8, 0)}};
  state.model.terms.push_back(
      unfitted("drift-by-time", {{Target::kWorldX, basis, kDriven}, {Target::kWorldY, basis, kDriven}}));
  fitter.fit(state, 2);
  refine_curves(fitter, state, 0);
}

TEST(ChangePoints, TheTimeOfAPulseIsRecovered) {
  TargetGroup acting;
  acting.drift_x_mm_s = [](double t) { return t >= 40.2 && t < 41 ? 15.0 : 0.0; };
  const MeasuredSet set = played(acting, 6, 8, 80);
  const Fitter fitter(set, 2);
  FitState state(set);
  MotionModel& model = state.model;
  fitter.fit_base(state);
  add_drift_by_time(fitter, state);
  EXPECT_EQ(find_change_points(fitter, state, 0), "drift-by-time");
  const Factor& steps = model.terms[0].blocks[0].basis.factors[0];
  ASSERT_EQ(steps.shape, Factor::Shape::kAtLeast);
  ASSERT_EQ(steps.points.size(), 2u);
  // The sampling interval is half a second.
  EXPECT_NEAR(steps.points[0], 40.2, 0.3);
  EXPECT_NEAR(steps.points[1], 41, 0.3);
  // The displacement is better determined than the speed.
  EXPECT_NEAR(model.terms[0].coefficients[0] * (steps.points[1] - steps.points[0]), 12, 1);
}

TEST(ShapeRefinement, StepsBecomeACurveOverTheWholeRun) {
  // A step that was found first, at 20 s. What follows at 60 s lies beyond twice its instant.
  TargetGroup acting;
  acting.drift_x_mm_s = [](double t) { return (t >= 20 ? 2.0 : 0.0) - (t >= 60 ? 3.0 : 0.0); };
  const MeasuredSet set = played(acting, 6, 8, 80);
  const Fitter fitter(set, 2);
  FitState state(set);
  fitter.fit_base(state);
  Factor step;
  step.shape = Factor::Shape::kAtLeast;
  step.axis.of = Covariate::kTime;
  step.high = 80;
  step.points = {20};
  state.model.terms.push_back(unfitted("drift-by-time", {{Target::kWorldX, Basis{{step}}, kDriven}}));
  fitter.fit(state, 2);
  refine_curves(fitter, state, 0);
  for (const auto& [time_s, drift_mm_s] : {std::pair{10.0, 0.0}, {40.0, 2.0}, {70.0, -1.0}}) {
    Situation s;
    s.time_s = time_s;
    s.commands.command = Motion::kStraight;
    EXPECT_NEAR(state.model.rates(s, {0, 0}).drift_x_mm_s, drift_mm_s, 0.4) << time_s;
  }
}

/// A curve over the motor-on time, fitted and refined.
void add_speed_by_motor_time(const Fitter& fitter, FitState& state, double longest_s) {
  const Basis basis{{cosines(Covariate::kMotorTime, longest_s, 8, 0)}};
  state.model.terms.push_back(unfitted("speed-by-motor-time", {{Target::kGain, basis, kDriven}}));
  fitter.fit(state, 2);
  refine_curves(fitter, state, 0);
}

/// An accepted effect of motor-on time before its refinement.
struct FoundInUse {
  FoundInUse(const TargetGroup& acting, std::uint64_t seed) : set(played(acting, seed, 8, 80)) {
    fitter.fit_base(state);
    add_speed_by_motor_time(fitter, state, 75);
  }
  MeasuredSet set;
  Fitter fitter{set, 2};
  FitState state{set};
};

TEST(ChangePoints, ASuddenChangeInMotorTimeIsAStep) {
  TargetGroup acting;
  acting.left = acting.right = [](double used_s) { return used_s < 35 ? 1.0 : 0.7; };
  FoundInUse found(acting, 9);
  EXPECT_EQ(find_change_points(found.fitter, found.state, 0), "speed-by-motor-time");
  const auto& blocks = found.state.model.terms[0].blocks;
  const Factor& steps = blocks.back().basis.factors[0];
  ASSERT_EQ(steps.shape, Factor::Shape::kAtLeast);
  EXPECT_EQ(steps.axis.of, Covariate::kMotorTime);
  EXPECT_TRUE(
      std::any_of(steps.points.begin(), steps.points.end(), [](double at_s) { return std::abs(at_s - 35) < 0.5; }));
}

// Biases absorb a mean over both wheels, but not that of the left wheels.
TEST(TargetExtension, AnEffectOfLeftWheelsIsNoBias) {
  TargetGroup acting;
  acting.left = [](double used_s) { return 1 - 0.4 * (1 - std::exp(-used_s / 20)); };
  FoundInUse found(acting, 10);
  extend_targets(found.fitter, found.state, 0);
  Situation at;
  at.commands.command = Motion::kStraight;
  const auto ratio = [&](double used_s) {
    at.commands.motor_s = {used_s, used_s};
    const Rates rates = found.state.model.rates(at, Eigen::Vector2d::Zero());
    return rates.left_gain / rates.right_gain;
  };
  for (const double used_s : {5.0, 20.0, 50.0}) EXPECT_NEAR(ratio(used_s), acting.left(used_s), 0.05) << used_s;
}

// A permanent shift equals a push. A temporary shift needs half as many steps as two pushes.
TEST(ChangePoints, ACameraShiftIsNoDrift) {
  TargetGroup acting;
  MeasuredSet set = played(acting, 7, 8, 80);
  for (Track& track : set.runs[0].tracks)
    for (Sample& s : track.samples)
      if (s.time_s >= 33.3 && s.time_s < 55.3) s.x_mm += 6;
  const Fitter fitter(set, 2);
  FitState state(set);
  MotionModel& model = state.model;
  fitter.fit_base(state);
  add_drift_by_time(fitter, state);
  EXPECT_EQ(find_change_points(fitter, state, 0), "camera-by-time");
  EXPECT_EQ(model.terms[0].blocks[0].target, Target::kMeasuredX);
  const Factor& steps = model.terms[0].blocks[0].basis.factors[0];
  double shift_mm = 0;
  for (std::size_t i = 0; i < steps.points.size(); ++i)
    if (steps.points[i] < 45) shift_mm += model.terms[0].coefficients[static_cast<Eigen::Index>(i)];
  EXPECT_NEAR(shift_mm, 6, 0.5);
}

TEST(NeighbourShape, RobotsThatStayApartOfferNoForm) {
  // Robots 3 m apart are no neighbours at any radius.
  const MeasuredSet set = played(TargetGroup{}, 11, 4, 40);
  const Fitter fitter(set, 1);
  FitState state(set);
  MotionModel& model = state.model;
  fitter.fit_base(state);
  Factor nearest;
  nearest.shape = Factor::Shape::kTaper;
  nearest.axis = {Covariate::kNearest, 3};
  nearest.high = kNeighbourRadii_mm[3];
  model.terms.push_back(unfitted("turn-by-neighbours", {{Target::kTurn, Basis{{nearest}}, kDriven}}));
  EXPECT_FALSE(refine_neighbour_shape(fitter, state, 0));
  EXPECT_EQ(model.terms.size(), 1U);
}

TEST(Amplitudes, OfOneCurveDifferBetweenRobots) {
  // Every other robot slows down; the mean over all is half of that.
  const double duration_s = 150;
  const auto tired = [&](double t) { return -0.5 * (t / duration_s) * (t / duration_s); };
  TargetGroup acting;
  acting.own_gain = [&](std::uint32_t robot, double t) { return 1 + (robot % 2 == 0 ? tired(t) : 0); };
  const std::uint32_t robots = 8;
  const MeasuredSet set = played(acting, 31, robots, duration_s);
  const Fitter fitter(set, 1);
  FitState state(set);
  MotionModel& model = state.model;
  model.contacts = false;
  const Basis curve{{cosines(Covariate::kTime, duration_s, 4, 0)}};
  model.terms.push_back(unfitted("speed-by-time", {{Target::kGain, curve}}));
  fitter.fit(state, 2);
  // A single term has no amplitudes.
  EXPECT_EQ(merge_amplitudes(fitter, state), std::nullopt);
  ASSERT_EQ(model.terms.size(), 1U);
  Factor known = curve.factors.front();
  known.known.assign(model.terms[0].coefficients.begin(), model.terms[0].coefficients.end());
  Factor each;
  each.shape = Factor::Shape::kTable;
  each.axis.of = Covariate::kRobot;
  for (std::uint32_t robot = 0; robot < robots; ++robot) each.points.push_back(robot);
  Term amplitudes = unfitted("speed-by-robot-and-time", {{Target::kGain, Basis{{each, known}}}});
  amplitudes.precision.setConstant(1);
  model.terms.push_back(amplitudes);
  fitter.fit(state, 2);
  const double as_two = fitter.log_likelihood(state);
  EXPECT_EQ(merge_amplitudes(fitter, state), 0U);
  ASSERT_EQ(model.terms.size(), 1U);
  EXPECT_EQ(model.terms[0].name, "speed-by-robot-and-time");
  EXPECT_GT(fitter.log_likelihood(state), as_two - 10);
  const Block& block = model.terms[0].blocks.front();
  const Factor& shown = block.basis.factors.front();
  ASSERT_EQ(shown.known.size(), robots);
  EXPECT_EQ(shown.plus, 1);  // amplitude of the mean robot and of an unseen one
  for (std::uint32_t robot = 0; robot < robots; ++robot)
    EXPECT_NEAR(shown.plus + shown.known[robot], robot % 2 == 0 ? 2 : 0, 0.25) << robot;
  std::vector<double> columns(kMostColumns);
  for (const double t : {20.0, 75.0, 130.0}) {
    // Biases absorb the mean of the curve.
    const auto effect_at = [&](double time_s) {
      Situation s;
      s.time_s = time_s;
      s.robot = 4;
      block.basis.evaluate(s, 0, columns.data());
      return model.terms[0].coefficients.dot(
          Eigen::Map<Eigen::VectorXd>(columns.data(), model.terms[0].coefficients.size()));
    };
    EXPECT_NEAR((1 + effect_at(t)) / (1 + effect_at(2)), (1 + tired(t)) / (1 + tired(2)), 0.04) << t;
  }
}

}  // namespace
}  // namespace kilotwin::identify
