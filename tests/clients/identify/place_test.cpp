// Effects of position, neighbours and traffic are recovered in their shape: sharp edges, neighbourhood radii,
// traffic cells.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "clients/identify/model/effect_records.hpp"
#include "clients/identify/model/model_file.hpp"
#include "clients/identify/search/floor_parts.hpp"
#include "clients/identify/search/moving_circles.hpp"
#include "clients/identify/search/neighbour_shape.hpp"
#include "clients/identify/search/products.hpp"
#include "clients/identify/search/shape_refinement.hpp"
#include "clients/identify/search/total_variation_map.hpp"
#include "clients/identify/search/traffic_shape.hpp"
#include "core/random/random.hpp"

namespace kilotwin::identify {
namespace {

using Shape = Factor::Shape;
/// Differs from all initial grids.
const GridCells kCells{43, 15, -12};

/// Covariates of a robot's speed in these tests.
struct Around {
  std::size_t robot;
  const std::vector<double>&x_mm, &y_mm;  ///< of all robots
  double traffic;                         ///< driven time in its cell, s, or freshness of a trail
  double heading_rad;
};
using Gain = std::function<double(const Around&)>;
/// Neighbours within a radius: distance and cosine of the bearing of each.
double sum_of_others(const Around& a, double radius_mm, const std::function<double(double, double)>& each) {
  double sum = 0;
  for (std::size_t i = 0; i < a.x_mm.size(); ++i) {
    const double x = a.x_mm[i] - a.x_mm[a.robot], y = a.y_mm[i] - a.y_mm[a.robot], d = std::hypot(x, y);
    if (i != a.robot && d < radius_mm)
      sum += each(d, d > 0 ? (x * std::cos(a.heading_rad) + y * std::sin(a.heading_rad)) / d : 0);
  }
  return sum;
}

/// Robots without mutual collisions, simulated with arcs of 50 ms.
MeasuredSet played(const Gain& gain, std::uint64_t seed, std::uint32_t robots, double duration_s,
                   const GridCells& cells = kCells) {
  const Random random(seed);
  const double dt = 0.05, factor_s = 0.001, tracker_mm = 0.3, tracker_rad = 0.03;
  MeasuredSet set;
  set.has_commands = set.has_headings = true;
  Run& run = set.runs.emplace_back();
  run.name = "r";
  run.tracks.resize(robots);
  std::vector<double> x(robots), y(robots), heading(robots), next_s(robots, 0), disc_x(robots), disc_y(robots);
  for (std::uint32_t r = 0; r < robots; ++r) {
    run.tracks[r].robot = r;
    run.tracks[r].commands.push_back({-1e300, Motion::kStop});
    x[r] = 90.0 * (r % 4) - 135;
    y[r] = 90.0 * (r / 4) - 90;
    heading[r] = 1.7 * r;
  }
  TrafficGrid traffic(cells);
  for (int k = 0; k * dt <= duration_s; ++k) {
    const double t = k * dt;
    for (std::uint32_t r = 0; r < robots; ++r) {
      disc_x[r] = x[r] + kAxleOffset_mm * std::cos(heading[r]);
      disc_y[r] = y[r] + kAxleOffset_mm * std::sin(heading[r]);
    }
    for (std::uint32_t r = 0; r < robots; ++r) {
      Track& track = run.tracks[r];
      const auto noise = [&](Stream stream, std::uint32_t draw) { return random.normal(stream, r, Tick{k}, draw); };
      if (k % 10 == 0)
        track.samples.push_back({t, disc_x[r] + tracker_mm * noise(Stream::kMeasurementNoise, 0),
                                 disc_y[r] + tracker_mm * noise(Stream::kMeasurementNoise, 1),
                                 wrapped_angle(heading[r] + tracker_rad * noise(Stream::kMeasurementNoise, 2))});
      if (t >= next_s[r] - 1e-9) {
        const bool straight = track.commands.back().motion != Motion::kStraight;
        const double draw = random.uniform(Stream::kLayout, r, Tick{k}, 0);
        track.commands.push_back({t, straight ? Motion::kStraight : draw < 0.5 ? Motion::kLeft : Motion::kRight});
        next_s[r] = t + (straight ? 3 + 6 * draw : 1 + 2 * draw);
      }
      const double speed = gain({r, disc_x, disc_y, traffic.value(r, disc_x[r], disc_y[r], t), heading[r]});
      const Eigen::Vector2d v = speed * nominal_speeds(BaseParameters{}, track.commands.back().motion);
      const double sd = std::sqrt(factor_s / dt);
      Rates rates;
      rates.left_mm_s = v[0] * (1 + sd * noise(Stream::kWheelFactor, 0));
      rates.right_mm_s = v[1] * (1 + sd * noise(Stream::kWheelFactor, 1));
      const Arc arc = arc_of(rates, 25, heading[r], dt);
      x[r] += arc.dx_mm;
      y[r] += arc.dy_mm;
      heading[r] += arc.dheading_rad;
    }
    for (std::uint32_t r = 0; r < robots; ++r) traffic.add(r, disc_x[r], disc_y[r], dt, t);
  }
  return set;
}

Term unfitted(Factor factor) {
  const Basis basis{{std::move(factor)}};
  const auto columns = static_cast<Eigen::Index>(basis.size());
  return {"effect",
          {{Target::kGain, basis, kDriven}},
          Eigen::VectorXd::Zero(columns),
          Eigen::VectorXd::Constant(columns, 1)};
}

/// The fitted model without effects and without contacts.
FitState fitted(const Fitter& fitter, const MeasuredSet& set) {
  FitState state(set);
  state.model.contacts = false;
  fitter.fit(state, 2);
  return state;
}

double gain_of(const MotionModel& model, const Situation& s) { return model.rates(s, {0, 0}).left_gain; }

Situation driven_at(double x_mm, double y_mm) {
  Situation s;
  s.x_mm = x_mm;
  s.y_mm = y_mm;
  s.commands.command = Motion::kStraight;
  return s;
}

Factor map_of_the_floor(std::uint32_t order) {
  Factor map;
  map.shape = Shape::kCosines2;
  map.axis.of = Covariate::kX;
  map.and_axis.of = Covariate::kY;
  map.low = map.and_low = -300;
  map.high = map.and_high = 300;
  map.count = order;
  return map;
}

TEST(Place, AnEdgeOfTheFloorStaysSharp) {
  // Half of the floor is slow; the edge is oblique.
  const auto side = [](double x, double y) { return x + 0.5 * y - 15; };
  const MeasuredSet set =
      played([&](const Around& a) { return side(a.x_mm[a.robot], a.y_mm[a.robot]) > 0 ? 0.5 : 1.0; }, 5, 12, 300);
  const Fitter fitter(set, 2);
  FitState state = fitted(fitter, set);
  MotionModel& model = state.model;
  model.terms.push_back(unfitted(map_of_the_floor(5)));
  fitter.fit(state, 2);
  const double smooth = fitter.log_likelihood(state);
  fit_total_variation_map(fitter, state, 0);
  EXPECT_GT(fitter.log_likelihood(state), smooth + 50);
  // At 25 mm from the edge the map has its plateau values on both sides.
  const double along = std::hypot(1, 0.5);
  for (const double y : {-60.0, 0.0, 60.0}) {
    const double edge = 15 - 0.5 * y;
    const double fast = gain_of(model, driven_at(edge - 25 * along, y)),
                 slow = gain_of(model, driven_at(edge + 25 * along, y));
    EXPECT_NEAR(slow / fast, 0.5, 0.1) << y;
  }
}

TEST(Place, ASmoothMapStaysSmooth) {
  const MeasuredSet set = played([](const Around& a) { return 1 + 0.001 * a.x_mm[a.robot]; }, 6, 12, 150);
  const Fitter fitter(set, 2);
  FitState state = fitted(fitter, set);
  MotionModel& model = state.model;
  model.terms.push_back(unfitted(map_of_the_floor(3)));
  fitter.fit(state, 2);
  fit_total_variation_map(fitter, state, 0);
  EXPECT_EQ(model.terms[0].blocks.front().basis.factors.front().shape, Shape::kCosines2);
}

/// A search that ended with a map of the floor.
Search search_with_map(const Fitter& fitter, const MeasuredSet& set, std::uint32_t order) {
  FitState state = fitted(fitter, set);
  state.model.terms.push_back(unfitted(map_of_the_floor(order)));
  fitter.fit(state, 2);
  fit_total_variation_map(fitter, state, 0);
  Search found{state, {{}}, {{state, {{}}}}, {}, {}, {}, {}};
  return found;
}

TEST(Place, PatchesOfTheFloorBecomeCircles) {
  constexpr double kX_mm[] = {-90, 110}, kY_mm[] = {-20, 50}, kRadius_mm[] = {70, 90}, kGain[] = {0.45, 0.7};
  const auto distance = [&](int k, double x, double y) { return std::hypot(x - kX_mm[k], y - kY_mm[k]); };
  const auto gain = [&](double x, double y) {
    for (int k = 0; k < 2; ++k)
      if (distance(k, x, y) < kRadius_mm[k]) return kGain[k];
    return 1.0;
  };
  const MeasuredSet set =
      played([&](const Around& a) { return gain(a.x_mm[a.robot], a.y_mm[a.robot]); }, 5, 12, 200);
  const Fitter fitter(set, 2);
  Search found = search_with_map(fitter, set, 5);
  fit_floor_parts(fitter, found);
  ASSERT_TRUE(found.with_curves);
  EXPECT_NE(found.with_curves->fit.model.terms[0].blocks.front().basis.factors.front().axis.of,
            Covariate::kPointDistance);
  const std::vector<Block>& blocks = found.fit.model.terms[0].blocks;
  ASSERT_EQ(blocks.size(), 2U);
  for (const Block& block : blocks) {
    const Factor& edge = block.basis.factors.front();
    ASSERT_EQ(edge.axis.of, Covariate::kPointDistance);
    ASSERT_EQ(edge.shape, Shape::kAtLeast);
    const int k = edge.axis.point.x_mm < 0 ? 0 : 1;
    EXPECT_LT(distance(k, edge.axis.point.x_mm, edge.axis.point.y_mm), 5) << k;
    EXPECT_NEAR(edge.points.front(), kRadius_mm[k], 5) << k;
  }
  const double open = gain_of(found.fit.model, driven_at(0, -150));
  for (int k = 0; k < 2; ++k)
    EXPECT_NEAR(gain_of(found.fit.model, driven_at(kX_mm[k], kY_mm[k])) / open, kGain[k], 0.03) << k;
}

/// The angle between two directions without a sense, rad.
double between(double a_rad, double b_rad) { return std::abs(std::remainder(a_rad - b_rad, M_PI)); }

TEST(Place, ASlopeOfTheFloorIsACurveAlongADirection) {
  const double toward_rad = 0.5;
  const auto gain = [&](double x, double y) {
    return 1 + 0.002 * (std::cos(toward_rad) * x + std::sin(toward_rad) * y);
  };
  const MeasuredSet set =
      played([&](const Around& a) { return gain(a.x_mm[a.robot], a.y_mm[a.robot]); }, 6, 12, 150);
  const Fitter fitter(set, 2);
  Search found = search_with_map(fitter, set, 3);
  fit_floor_parts(fitter, found);
  ASSERT_TRUE(found.with_curves);
  const std::vector<Block>& blocks = found.fit.model.terms[0].blocks;
  ASSERT_EQ(blocks.size(), 1U);
  const Factor& curve = blocks.front().basis.factors.front();
  ASSERT_EQ(curve.axis.of, Covariate::kAlong);
  EXPECT_EQ(curve.shape, Shape::kCosines);
  EXPECT_LT(between(curve.axis.along_rad, toward_rad), 0.06);
  const double middle = gain_of(found.fit.model, driven_at(0, 0));
  for (const auto& [x, y] : {std::pair{120.0, 0.0}, {-120.0, 60.0}, {0.0, 120.0}})
    EXPECT_NEAR(gain_of(found.fit.model, driven_at(x, y)) / middle, gain(x, y), 0.03) << x << ' ' << y;
}

TEST(Place, TheBorderOfTwoFloorsIsAStepAlongADirection) {
  const MeasuredSet set =
      played([](const Around& a) { return a.x_mm[a.robot] + 0.5 * a.y_mm[a.robot] < 15 ? 1.0 : 0.5; }, 4, 12, 150);
  const Fitter fitter(set, 2);
  Search found = search_with_map(fitter, set, 5);
  // The search may have found something else that resembles it: a large circle that moves.
  Search with_circle = found;
  Axis about{Covariate::kPointDistance};
  about.point = {-500, -250, 1, 0.5, 1};
  const Factor curve = curve_over(found.fit, about, 16);
  with_circle.fit.model.terms = {unfitted(curve)};
  with_circle.fit.model.terms[0].name = "speed-by-position-and-time";
  fitter.fit(with_circle.fit, 4);
  for (Search* const one : {&found, &with_circle}) {
    fit_floor_parts(fitter, *one);
    const Term& term = one->fit.model.terms[0];
    if (one == &with_circle) {
      EXPECT_EQ(term.name, "speed-by-position");
      EXPECT_EQ(one->reasons[0].covariates, std::vector<std::string>{"position"});
    }
    ASSERT_EQ(term.blocks.size(), 1U);
    const Factor& edge = term.blocks.front().basis.factors.front();
    ASSERT_EQ(edge.axis.of, Covariate::kAlong);
    ASSERT_EQ(edge.shape, Shape::kAtLeast);
    EXPECT_LT(between(edge.axis.along_rad, std::atan2(0.5, 1)), 0.03);
    EXPECT_NEAR(std::abs(edge.points.front()), 15 / std::hypot(1, 0.5), 4);
    EXPECT_NEAR(gain_of(one->fit.model, driven_at(120, 0)) / gain_of(one->fit.model, driven_at(-120, 0)), 0.5,
                0.03);
  }
}

TEST(Place, APeakBesideABorderIsADiscAndAStep) {
  const auto gain = [](double x, double y) {
    return (x < -60 ? 0.5 : 1) * (1 + 0.3 * std::exp(-(std::pow(x - 60, 2) + std::pow(y - 20, 2)) / 8000));
  };
  const MeasuredSet set =
      played([&](const Around& a) { return gain(a.x_mm[a.robot], a.y_mm[a.robot]); }, 5, 12, 200);
  const Fitter fitter(set, 2);
  Search found = search_with_map(fitter, set, 5);
  fit_floor_parts(fitter, found);
  ASSERT_TRUE(found.with_curves);
  std::vector<Covariate> of;
  for (const Block& block : found.fit.model.terms[0].blocks) of.push_back(block.basis.factors.front().axis.of);
  EXPECT_NE(std::find(of.begin(), of.end(), Covariate::kAlong), of.end());
  EXPECT_NE(std::find(of.begin(), of.end(), Covariate::kPointDistance), of.end());
  const double open = gain_of(found.fit.model, driven_at(0, -150));
  for (const auto& [x, y] : {std::pair{60.0, 20.0}, {-100.0, 20.0}, {-80.0, -80.0}, {110.0, 70.0}})
    EXPECT_NEAR(gain_of(found.fit.model, driven_at(x, y)) / open, gain(x, y) / gain(0, -150), 0.05)
        << x << ' ' << y;
}

TEST(Place, TablesOfProductsGetTheValuesOfAllRobots) {
  // Robots with even numbers are slow on one side. The model was fitted without robots 4 and 5, and takes them for slow.
  const MeasuredSet set =
      played([](const Around& a) { return a.robot % 2 == 0 && a.x_mm[a.robot] > 0 ? 0.5 : 1.0; }, 12, 8, 300);
  const Fitter fitter(set, 2);
  FitState state = fitted(fitter, set);
  Factor table, side;
  table.shape = Shape::kTable;
  table.axis.of = Covariate::kRobot;
  table.points = {0, 1, 2, 3, 6, 7};
  table.known = {1, -1, 1, -1, 1, -1};
  table.plus = 1;
  side.shape = Shape::kAtLeast;
  side.axis.of = Covariate::kX;
  side.points = {0};
  Term term = unfitted(side);
  term.blocks.front().basis.factors.insert(term.blocks.front().basis.factors.begin(), table);
  state.model.terms.push_back(term);
  fitter.fit(state, 2);
  refit_tables(fitter, state);
  const auto gain = [&](std::uint32_t robot, double x_mm) {
    Situation s = driven_at(x_mm, 0);
    s.robot = robot;
    return gain_of(state.model, s);
  };
  // Robot 4 never gets there: it has the mean of the seven others.
  for (const Sample& sample : set.runs[0].tracks[4].samples) ASSERT_LT(sample.x_mm, 0);
  for (std::uint32_t robot = 0; robot < 8; ++robot)
    EXPECT_NEAR(gain(robot, 60) / gain(robot, -60),
                robot == 4       ? 1 - 0.5 * 3 / 7
                : robot % 2 == 0 ? 0.5
                                 : 1,
                0.06)
        << robot;
}

TEST(Place, TheNeighbourhoodRadiusIsRecovered) {
  const MeasuredSet set = played(
      [](const Around& a) {
        int count = 0;
        for (std::size_t i = 0; i < a.x_mm.size(); ++i)
          if (i != a.robot && std::hypot(a.x_mm[i] - a.x_mm[a.robot], a.y_mm[i] - a.y_mm[a.robot]) < 110) ++count;
        return 1 - 0.2 * std::min(count, 2);
      },
      7, 12, 200);
  const Fitter fitter(set, 2);
  FitState state = fitted(fitter, set);
  MotionModel& model = state.model;
  Factor density;
  density.shape = Shape::kCosines;
  density.axis = {Covariate::kDensity, 6};
  density.high = 4;
  density.count = 3;
  model.terms.push_back(unfitted(density));
  fitter.fit(state, 2);
  ASSERT_TRUE(refine_neighbour_shape(fitter, state, 0));
  const auto gain = [&](std::initializer_list<double> x_mm) {
    std::vector<double> x{0}, y(x_mm.size() + 1, 0);
    x.insert(x.end(), x_mm);
    Situation s = driven_at(0, 0);
    s.near = view_of(0, x, y);
    return gain_of(model, s);
  };
  const double alone = gain({});
  EXPECT_NEAR(gain({125}) / alone, 1, 0.05);
  EXPECT_NEAR(gain({95}) / alone, 0.8, 0.05);
  EXPECT_NEAR(gain({70}) / alone, 0.8, 0.05);
  EXPECT_NEAR(gain({70, -95}) / alone, 0.6, 0.05);
  EXPECT_NEAR(gain({70, -95, 80}) / alone, 0.6, 0.07);
}

TEST(Place, TheDirectionOfNeighboursIsRecovered) {
  // Slow behind any number of robots ahead. The nearest alone explains a part only.
  const MeasuredSet set = played(
      [](const Around& a) {
        return 1 / (1 + 0.7 * sum_of_others(a, 110, [](double, double cosine) { return std::max(0.0, cosine); }));
      },
      11, 12, 160);
  const Fitter fitter(set, 2);
  FitState state = fitted(fitter, set);
  MotionModel& model = state.model;
  Factor near;
  near.shape = Shape::kTaper;
  near.axis = {Covariate::kNearest, 6};
  near.high = 100;
  near.count = 3;
  model.terms.push_back(unfitted(near));
  fitter.fit(state, 2);
  ASSERT_TRUE(refine_neighbour_shape(fitter, state, 0));
  std::vector<OtherRobot> list;
  const auto gain = [&](std::initializer_list<double> x_mm, double heading_rad) {
    std::vector<double> x{0}, y(x_mm.size() + 1, 0);
    x.insert(x.end(), x_mm);
    Situation s = driven_at(0, 0);
    s.heading_rad = heading_rad;
    s.near = view_of(0, x, y, &list);
    return model.rates(s, {0, 0}).forward_mm_s();
  };
  const double alone = gain({}, 0);
  EXPECT_NEAR(gain({80}, 0) / alone, 1 / 1.7, 0.06);
  EXPECT_NEAR(gain({-80}, 0) / alone, 1, 0.06);
  EXPECT_NEAR(gain({80}, M_PI / 2) / alone, 1, 0.08);
  EXPECT_NEAR(gain({-60, 80}, 0) / alone, 1 / 1.7, 0.08);
  EXPECT_NEAR(gain({60, 90}, 0) / alone, 1 / 2.4, 0.06);
}

TEST(Place, TrafficCountsPerCell) {
  TrafficGrid traffic({30, 0, 0});
  traffic.add(0, 31, -1, 2);
  traffic.add(0, 59, -29, 0.5);
  EXPECT_FLOAT_EQ(traffic.value(0, 45, -15), 2.5F);
  EXPECT_FLOAT_EQ(traffic.value(0, 29, -15), 0);
  EXPECT_FLOAT_EQ(traffic.value(0, 45, 1), 0);
  // Positions far outside share one cell.
  traffic.add(0, 1e6, 1e6, 1);
  EXPECT_FLOAT_EQ(traffic.value(0, 2e6, 3e6), 1);
  // Another corner.
  TrafficGrid moved({30, 10, -5});
  moved.add(0, 11, -4, 1);
  EXPECT_FLOAT_EQ(moved.value(0, 39, 24), 1);
  EXPECT_FLOAT_EQ(moved.value(0, 9, 24), 0);
}

TEST(Place, TrailsAreThoseOfOthersInAnyOrder) {
  // Robots 1, 2 and 3 passed at 2, 5 and 3 s.
  const std::array<std::pair<std::size_t, double>, 4> passages = {{{1, 2}, {2, 5}, {3, 3}, {2, 1}}};
  std::array<std::size_t, 4> order = {0, 1, 2, 3};
  do {
    TrafficGrid trails({30, 0, 0, 10, true});
    for (const std::size_t i : order) trails.add(passages[i].first, 5, 5, 0.25, passages[i].second);
    EXPECT_NEAR(trails.value(1, 5, 5, 8), std::exp(-0.3), 1e-6);
    EXPECT_NEAR(trails.value(2, 5, 5, 8), std::exp(-0.5), 1e-6);
    EXPECT_NEAR(trails.value(3, 5, 5, 8), std::exp(-0.3), 1e-6);
    EXPECT_EQ(trails.value(1, 35, 5, 8), 0);
  } while (std::next_permutation(order.begin(), order.end()));
  // Nobody meets a trail of its own.
  TrafficGrid alone({30, 0, 0, 10, true});
  alone.add(1, 5, 5, 0.25, 0);
  EXPECT_EQ(alone.value(1, 5, 5, 0), 0);
  EXPECT_EQ(alone.value(2, 5, 5, 0), 1);
}

/// Distance between two corners modulo the cell size.
double off(double a_mm, double b_mm, double side_mm) { return std::abs(std::remainder(a_mm - b_mm, side_mm)); }

/// A fitted model with a traffic effect in the grid of that index.
FitState remembering(const Fitter& fitter, const MeasuredSet& set, std::uint8_t cells) {
  FitState state = fitted(fitter, set);
  Factor trodden;
  trodden.shape = Shape::kExponential;
  trodden.axis = {Covariate::kTraffic, cells};
  trodden.points = {2, 8, 32};
  state.model.terms.push_back(unfitted(trodden));
  fitter.fit(state, 2);
  return state;
}

TEST(Place, TrafficCellsAreRecovered) {
  const MeasuredSet set = played([](const Around& a) { return 1 - 0.5 * a.traffic / (a.traffic + 4); }, 8, 12, 150);
  const Fitter fitter(set, 2);
  FitState state = remembering(fitter, set, 2);
  const MotionModel& model = state.model;
  ASSERT_TRUE(refine_traffic_shape(fitter, state, 0));
  const Axis axis = model.terms[0].blocks.front().basis.factors.front().axis;
  const GridCells& cells = model.cells[axis.radius];
  EXPECT_NEAR(cells.side_mm, kCells.side_mm, 0.7);
  EXPECT_LT(off(cells.x_mm, kCells.x_mm, kCells.side_mm), 3);
  EXPECT_LT(off(cells.y_mm, kCells.y_mm, kCells.side_mm), 3);
  Situation fresh = driven_at(0, 0), worn = fresh;
  worn.near.traffic[axis.radius] = 12;
  EXPECT_NEAR(gain_of(model, worn) / gain_of(model, fresh), 1 - 0.5 * 12 / 16, 0.05);
  // The written effect.
  const proto::Model written = proto_of(model);
  ASSERT_EQ(written.field_size(), 1);
  EXPECT_EQ(written.field(0).name(), field_name(axis.radius));
  EXPECT_NEAR(written.field(0).cell_mm(), model.cells[axis.radius].side_mm, 1e-5);
  const auto& effects = written.effect();
  EXPECT_TRUE(std::any_of(effects.begin(), effects.end(), [&](const proto::Effect& e) {
    return e.function_size() == 1 && e.function(0).of() == proto::Function::PLACE &&
           e.function(0).field() == field_name(axis.radius);
  }));
}

TEST(Place, TrailsOfOthersAreRecovered) {
  const GridCells trails{37, 15, -12, 14, true};
  const MeasuredSet set = played([](const Around& a) { return 1 - 0.5 * a.traffic; }, 9, 12, 150, trails);
  const Fitter fitter(set, 2);
  // From a grid of time in cells: the kind is found.
  FitState state = remembering(fitter, set, 7);
  const MotionModel& model = state.model;
  ASSERT_TRUE(refine_traffic_shape(fitter, state, 0));
  const Axis axis = model.terms[0].blocks.front().basis.factors.front().axis;
  const GridCells& cells = model.cells[axis.radius];
  ASSERT_TRUE(cells.trail);
  EXPECT_NEAR(cells.side_mm, trails.side_mm, 0.7);
  EXPECT_LT(off(cells.x_mm, trails.x_mm, trails.side_mm), 3);
  EXPECT_LT(off(cells.y_mm, trails.y_mm, trails.side_mm), 3);
  for (const double age_s : {1.0, 10.0, 20.0}) {
    Situation none = driven_at(0, 0), behind = none;
    behind.near.traffic[axis.radius] = static_cast<float>(std::exp(-age_s / cells.forget_s));
    EXPECT_NEAR(gain_of(model, behind) / gain_of(model, none), 1 - 0.5 * std::exp(-age_s / 14), 0.05) << age_s;
  }
  const proto::Model written = proto_of(model);
  ASSERT_EQ(written.field_size(), 1);
  EXPECT_EQ(written.field(0).counts(), proto::ArenaField::TRAIL);
  EXPECT_NEAR(written.field(0).corner_x_mm(), cells.x_mm, 1e-5);
}

TEST(Place, AStepInTrafficIsRecovered) {
  const GridCells small{24, 7, -9};
  const MeasuredSet set = played([](const Around& a) { return a.traffic > 2 ? 0.7 : 1.0; }, 9, 12, 200, small);
  const Fitter fitter(set, 2);
  FitState state = remembering(fitter, set, 0);
  const MotionModel& model = state.model;
  ASSERT_TRUE(refine_traffic_shape(fitter, state, 0));
  const Axis axis = model.terms[0].blocks.front().basis.factors.front().axis;
  const GridCells& cells = model.cells[axis.radius];
  EXPECT_NEAR(cells.side_mm, small.side_mm, 0.3);
  EXPECT_LT(off(cells.x_mm, small.x_mm, small.side_mm), 2);
  EXPECT_LT(off(cells.y_mm, small.y_mm, small.side_mm), 2);
  const auto gain_after = [&](double seconds) {
    Situation s = driven_at(0, 0);
    s.near.traffic[axis.radius] = static_cast<float>(seconds);
    return gain_of(model, s);
  };
  for (const double seconds : {4.0, 10.0, 20.0}) EXPECT_NEAR(gain_after(seconds) / gain_after(0.25), 0.7, 0.06);
}

}  // namespace
}  // namespace kilotwin::identify
