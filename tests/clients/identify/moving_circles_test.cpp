// Laws of moving circles: the derivatives of a curve by its centre, and a disc that is found and followed.
#include "clients/identify/search/moving_circles.hpp"
#include "clients/identify/search/circle_edges.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>

#include "clients/identify/search/shape_refinement.hpp"
#include "core/random/random.hpp"

namespace kilotwin::identify {
namespace {

Factor curve_about(const MovingPoint& centre) {
  Factor f;
  f.shape = Factor::Shape::kCosines;
  f.axis.of = Covariate::kPointDistance;
  f.axis.point = centre;
  f.low = -100;
  f.high = 500;
  f.count = 3;
  return f;
}

TEST(MovingCircles, DerivativesByTheCentreMatchDifferences) {
  const std::array<double, 3> coefficients{0.3, -0.2, 0.1};
  const MovingPoint centre{20, -40, 1.5, -0.5, 0.8};
  Situation s;
  s.x_mm = 150;
  s.y_mm = 90;
  s.time_s = 40;
  const auto value = [&](const MovingPoint& at) {
    std::array<double, 3> columns;
    curve_about(at).evaluate(s, 0, columns.data());
    double sum = 0;
    for (std::size_t k = 0; k < 3; ++k) sum += coefficients[k] * columns[k];
    return sum;
  };
  Factor shift = curve_about(centre);
  shift.shape = Factor::Shape::kPointShift;
  shift.points.assign(coefficients.begin(), coefficients.end());
  shift.count = 100;
  std::array<double, 5> derivative;
  ASSERT_EQ(shift.columns(), derivative.size());
  shift.evaluate(s, 0, derivative.data());
  constexpr std::array<double MovingPoint::*, 5> kNumbers = {
      &MovingPoint::x_mm, &MovingPoint::y_mm, &MovingPoint::velocity_x_mm_s, &MovingPoint::velocity_y_mm_s,
      &MovingPoint::growth_mm_s};
  for (std::size_t n = 0; n < kNumbers.size(); ++n) {
    // The last three are per mm over 100 s.
    const double step = n < 2 ? 1e-3 : 1e-5;
    MovingPoint above = centre, below = centre;
    above.*kNumbers[n] += step;
    below.*kNumbers[n] -= step;
    EXPECT_NEAR(derivative[n], (value(above) - value(below)) / 2e-3, 1e-7) << n;
  }
}

TEST(MovingCircles, TheDerivativeByADirectionMatchesDifferences) {
  const std::array<double, 3> coefficients{0.3, -0.2, 0.1};
  Situation s;
  s.x_mm = 150;
  s.y_mm = -90;
  const auto along = [](double rad) {
    Factor f = curve_about({});
    f.axis = {Covariate::kAlong};
    f.axis.along_rad = rad;
    return f;
  };
  const auto value = [&](double rad) {
    std::array<double, 3> columns;
    along(rad).evaluate(s, 0, columns.data());
    double sum = 0;
    for (std::size_t k = 0; k < 3; ++k) sum += coefficients[k] * columns[k];
    return sum;
  };
  Factor turn = along(0.4);
  turn.shape = Factor::Shape::kPointShift;
  turn.points.assign(coefficients.begin(), coefficients.end());
  ASSERT_EQ(turn.columns(), 1U);
  double derivative = 0;
  turn.evaluate(s, 0, &derivative);
  constexpr double kStep_rad = 1e-6;
  const double slope = (value(0.4 + kStep_rad) - value(0.4 - kStep_rad)) / (2 * kStep_rad);
  EXPECT_GT(std::abs(slope), 0.05);
  EXPECT_NEAR(derivative / Factor::kDirectionUnit_rad, slope, 1e-6);
}

/// Robots that wander, each in a run of its own, with a slow disc whose centre moves and whose radius grows. It slows every n-th.
MeasuredSet wandering(const MovingPoint& centre, double radius_mm, double gain, std::uint32_t every = 1) {
  constexpr double kStep_s = 0.02, kDuration_s = 120, kTracker_mm = 0.5;
  constexpr std::uint32_t kRuns = 24;
  const Random random(7);
  Axis axis;
  axis.of = Covariate::kPointDistance;
  axis.point = centre;
  MeasuredSet set;
  set.has_commands = set.has_headings = true;
  for (std::uint32_t r = 0; r < kRuns; ++r) {
    Run& run = set.runs.emplace_back();
    run.name = "r" + std::to_string(r);
    Track& track = run.tracks.emplace_back();
    track.robot = 0;
    track.commands.push_back({-1e300, Motion::kStop});
    const auto uniform = [&](int k, std::uint32_t draw) {
      return random.uniform(Stream::kLayout, r, Tick{k}, draw) * 2 - 1;
    };
    Situation s;
    s.x_mm = 300 * uniform(0, 1);
    s.y_mm = 300 * uniform(0, 2);
    double heading = M_PI * uniform(0, 3), next_s = 0;
    for (int k = 0; k * kStep_s <= kDuration_s; ++k) {
      s.time_s = k * kStep_s;
      const auto noise = [&](std::uint32_t draw) {
        return random.normal(Stream::kMeasurementNoise, r, Tick{k}, draw);
      };
      if (k % 25 == 0)
        track.samples.push_back({s.time_s, s.x_mm + kTracker_mm * noise(0), s.y_mm + kTracker_mm * noise(1),
                                 wrapped_angle(heading + 0.02 * noise(2))});
      if (s.time_s >= next_s - 1e-9) {
        const bool straight = track.commands.back().motion != Motion::kStraight;
        const double draw = uniform(k, 4);
        track.commands.push_back({s.time_s, straight   ? Motion::kStraight
                                            : draw < 0 ? Motion::kLeft
                                                       : Motion::kRight});
        next_s = s.time_s + (straight ? 8 + 4 * draw : 2 + draw);
      }
      const Eigen::Vector2d v = (r % every == 0 && value_of(axis, s, 0) < radius_mm ? gain : 1.0) *
                                nominal_speeds(BaseParameters{}, track.commands.back().motion);
      const double sd = std::sqrt(0.001 / kStep_s);
      Rates rates;
      rates.left_mm_s = v[0] * (1 + sd * random.normal(Stream::kWheelFactor, r, Tick{k}, 0));
      rates.right_mm_s = v[1] * (1 + sd * random.normal(Stream::kWheelFactor, r, Tick{k}, 1));
      const Arc arc = arc_of(rates, 25, heading, kStep_s);
      s.x_mm += arc.dx_mm;
      s.y_mm += arc.dy_mm;
      heading += arc.dheading_rad;
    }
  }
  return set;
}

/// A base model with the curve about the best circle of the scan, fitted and refined.
FitState with_circle(const Fitter& fitter, const MeasuredSet& set) {
  FitState state(set);
  fitter.fit(state, 3);
  const Extent extent = extent_of(state.tracks);
  const std::vector<MovingCircle> circles = moving_circles_of(fitter, state, extent);
  EXPECT_FALSE(circles.empty());
  if (circles.empty()) return state;
  EXPECT_GT(circles.front().gain, 50);
  const Dictionary dictionary = dictionary_of_circles(state, extent, circles);
  state.model.terms.push_back(dictionary.term_of(dictionary.hypotheses.at(1), 1));
  fitter.fit(state, 2);
  refine_curves(fitter, state, 0);
  refine_moving_circle(fitter, state, 0);
  return state;
}

TEST(MovingCircles, ADiscThatMovesAndGrowsIsFollowed) {
  const MovingPoint truth{-120, 60, 2, -0.5, 0.6};
  const MeasuredSet set = wandering(truth, 140, 0.5);
  const Fitter fitter(set, 2);
  const FitState state = with_circle(fitter, set);
  ASSERT_FALSE(state.model.terms.empty());
  const MovingPoint found = state.model.terms[0].blocks.front().basis.factors.front().axis.point;
  EXPECT_NEAR(found.velocity_x_mm_s, truth.velocity_x_mm_s, 0.5);
  EXPECT_NEAR(found.velocity_y_mm_s, truth.velocity_y_mm_s, 0.5);
  EXPECT_NEAR(found.growth_mm_s, truth.growth_mm_s, 0.5);
  EXPECT_NEAR(found.x_mm_at(60), truth.x_mm_at(60), 15);
  EXPECT_NEAR(found.y_mm_at(60), truth.y_mm_at(60), 15);
}

TEST(MovingCircles, OneThatHardlyMovesStands) {
  // It slows some robots only: a little motion fits to which of them came when, and explains more than standing does.
  constexpr double kRadius_mm = 200;
  for (const std::uint32_t every : {2U, 3U}) {
    const MeasuredSet set = wandering({20, -10, 0, 0, 0}, kRadius_mm, 0.5, every);
    const Fitter fitter(set, 2);
    FitState state(set);
    fitter.fit(state, 3);
    const Dictionary dictionary =
        dictionary_of_circles(state, extent_of(state.tracks), {{{20, -10, 0.1, -0.1, 0.05}, kRadius_mm, 0}});
    state.model.terms.push_back(dictionary.term_of(dictionary.hypotheses.at(1), 1));
    fitter.fit(state, 2);
    refine_curves(fitter, state, 0);
    refine_moving_circle(fitter, state, 0);
    EXPECT_TRUE(state.model.terms[0].blocks.front().basis.factors.front().axis.point.stands()) << every;
    EXPECT_EQ(state.model.terms[0].name, "speed-by-position") << every;
  }
}

TEST(MovingCircles, ASharpEdgeIsFoundInPlaceOfACurve) {
  const MovingPoint truth{-50, 60, 0, 0, 1.2};
  constexpr double kRadius_mm = 60;
  const MeasuredSet set = wandering(truth, kRadius_mm, 0.5);
  const Fitter fitter(set, 2);
  const FitState state = with_circle(fitter, set);
  ASSERT_FALSE(state.model.terms.empty());
  const double likelihood = fitter.log_likelihood(state);
  Search found{state, {{}}, {{state, {{}}}}, {}, {}, {}, {}};
  ASSERT_TRUE(sharpen_moving_circles(fitter, found, UINT64_MAX));
  EXPECT_GT(fitter.log_likelihood(found.fit), likelihood);
  const Factor& edge = found.fit.model.terms[0].blocks.front().basis.factors.front();
  ASSERT_EQ(edge.shape, Factor::Shape::kAtLeast);
  EXPECT_NEAR(edge.axis.point.x_mm_at(30), truth.x_mm, 4);
  EXPECT_NEAR(edge.axis.point.y_mm_at(30), truth.y_mm, 4);
  EXPECT_NEAR(edge.points.front() + edge.axis.point.growth_mm_s * 30, kRadius_mm + truth.growth_mm_s * 30, 4);
  EXPECT_NEAR(edge.axis.point.growth_mm_s, truth.growth_mm_s, 0.1);
}

}  // namespace
}  // namespace kilotwin::identify
