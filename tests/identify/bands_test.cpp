// Bands of every kind of term, and intervals of the numbers beside coefficients: laws, and how often they hold the truth.
#include "clients/identify/bands.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "clients/identify/estimates.hpp"
#include "clients/identify/fit/term_values.hpp"
#include "core/stats/distributions.hpp"
#include "tests/identify/small_set.hpp"
#include "tests/identify/truth/effects.hpp"

namespace kilotwin {
namespace {

using namespace identify;
using Covariate = identify::Covariate;

Factor linear(Covariate of, double high) {
  Factor f;
  f.shape = Factor::Shape::kLinear;
  f.axis.of = of;
  f.high = high;
  return f;
}

Factor table(std::vector<double> keys, std::vector<double> known, double plus) {
  Factor f;
  f.shape = Factor::Shape::kTable;
  f.axis.of = Covariate::kRobot;
  f.points = std::move(keys);
  f.known = std::move(known);
  f.plus = plus;
  return f;
}

Term term_of(Factor factor, double coefficient) {
  Term term{"speed-by-time", {{Target::kGain, Basis{{std::move(factor)}}}}, {}, {}};
  term.coefficients =
      Eigen::VectorXd::Constant(static_cast<Eigen::Index>(term.blocks[0].basis.size()), coefficient);
  term.precision = Eigen::VectorXd::Ones(term.coefficients.size());
  return term;
}

/// The uncertainty of a model whose parameters have this covariance.
Uncertainty with_covariance(const MotionModel& model, const Eigen::MatrixXd& covariance) {
  Uncertainty u;
  u.held = held_numbers_of(model, {100, 400});
  u.all = covariance;
  EXPECT_EQ(covariance.rows() - u.held.size(),
            kBaseColumns + static_cast<Eigen::Index>(model.terms.front().coefficients.size()));
  return u;
}

const JsonList& list(const JsonList& bands, int band, const char* key) {
  return bands.values(band).struct_value().fields().at(key).list_value();
}

TEST(Bands, OfALinearTermIsTheClosedForm) {
  MotionModel model;
  model.terms.push_back(term_of(linear(Covariate::kNeighbours, 8), -0.2));
  constexpr double kSd = 0.03;
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(kBaseColumns + 1, kBaseColumns + 1);
  covariance(kBaseColumns, kBaseColumns) = kSd * kSd;
  const JsonList bands = bands_of(model, 0, with_covariance(model, covariance));
  ASSERT_EQ(bands.values_size(), 1) << "curves over neighbours have a band";
  ASSERT_EQ(list(bands, 0, "at").values_size(), 21);
  for (int i = 0; i < 21; ++i) {
    const double share = list(bands, 0, "at").values(i).number_value() / 8;
    EXPECT_NEAR(list(bands, 0, "value").values(i).number_value(), -0.2 * share, 1e-12);
    EXPECT_NEAR(list(bands, 0, "high").values(i).number_value(), -0.2 * share + stats::kNormal95 * kSd * share,
                1e-12);
  }
}

TEST(Bands, OfAProductContainTheErrorOfItsKnownFunction) {
  MotionModel model;
  Term term = term_of(linear(Covariate::kTime, 100), 0.3);
  term.blocks[0].basis.factors.insert(term.blocks[0].basis.factors.begin(), table({2, 7}, {0.5, -0.5}, 1));
  model.terms.push_back(term);
  // The amplitudes of both robots, with a correlation with the coefficient of the curve.
  constexpr double kCurve = 0.02, kAmplitude = 0.1, kCorrelation = 0.3;
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(kBaseColumns + 3, kBaseColumns + 3);
  covariance(kBaseColumns, kBaseColumns) = kCurve * kCurve;
  for (int i = 1; i <= 2; ++i) {
    covariance(kBaseColumns + i, kBaseColumns + i) = kAmplitude * kAmplitude;
    covariance(kBaseColumns, kBaseColumns + i) = covariance(kBaseColumns + i, kBaseColumns) =
        kCorrelation * kCurve * kAmplitude;
  }
  const Uncertainty u = with_covariance(model, covariance);
  const TermValues values(model, u, 0);
  for (const auto& [robot, amplitude] : {std::pair{2.0, 1.5}, std::pair{7.0, 0.5}}) {
    const ValueWithSd v = values.at({{0, {{robot, 0}, {60, 0}}}});
    EXPECT_NEAR(v.value, amplitude * 0.3 * 0.6, 1e-12);
    const double by_curve = amplitude * 0.6, by_amplitude = 0.3 * 0.6;
    EXPECT_NEAR(v.sd,
                std::sqrt(std::pow(by_curve * kCurve, 2) + std::pow(by_amplitude * kAmplitude, 2) +
                          2 * kCorrelation * by_curve * kCurve * by_amplitude * kAmplitude),
                1e-12);
  }
  // At amplitude 1 the amplitudes add nothing.
  EXPECT_NEAR(values.at({{0, {{0, 0, true}, {60, 0}}}}).sd, 0.6 * kCurve, 1e-12);
}

TEST(HeldNumbers, BlocksSumToTheValue) {
  Factor curve;
  curve.shape = Factor::Shape::kCosines;
  curve.axis.of = Covariate::kTime;
  curve.high = 50;
  curve.count = 3;
  Factor steps;
  steps.shape = Factor::Shape::kAtLeast;
  steps.axis.of = Covariate::kX;
  steps.points = {-20, 30};
  const Block block{Target::kGain, Basis{{table({1, 4}, {0.2, -0.1}, 1), steps, curve}, {0, 2, 5}}};
  const Eigen::VectorXd coefficients = Eigen::Vector3d(0.4, -0.3, 0.7);
  Situation s;
  s.robot = 4;
  s.x_mm = 35;
  s.time_s = 17;
  std::array<double, kMostColumns> columns;
  block.basis.evaluate(s, 0, columns.data());
  double value = 0;
  for (int i = 0; i < 3; ++i) value += coefficients[i] * columns[static_cast<std::size_t>(i)];
  const auto sum = [&](int open, std::size_t column) {
    double all = 0;
    for (const WeighedBlock& part : value_as_blocks(block, coefficients, open)) {
      part.block.basis.evaluate(s, 0, columns.data());
      all += part.weight * columns[column];
    }
    return all;
  };
  EXPECT_NEAR(sum(-1, 0), value, 1e-12);
  // By the amplitude of robot 4, which is 0.9.
  EXPECT_NEAR(sum(0, 1), value / 0.9, 1e-12);
  EXPECT_EQ(sum(0, 0), 0);
}

/// The derivatives of the effect by the held numbers in a situation.
Eigen::VectorXd by_numbers(const HeldNumbers& held, const Situation& s) {
  Eigen::VectorXd columns(static_cast<Eigen::Index>(held.columns.blocks.size()));
  for (Eigen::Index i = 0; i < columns.size(); ++i)
    held.columns.blocks[static_cast<std::size_t>(i)].basis.evaluate(s, 0, &columns[i]);
  return held.columns.weights.transpose() * columns;
}

TEST(HeldNumbers, ADirectionIsOne) {
  Factor f;
  f.shape = Factor::Shape::kCosines;
  f.axis = {Covariate::kAlong};
  f.axis.along_rad = 0.4;
  f.low = -300;
  f.high = 300;
  f.count = 2;
  MotionModel model;
  model.terms.push_back(term_of(f, 0.3));
  const HeldNumbers held = held_numbers_of(model, {100, 400});
  ASSERT_EQ(held.size(), 1);
  EXPECT_EQ(held.numbers[0].name, "direction");
  EXPECT_EQ(held.numbers[0].value, 0.4);
  Situation s;
  s.x_mm = 150;
  s.y_mm = -90;
  Factor turn = f;
  turn.shape = Factor::Shape::kPointShift;
  turn.points = {0.3, 0.3};
  double derivative = 0;
  turn.evaluate(s, 0, &derivative);
  EXPECT_NEAR(by_numbers(held, s)[0], derivative / Factor::kDirectionUnit_rad,
              1e-3 * std::abs(derivative) / Factor::kDirectionUnit_rad);
}

TEST(HeldNumbers, OfACentreAreDifferences) {
  Factor f;
  f.shape = Factor::Shape::kCosines;
  f.axis.of = Covariate::kPointDistance;
  f.axis.point = {20, -40, 1.5, -0.5, 0.8};
  f.low = -100;
  f.high = 500;
  f.count = 2;
  MotionModel model;
  model.terms.push_back(term_of(f, 0.3));
  const HeldNumbers held = held_numbers_of(model, {100, 400});
  ASSERT_EQ(held.size(), 5);
  EXPECT_EQ(held.numbers[0].name, "centre x");
  EXPECT_EQ(held.numbers[4].name, "growth");
  Situation s;
  s.x_mm = 150;
  s.y_mm = 90;
  s.time_s = 40;
  Factor shift = f;
  shift.shape = Factor::Shape::kPointShift;
  shift.points = {0.3, 0.3};
  shift.count = 1;
  std::array<double, 5> derivative;
  shift.evaluate(s, 0, derivative.data());
  const Eigen::VectorXd found = by_numbers(held, s);
  for (std::size_t n = 0; n < 5; ++n)
    EXPECT_NEAR(found[static_cast<Eigen::Index>(n)], derivative[n], 1e-4 * std::abs(derivative[n])) << n;
}

/// The model of a scene with one term more, fitted.
struct FittedTerm : BaseFit {
  FittedTerm(const truth::Scene& scene, std::uint64_t seed, Term term) : BaseFit(scene, seed) {
    state.model.terms.push_back(std::move(term));
    fitter.fit(state, 3);
    uncertainty = uncertainty_of(fitter, state);
  }
  Uncertainty uncertainty;
};

/// Speed by the distance of the nearest other: 1 - 0.5 (1 - d / 150 mm), the same from 150 mm on.
truth::Effect shy() {
  return {"shy",
          "",
          {{"neighbours"}},
          {},
          [](const truth::Situation& at, truth::Push& push) {
            double nearest = 150;
            for (std::size_t i = 0; i < at.discs->size(); ++i) {
              if (static_cast<int>(i) == at.robot) continue;
              const truth::Vec& other = (*at.discs)[i];
              nearest = std::min(nearest, std::hypot(other.x - at.disc.x, other.y - at.disc.y));
            }
            push.gain.left *= 0.5 + 0.5 * nearest / 150;
            push.gain.right *= 0.5 + 0.5 * nearest / 150;
          },
          {}};
}

TEST(Bands, OfANeighbourCurveHoldTheTruth) {
  truth::Scene scene = small({shy()});
  scene.width_mm = scene.height_mm = 450;
  Factor curve = linear(Covariate::kNearest, 150);
  curve.low = 33;
  curve.axis.radius = 11;
  ASSERT_EQ(reach_mm(curve.axis), 150);
  constexpr std::uint64_t kSets = 12;
  int held = 0, all = 0;
  for (std::uint64_t seed = 1; seed <= kSets; ++seed) {
    const FittedTerm f(scene, seed, term_of(curve, 0.1));
    const JsonList bands = bands_of(f.state.model, 0, f.uncertainty);
    ASSERT_EQ(bands.values_size(), 1);
    // The curve is relative to the speed at 33 mm.
    const double at_low = 0.5 + 0.5 * 33 / 150;
    for (int i = 1; i < list(bands, 0, "at").values_size(); i += 5) {
      const double truth = (0.5 + 0.5 * list(bands, 0, "at").values(i).number_value() / 150) / at_low - 1;
      const double low = list(bands, 0, "low").values(i).number_value(),
                   high = list(bands, 0, "high").values(i).number_value();
      held += low <= truth && truth <= high ? 1 : 0;
      ++all;
      EXPECT_LT(high - low, 0.5 * truth + 0.1) << "the band says something";
    }
  }
  // Linear: all points of a set hold the truth, or none. With 12 sets at 95 %, fewer than 9 have a probability of 0.2 %.
  EXPECT_GE(held, all * 3 / 4) << held << " of " << all;
}

TEST(StepIntervals, OfAnInstantHoldTheTruth) {
  truth::Scene scene = small({});
  constexpr double kAt_s = 47.3;
  scene.effects = {{"step",
                    "",
                    {{"time"}},
                    {},
                    [](const truth::Situation& at, truth::Push& push) {
                      if (at.time_s < kAt_s) return;
                      push.gain.left *= 0.7;
                      push.gain.right *= 0.7;
                    },
                    {}}};
  Factor step;
  step.shape = Factor::Shape::kAtLeast;
  step.axis.of = Covariate::kTime;
  step.points = {kAt_s + 0.1};
  constexpr std::uint64_t kSets = 8;
  int held = 0;
  for (std::uint64_t seed = 1; seed <= kSets; ++seed) {
    const FittedTerm f(scene, seed, term_of(step, -0.2));
    const std::vector<StepInterval> found = step_intervals_of(f.fitter, f.state, f.uncertainty);
    ASSERT_EQ(found.size(), 1U);
    ASSERT_TRUE(found[0].low && found[0].high) << seed;
    held += *found[0].low <= kAt_s && kAt_s <= *found[0].high ? 1 : 0;
    EXPECT_LT(*found[0].high - *found[0].low, 10) << seed;
    EXPECT_GT(*found[0].high - *found[0].low, 0.05) << seed;
    const auto numbers = estimates_of(0, f.uncertainty, found);
    ASSERT_EQ(numbers.size(), 1U);
    EXPECT_EQ(numbers[0].name(), "instant");
    // The band of the step holds both levels within the interval.
    const TermValues values(f.state.model, f.uncertainty, 0);
    EXPECT_EQ(values.at({{0, {{kAt_s - 5, 0}}}}).value, 0);
  }
  EXPECT_GE(held, static_cast<int>(kSets) - 1);
}

TEST(StepIntervals, OfTheRadiusWithinWhichNeighboursCountHoldTheTruth) {
  truth::Scene scene = small({truth::third_of_a_party()});
  scene.width_mm = scene.height_mm = 450;
  const double truth_mm = scene.effects.front().numbers.at("radius");
  Factor count;
  count.shape = Factor::Shape::kAtLeast;
  count.axis.of = Covariate::kNeighbours;
  count.axis.within_mm = 97;
  count.points = {2};
  constexpr std::uint64_t kSets = 8;
  int held = 0;
  for (std::uint64_t seed = 1; seed <= kSets; ++seed) {
    const FittedTerm f(scene, seed, term_of(count, -0.3));
    const std::vector<StepInterval> found = step_intervals_of(f.fitter, f.state, f.uncertainty);
    ASSERT_EQ(found.size(), 1U) << "the radius; an interval of a count says nothing";
    EXPECT_TRUE(found[0].is_radius);
    ASSERT_TRUE(found[0].low && found[0].high) << seed;
    held += *found[0].low <= truth_mm && truth_mm <= *found[0].high ? 1 : 0;
    EXPECT_LT(*found[0].high - *found[0].low, 30) << seed;
    EXPECT_GT(*found[0].high - *found[0].low, 0.2) << seed;
    const auto numbers = estimates_of(0, f.uncertainty, found);
    ASSERT_EQ(numbers.size(), 1U);
    EXPECT_EQ(numbers[0].name(), "radius");
    EXPECT_EQ(numbers[0].unit(), "mm");
  }
  EXPECT_GE(held, static_cast<int>(kSets) - 1);
}

TEST(Uncertainty, OfTheBiasesPopulationIsThatOfASample) {
  auto&& [set, fitter, state] = BaseFit(small({}));
  const Uncertainty u = uncertainty_of(fitter, state);
  // The biases of ten robots are known far better than they spread: 20 values, and a prior of four.
  const double s = state.model.base.bias_sd_mm_s;
  EXPECT_NEAR(u.bias_sd_sd_mm_s, s / std::sqrt(2.0 * 24), 0.15 * s / std::sqrt(2.0 * 24));
  EXPECT_GT(u.bias_mean_sd_mm_s, 0.8 * s / std::sqrt(24.0));
}

}  // namespace
}  // namespace kilotwin
