// Model files equal fitted models: for every target and form of an effect, the engine and its tracker reproduce
// the fitted model.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "clients/identify/model/effect_records.hpp"
#include "clients/identify/model/model_file.hpp"
#include "clients/identify/replay/replay.hpp"
#include "core/random/random.hpp"

namespace kilotwin::identify {
namespace {

constexpr std::uint32_t kRobots = 6;
constexpr double kDuration_s = 20, kTick_s = 0.032768;
using Shape = Factor::Shape;

Factor over(Shape shape, Covariate of, double low, double high, std::uint32_t count,
            std::vector<double> points = {}) {
  Factor factor;
  factor.shape = shape;
  factor.axis.of = of;
  factor.axis.radius = 11;  // 150 mm
  factor.low = low;
  factor.high = high;
  factor.count = count;
  factor.points = std::move(points);
  return factor;
}

struct Form {
  std::string name;
  Basis basis;
};

// NOLINTNEXTLINE(readability-function-size): a table
std::vector<Form> forms() {
  Factor late = over(Shape::kCosines, Covariate::kSinceCommand, 0, 6, 4);
  late.warp = 1;
  Factor map = over(Shape::kCosines2, Covariate::kX, -300, 300, 3);
  map.and_axis.of = Covariate::kY;
  map.and_low = -250;
  map.and_high = 250;
  // Maps are compared where spline and bilinear interpolation agree: linear functions.
  Factor grid = map;
  grid.shape = Shape::kGrid;
  grid.count = 7;
  grid.points.clear();
  for (int j = 0; j < 5; ++j)
    for (int i = 0; i < 7; ++i) grid.points.push_back(0.2 * i - 0.1 * j + 0.02 * i * j);
  Factor lens = map;
  lens.shape = Shape::kPolynomials2;
  Factor bearing = over(Shape::kHarmonics, Covariate::kBearing, 0, 1, 1);
  const Factor previous = over(Shape::kTable, Covariate::kPreviousCommand, 0, 1, 1, {2, 3});
  Factor since = late;
  since.first = 0;
  const auto of_late = [](Covariate of, std::uint8_t decay_index) {
    Factor f = over(Shape::kLinear, of, 0, 5, 1);
    f.axis.decay_index = decay_index;
    return f;
  };
  Factor behind = over(Shape::kLevelling, Covariate::kDensity, 0, 1, 1, {0.3, 1});
  behind.axis.focus = 2;
  behind.axis.toward_deg = 150;
  Factor beside = over(Shape::kLinear, Covariate::kNeighbours, 0, 6, 1);
  beside.axis.focus = 1;
  beside.axis.toward_deg = -90;
  const auto within = [](Factor f, float radius_mm) {
    f.axis.within_mm = radius_mm;
    return f;
  };
  const auto among = [](Factor f, Others others, std::uint32_t robot) {
    f.axis.radius = 11;
    f.axis.others = others;
    f.axis.only_robot = robot == 0 ? 0 : robot + 1;
    return f;
  };
  Factor known = over(Shape::kCosines, Covariate::kTime, 0, 18, 3);
  known.known = {0.7, 0, -0.4};
  Factor amplitudes = over(Shape::kTable, Covariate::kRobot, 0, 1, 1, {3, 5});
  amplitudes.known = {0.6, -0.9};
  amplitudes.plus = 1;
  Factor switched = over(Shape::kAtLeast, Covariate::kTime, 0, 1, 1, {4, 9});
  switched.known = {0.8, -0.5};
  switched.plus = 0.3;
  Factor known_grid = grid;
  known_grid.known = {1};
  Factor travelling = over(Shape::kTravelling, Covariate::kX, 0, 1, 2, {0.012, -0.007, 0.3});
  travelling.and_axis.of = Covariate::kY;
  Factor whole_map = map;
  whole_map.first = 0;
  Factor of_time = over(Shape::kCosines, Covariate::kTime, 0, 18, 3);
  of_time.first = 0;
  Factor twice = over(Shape::kHarmonics, Covariate::kHeading, 0, 1, 1);
  twice.first = 2;
  Factor circles = over(Shape::kCosines, Covariate::kPointDistance, -60, 400, 4);
  circles.axis.point = {40, -30, 5, -2, 3};
  Factor along = over(Shape::kCosines, Covariate::kAlong, -250, 250, 3);
  along.axis.along_rad = 0.7;
  Factor growing = known;
  growing.plus = 0.5;
  return {
      {"constant", {}},
      {"linear in time", {{over(Shape::kLinear, Covariate::kTime, 0, 15, 1)}}},
      {"curve over time", {{over(Shape::kCosines, Covariate::kTime, 0, 18, 5)}}},
      {"curve since command", {{late}}},
      {"curve over x", {{over(Shape::kCosines, Covariate::kX, -250, 250, 3)}}},
      {"curve over y", {{over(Shape::kCosines, Covariate::kY, -250, 250, 3)}}},
      {"curve along a direction", {{along}}},
      {"curve over radius", {{over(Shape::kCosines, Covariate::kRadius, 0, 300, 3)}}},
      {"map", {{map}}},
      {"grid", {{grid}}},
      {"lens", {{lens}}},
      {"heading", {{over(Shape::kHarmonics, Covariate::kHeading, 0, 1, 1)}}},
      {"harmonics of heading", {{over(Shape::kHarmonics, Covariate::kHeading, 0, 1, 3)}}},
      {"command", {{over(Shape::kTable, Covariate::kCommand, 0, 1, 1, {1, 2, 3})}}},
      {"previous command", {{previous}}},
      {"previous lasted", {{over(Shape::kCosines, Covariate::kPreviousLasted, 0, 3, 3)}}},
      {"since rest", {{over(Shape::kCosines, Covariate::kSinceRest, 0, 8, 3)}}},
      {"difference of use", {{over(Shape::kCosines, Covariate::kMotorTimeDifference, -5, 5, 3)}}},
      {"last turn", {{over(Shape::kTable, Covariate::kLastTurn, 0, 1, 1, {2, 3})}}},
      {"robot", {{over(Shape::kTable, Covariate::kRobot, 0, 1, 1, {3, 5, 7, 9})}}},
      {"steps", {{over(Shape::kAtLeast, Covariate::kTime, 0, 1, 1, {4, 9})}}},
      {"exponential", {{over(Shape::kExponential, Covariate::kSinceCommand, 0, 1, 1, {1.5})}}},
      {"exponentials", {{over(Shape::kExponential, Covariate::kSinceCommand, 0, 1, 1, {0.5, 1.5, 5})}}},
      {"wave", {{over(Shape::kWave, Covariate::kTime, 0, 1, 1, {7})}}},
      {"own motor", {{over(Shape::kCosines, Covariate::kMotorTime, 0, 15, 3)}}},
      {"driven time", {{over(Shape::kLinear, Covariate::kDrivenTime, 0, 15, 1)}}},
      {"nearest", {{over(Shape::kTaper, Covariate::kNearest, 0, 150, 2)}}},
      {"count", {{over(Shape::kCosines, Covariate::kNeighbours, 0, 8, 2)}}},
      {"density", {{over(Shape::kCosines, Covariate::kDensity, 0, 4, 2)}}},
      {"density behind", {{behind}}},
      {"count beside", {{beside}}},
      {"density within a radius of its own", {{within(over(Shape::kCosines, Covariate::kDensity, 0, 4, 2), 95)}}},
      {"nearest within a radius of its own", {{within(over(Shape::kTaper, Covariate::kNearest, 0, 95, 2), 95)}}},
      {"steps of a motor's use", {{over(Shape::kAtLeast, Covariate::kMotorTime, 0, 1, 1, {4, 9})}}},
      {"bearing", {{over(Shape::kTaper, Covariate::kNearest, 0, 150, 1), bearing}}},
      {"history", {{previous, over(Shape::kExponential, Covariate::kSinceCommand, 0, 1, 1, {0.5, 1.5})}}},
      {"curves after turns", {{previous, since}}},
      {"own motor of late", {{of_late(Covariate::kMotorTime, 2)}}},
      {"left motor of late", {{of_late(Covariate::kLeftMotorTime, 2)}}},
      {"right motor", {{of_late(Covariate::kRightMotorTime, 0)}}},
      {"driven of late", {{of_late(Covariate::kDrivenTime, 3)}}},
      {"amounts of a curve", {{over(Shape::kTable, Covariate::kCommand, 0, 1, 1, {1, 2}), known}}},
      {"robots' known amounts of a curve", {{amplitudes, over(Shape::kCosines, Covariate::kTime, 0, 18, 4)}}},
      {"robots' known amounts of a constant", {{amplitudes}}},
      {"robots, steps and a map", {{amplitudes, switched, map}}},
      {"robots, steps and a grid", {{amplitudes, switched, grid}}},
      {"robots, a known grid and harmonics",
       {{amplitudes, known_grid, over(Shape::kHarmonics, Covariate::kHeading, 0, 1, 2)}}},
      {"a step of robots times a map", {{over(Shape::kAtLeast, Covariate::kTime, 0, 1, 1, {7}), amplitudes, map}}},
      {"a known curve times harmonics", {{growing, over(Shape::kHarmonics, Covariate::kHeading, 0, 1, 3)}}},
      {"travelling wave", {{travelling}}},
      {"robots' own travelling waves", {{over(Shape::kTable, Covariate::kRobot, 0, 1, 1, {3, 5}), travelling}}},
      {"map over time", {{of_time, whole_map}}},
      {"map of bent headings", {{lens, twice}}},
      {"commands and what is left of the one before",
       {{previous, over(Shape::kExponential, Covariate::kSinceCommand, 0, 1, 1, {0.4, 1.2, 3.6})}}},
      {"robots in time",
       {{over(Shape::kTable, Covariate::kRobot, 0, 1, 1, {3, 5}),
         over(Shape::kLinear, Covariate::kTime, 0, 15, 1)}}},
      {"earlier turn", {{over(Shape::kTable, Covariate::kEarlierTurn, 0, 1, 1, {2, 3})}}},
      {"number of commands", {{over(Shape::kCosines, Covariate::kCommandCount, 0, 9, 4)}}},
      {"sum of use", {{over(Shape::kCosines, Covariate::kMotorTimeSum, 0, 20, 3)}}},
      {"density of driven others",
       {{among(over(Shape::kCosines, Covariate::kDensity, 0, 4, 2), Others::kDriven, 0)}}},
      {"density of others at rest",
       {{among(over(Shape::kCosines, Covariate::kDensity, 0, 4, 2), Others::kResting, 0)}}},
      {"distance of one robot", {{among(over(Shape::kTaper, Covariate::kNearest, 0, 150, 2), Others::kAny, 5)}}},
      {"distance of one driven robot",
       {{among(over(Shape::kTaper, Covariate::kNearest, 0, 150, 2), Others::kDriven, 7)}}},
      {"distance from a moving centre", {{circles}}}};
}

const char* name_of(Target target) {
  constexpr const char* kNames[] = {"gain",         "gain left",  "gain right",      "offset",     "offset left",
                                    "offset right", "turn",       "ahead",           "sideways",   "world x",
                                    "world y",      "measured x", "measured y",      "body ahead", "body left",
                                    "scale",        "picture",    "measured heading"};
  return kNames[static_cast<std::size_t>(target)];
}

/// A typical size of an effect on this target.
double size_of(Target target) {
  switch (target) {
    case Target::kGain:
    case Target::kGainLeft:
    case Target::kGainRight: return 0.15;
    case Target::kTurn: return 0.05;
    case Target::kMeasuredScale:
    case Target::kMeasuredTurn: return 0.02;
    case Target::kMeasuredHeading: return 0.1;
    case Target::kMeasuredX:
    case Target::kMeasuredY:
    case Target::kMeasuredAhead:
    case Target::kMeasuredLeft: return 4;
    default: return 1.5;
  }
}

static_assert(kNeighbourRadii_mm[11] == 150);

class WrittenModelTest : public testing::Test {
 protected:
  WrittenModelTest() {
    const Random random(8);
    set_.has_commands = set_.has_headings = true;
    set_.runs.push_back({"r", {}});
    model_.base.ahead_mm = 6;
    model_.base.left_mm = 1;
    model_.base.centre_mm = 8;
    model_.noise = {0, 0, 0, 0, 0, 0};
    for (std::uint32_t robot = 0; robot < kRobots; ++robot) {
      Track& track = set_.runs[0].tracks.emplace_back();
      track.robot = 3 + 2 * robot;
      track.commands.push_back({-1e300, Motion::kStop});
      // Commands change at tick boundaries, since the engine knows no other times.
      std::int64_t tick = 0;
      for (std::uint32_t i = 0; static_cast<double>(tick) * kTick_s < kDuration_s; ++i) {
        const auto motion = static_cast<Motion>((i + robot) % 4 == 3 ? 0 : 1 + (i * (robot + 1)) % 3);
        if (motion != track.commands.back().motion)
          track.commands.push_back({static_cast<double>(tick) * kTick_s, motion});
        tick += 40 + static_cast<std::int64_t>(60 * random.uniform(Stream::kLayout, robot, Tick{0}, i));
      }
      const double x = 75.0 * (robot % 3) - 75, y = 75.0 * (robot / 3);
      for (double t = 0; t < kDuration_s; t += 2) track.samples.push_back({t, x, y, 0.9 * robot});
      RobotBias& bias = model_.robots[track.robot];
      bias.mean_mm_s = {0.4 * robot - 1, 0.8 - 0.3 * robot};
    }
    model_.contacts = false;
  }

  /// Measured positions by the fitted model, tick by tick.
  [[nodiscard]] std::vector<std::vector<Sample>> expected(const Scene& scene) const {
    struct State {
      double x, y, heading;
    };
    std::vector<State> states;
    std::vector<CommandClock> clocks;
    for (const Scene::Robot& robot : scene.robots) {
      const double c = model_.base.centre_mm;
      states.push_back({robot.x_mm - c * std::cos(robot.heading_rad), robot.y_mm - c * std::sin(robot.heading_rad),
                        robot.heading_rad});
      clocks.emplace_back(*robot.track);
    }
    std::vector<std::vector<Sample>> out(states.size());
    const auto situations = [&](double time_s, double within_s) {
      std::vector<double> x, y;
      for (const State& s : states) {
        x.push_back(s.x + model_.base.centre_mm * std::cos(s.heading));
        y.push_back(s.y + model_.base.centre_mm * std::sin(s.heading));
      }
      std::vector<Situation> all(states.size());
      std::vector<Neighbour> who;
      for (std::size_t r = 0; r < states.size(); ++r)
        who.push_back({scene.robots[r].track->robot, clocks[r].at(time_s + within_s).driven()});
      list_.clear();
      for (std::size_t r = 0; r < states.size(); ++r) {
        all[r] = {time_s,
                  x[r],
                  y[r],
                  wrapped_angle(states[r].heading),
                  clocks[r].at(time_s + within_s),
                  view_of(r, x, y, &list_, who),
                  scene.robots[r].track->robot,
                  0};
        // At the start of a tick, motor-on times exclude this tick.
        all[r].commands.since_s = std::max(0.0, all[r].commands.since_s - within_s);
      }
      return all;
    };
    std::vector<std::size_t> next(states.size(), 0);
    for (int tick = 0; tick * kTick_s < kDuration_s; ++tick) {
      const double now_s = tick * kTick_s;
      const std::vector<Situation> all = situations(now_s, 1e-6);
      const std::vector<State> before = states;
      for (std::size_t r = 0; r < states.size(); ++r) {
        const Rates rates = model_.rates(all[r], model_.bias_of(scene.robots[r].track->robot).mean_mm_s);
        const Arc arc = arc_of(rates, model_.base.wheel_base_mm, states[r].heading, kTick_s);
        states[r] = {states[r].x + arc.dx_mm, states[r].y + arc.dy_mm, states[r].heading + arc.dheading_rad};
      }
      for (std::size_t r = 0; r < states.size(); ++r) {
        const std::vector<Sample>& samples = scene.robots[r].track->samples;
        while (next[r] < samples.size() && samples[next[r]].time_s < now_s + kTick_s) {
          const double part = (samples[next[r]].time_s - now_s) / kTick_s;
          const auto between = [&](double State::*v) {
            return before[r].*v + part * (states[r].*v - before[r].*v);
          };
          const Eigen::Vector3d seen =
              model_.measured(between(&State::x), between(&State::y), between(&State::heading), all[r]);
          out[r].push_back({samples[next[r]++].time_s, seen[0], seen[1], wrapped_angle(seen[2])});
        }
      }
    }
    return out;
  }

  MeasuredSet set_;
  MotionModel model_;
  mutable std::vector<OtherRobot> list_;  ///< neighbours at one instant
};

/// The place of a target among the draws: offsets of single wheels come last, so that they change no draw of the others.
std::uint32_t place_of_draws(Target target) {
  const auto place = static_cast<std::uint32_t>(target);
  constexpr auto kFirstLate = static_cast<std::uint32_t>(Target::kOffsetLeft), kLate = 2U,
                 kAll = static_cast<std::uint32_t>(Target::kMeasuredHeading) + 1;
  if (place < kFirstLate) return place;
  return place < kFirstLate + kLate ? kAll - kLate + place - kFirstLate : place - kLate;
}

TEST_F(WrittenModelTest, PredictsLikeTheFittedModel) {
  const Random random(31);
  // Forms beyond these share draws with another target, so that a new form at the end changes no draw of the others: a count of
  // neighbours that jumps where robots cross the radius agrees only if no robot crosses it near a sample.
  constexpr std::uint32_t kFormsWithOwnDraws = 50;
  for (int t = 0; t <= static_cast<int>(Target::kMeasuredHeading); ++t) {
    const auto target = static_cast<Target>(t);
    std::uint32_t combination = place_of_draws(target) * kFormsWithOwnDraws;
    for (const Form& form : forms()) {
      ++combination;
      Term term{"effect", {{target, form.basis, is_measured(target) ? kAlways : kDriven}}, {}, {}};
      const auto n = static_cast<Eigen::Index>(form.basis.size());
      term.coefficients = term.precision = Eigen::VectorXd::Ones(n);
      for (Eigen::Index i = 0; i < n; ++i) {
        term.coefficients[i] = size_of(target) / std::sqrt(static_cast<double>(n)) *
                               random.normal(Stream::kLayout, combination, Tick{0}, static_cast<std::uint32_t>(i));
      }
      model_.terms = {term};
      PreparedSet prepared(set_);
      prepared.find_headings(model_, 1);
      const Scene scene = scene_of(model_, prepared, 0);
      const auto seen = play(scene, proto_of(model_), 1);
      const auto should = expected(scene);
      double most_mm = 0, most_rad = 0;
      for (std::size_t r = 0; r < seen.size(); ++r) {
        ASSERT_EQ(seen[r].size(), should[r].size());
        for (std::size_t i = 0; i < seen[r].size(); ++i) {
          most_mm = std::max(most_mm,
                             std::hypot(seen[r][i].x_mm - should[r][i].x_mm, seen[r][i].y_mm - should[r][i].y_mm));
          most_rad = std::max(most_rad, std::abs(wrapped_angle(seen[r][i].heading_rad - should[r][i].heading_rad)));
        }
      }
      EXPECT_LT(most_mm, 0.15) << name_of(target) << " by " << form.name;
      EXPECT_LT(most_rad, 0.005) << name_of(target) << " by " << form.name;
    }
  }
}

TEST(WrittenModelFile, GainsOfTwoTermsOfOneNameMultiply) {
  // A product of a curve over time and harmonics of the heading, twice.
  Term term;
  term.name = "speed-by-heading-and-time";
  Factor time = over(Shape::kCosines, Covariate::kTime, 0, 20, 2),
         heading = over(Shape::kHarmonics, Covariate::kHeading, 0, 1, 1);
  term.blocks = {{Target::kGain, Basis{{time, heading}}}};
  term.coefficients = term.precision = Eigen::VectorXd::Constant(4, 0.1);
  MotionModel model;
  model.terms = {term, term};
  std::map<std::string, int> sums;
  const proto::Model written = proto_of(model);
  for (const proto::Effect& effect : written.effect())
    if (effect.acts_on() == proto::Effect::WHEEL_GAIN) ++sums[effect.sum()];
  ASSERT_EQ(sums.size(), 2U);
  EXPECT_EQ(sums.begin()->second, sums.rbegin()->second);
}

TEST(WrittenModelFile, TheDiscCentreIsWithinTheBody) {
  MotionModel model;
  model.base.centre_mm = model.base.ahead_mm = 30;
  const proto::Model written = proto_of(model);
  EXPECT_EQ(written.motion().axle_offset_mm(), 16.5);
  // The tracked point stays where it is.
  const auto point = std::find_if(written.effect().begin(), written.effect().end(),
                                  [](const proto::Effect& e) { return e.name() == "tracked-point"; });
  ASSERT_NE(point, written.effect().end());
  EXPECT_NEAR(point->function(0).constant(), 13.5, 1e-6);
}

}  // namespace
}  // namespace kilotwin::identify
