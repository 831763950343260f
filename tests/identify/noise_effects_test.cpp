// Effects on the size of the motion noise: found where they are, named, written, and not found where they are not. Intervals of
// the noise, of the lag, of curves and maps.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "clients/identify/bands.hpp"
#include "clients/identify/fit/noise_restriction.hpp"
#include "clients/identify/model/effect_records.hpp"
#include "clients/identify/model/effect_text.hpp"
#include "clients/identify/model/model_file.hpp"
#include "clients/identify/noise_effects.hpp"
#include "clients/identify/search/hypotheses.hpp"
#include "tests/identify/small_set.hpp"
#include "tests/identify/truth/effects.hpp"
#include "tests/identify/truth/laboratory_effects.hpp"

namespace kilotwin {
namespace {

using namespace identify;

/// A base model fitted to a scene, and its samples of the noise.
struct Fitted : BaseFit {
  explicit Fitted(const truth::Scene& scene) : BaseFit(scene), samples(noise_samples_of(state, 2)) {}

  std::vector<NoiseSample> samples;
};

const proto::Effect* record(const proto::Model& model, const std::string& name) {
  const auto at = std::find_if(model.effect().begin(), model.effect().end(),
                               [&](const proto::Effect& effect) { return effect.name() == name; });
  return at == model.effect().end() ? nullptr : &*at;
}

TEST(NoiseEffects, NoisyRobotsAreFoundNamedAndWritten) {
  const Fitted f(small({truth::noisy_robots()}));
  const std::vector<NoiseEffect> found = find_noise_effects(f.samples);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].covariates, std::vector<std::string>{"robot"});
  EXPECT_NEAR(found[0].most / found[0].least, 2.5, 0.9);

  proto::Model model = proto_of(f.state.model);
  write_noise_effects(model, f.state.model.noise, found);
  EXPECT_EQ(model.motion().factor_variance_s(), 0);
  for (const char* name : {"factor-noise", "wheel-noise", "heading-noise"}) {
    const proto::Effect* const noise = record(model, name);
    ASSERT_NE(noise, nullptr) << name;
    ASSERT_EQ(noise->function_size(), 2) << name;
    EXPECT_TRUE(noise->function(0).has_noise());
    const proto::Table& table = noise->function(1).table();
    ASSERT_EQ(table.key_size(), 10);
    // Every third robot has more than all others.
    double least_noisy = INFINITY, most_quiet = 0;
    for (int i = 0; i < table.key_size(); ++i) {
      if (table.key(i) % 3 == 0)
        least_noisy = std::min(least_noisy, table.value(i));
      else
        most_quiet = std::max(most_quiet, table.value(i));
    }
    EXPECT_GT(least_noisy, 1.3 * most_quiet);
  }
  const double sd = record(model, "factor-noise")->function(0).noise().sd();
  EXPECT_NEAR(sd * sd, f.state.model.noise.factor_s, 1e-6);
}

TEST(NoiseEffects, ARoughPatchIsAnEffectOfPlace) {
  truth::Scene scene = small({truth::rough_patch()});
  scene.train_runs = 4;
  const Fitted f(scene);
  const std::vector<NoiseEffect> found = find_noise_effects(f.samples);
  ASSERT_FALSE(found.empty());
  EXPECT_EQ(found[0].covariates, std::vector<std::string>{"position"});
  ASSERT_TRUE(found[0].scale.has_spline_2d());
  // The patch covers a small part of the floor. There the noise is larger than the common one, and elsewhere about as the fit without
  // an effect says, or less.
  const proto::Spline2d& map = found[0].scale.spline_2d();
  double far = 0, near = 0;
  int places = 0;
  for (int j = 0; j < map.and_knot_size(); ++j) {
    for (int i = 0; i < map.knot_size(); ++i) {
      const double x_mm = map.knot(i), y_mm = map.and_knot(j), value = map.value(j * map.knot_size() + i);
      const double away_mm = std::hypot(x_mm - 180, y_mm + 120);
      if (away_mm < 60) near = std::max(near, value);
      if (away_mm > 400) far += value, ++places;
    }
  }
  ASSERT_GT(places, 5);
  EXPECT_GT(near, 1.5);
  EXPECT_LT(far / places, 1.15);
}

TEST(NoiseEffects, ACrowdIsAnEffectOfNeighbours) {
  truth::Scene scene = small({truth::crowd_noise()});
  scene.width_mm = scene.height_mm = 450;
  scene.train_runs = 4;
  const Fitted f(scene);
  const std::vector<NoiseEffect> found = find_noise_effects(f.samples);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].name, "noise-by-neighbours");
  EXPECT_EQ(found[0].covariates, std::vector<std::string>{"neighbours"});
  const proto::Function& scale = found[0].scale;
  EXPECT_GT(scale.radius_mm(), 0);
  // One robot at 45 mm multiplies the true standard deviation by 2.9, no robot within 250 mm by 1.
  const proto::Spline& curve = scale.spline();
  const double first = curve.value(0), last = curve.value(curve.value_size() - 1);
  EXPECT_GT(scale.of() == proto::Function::NEAREST ? first / last : last / first, 1.7);
  proto::Model model = proto_of(f.state.model);
  write_noise_effects(model, f.state.model.noise, found);
  ASSERT_NE(record(model, "wheel-noise"), nullptr);
  EXPECT_EQ(record(model, "wheel-noise")->function(1).ShortDebugString(), scale.ShortDebugString());
}

TEST(NoiseEffects, EqualNoiseHasNone) {
  for (const std::uint64_t seed : {5u, 6u, 7u, 8u}) {
    truth::Scene scene = small({});
    if (seed > 6) scene.width_mm = scene.height_mm = 450;  // crowded
    auto&& [set, fitter, state] = BaseFit(scene, seed);
    const std::vector<NoiseSample> samples = noise_samples_of(state, 2);
    ASSERT_GT(samples.size(), 400U) << "fewer are not searched";
    for (const NoiseEffect& effect : find_noise_effects(samples))
      ADD_FAILURE() << effect.name << ", log10 p " << effect.log10_p << ", gain " << effect.held_out;
  }
}

TEST(NoiseRatio, IsHigherForNoisyRobots) {
  const Fitted f(small({truth::noisy_robots()}));
  const auto ratios = noise_ratios_of(f.samples);
  ASSERT_EQ(ratios.size(), 10U);
  for (const auto& [robot, ratio] : ratios) {
    EXPECT_LT(ratio.low, ratio.value);
    EXPECT_GT(ratio.high, ratio.value);
    if (robot % 3 == 0)
      EXPECT_GT(ratio.low, 1) << robot;
    else
      EXPECT_LT(ratio.value, 1.1) << robot;
  }
}

TEST(NoiseInterval, HoldsTheTruth) {
  const truth::Scene scene = small({});
  const Fitted f(scene);
  const NoiseInterval interval = f.fitter.noise_interval(f.state);
  const Noise& noise = f.state.model.noise;
  const auto holds = [](double low, double truth, double high) { return low <= truth && truth <= high; };
  EXPECT_TRUE(holds(interval.low.position_mm2, noise.position_mm2, interval.high.position_mm2));
  EXPECT_TRUE(
      holds(std::sqrt(interval.low.position_mm2), scene.tracker_sd_mm, std::sqrt(interval.high.position_mm2)));
  EXPECT_TRUE(
      holds(std::sqrt(interval.low.heading_rad2), scene.heading_sd_rad, std::sqrt(interval.high.heading_rad2)));
  // Thousands of samples determine the tracker's noise, and a curvature alone gives the same width.
  EXPECT_LT(interval.high.position_mm2, 1.3 * interval.low.position_mm2);
  EXPECT_GT(interval.high.position_mm2, 1.02 * interval.low.position_mm2);
  EXPECT_TRUE(std::isnan(interval.low.wall_mm2_s)) << "contact noise has no interval";
}

TEST(NoiseInterval, OfTheFactorHoldsTheTruthWhereOtherNoiseMayBeNone) {
  // The true noise is that of the factor alone, under a tracker that hides most of it. Wheel noise explains nearly the same, so that
  // the estimate shares the noise between both. The interval must reach the share without wheel noise. The fit's own estimate, with
  // biases as known, is 0.69 of the truth on average.
  truth::Scene scene = small({});
  scene.robots = 6;
  scene.width_mm = scene.height_mm = 0;
  scene.tracker_sd_mm = 1.1;
  scene.factor_sd = 0.1;
  scene.heading_sd_rad = 0.08;
  const double truth_s = scene.factor_sd * scene.factor_sd * scene.step_s;
  constexpr int kSets = 8;
  int held = 0;
  double sum_s = 0;
  for (std::uint64_t seed = 1; seed <= kSets; ++seed) {
    auto&& [set, fitter, state] = BaseFit(scene, seed);
    const NoiseInterval interval = fitter.noise_interval(state);
    held += interval.low.factor_s <= truth_s && truth_s <= interval.high.factor_s ? 1 : 0;
    sum_s += interval.most_likely.factor_s;
    EXPECT_LT(interval.high.factor_s, 2 * truth_s) << seed << ": the interval says something";
    EXPECT_LE(interval.low.factor_s, interval.most_likely.factor_s) << seed;
    EXPECT_GE(interval.high.factor_s, interval.most_likely.factor_s) << seed;
  }
  EXPECT_GE(held, kSets - 1);
  EXPECT_NEAR(sum_s / kSets, truth_s, 0.15 * truth_s);
}

TEST(Uncertainty, OfTheBaseSpeedContainsThatOfTheMeanBias) {
  const Fitted f(small({}));
  const Uncertainty u = uncertainty_of(f.fitter, f.state);
  // The data give the sum of speed and biases, as a common scale of speeds and wheel base. Ten robots have 20 biases with the
  // standard deviation s about their mean, which is itself known by a prior of four biases only.
  const double s = f.state.model.base.bias_sd_mm_s;
  const BasePrior prior;
  const double of_scale = 1 / std::pow(prior.straight_mm_s, 2) + 1 / std::pow(prior.turn_mm_s / 2, 2) +
                          1 / std::pow(prior.wheel_base_mm / 2.5, 2);
  const auto sd_of_speed = [&](double variance) { return 1 / std::sqrt(of_scale + 1 / variance); };
  const double mean_known = sd_of_speed(s * s / 20), mean_open = sd_of_speed(s * s / 20 + s * s / 4);
  EXPECT_GT(u.sd(kStraightSpeed), 0.5 * (mean_known + mean_open)) << mean_known << ", " << mean_open;
  EXPECT_LT(u.sd(kStraightSpeed), 1.2 * mean_open);
}

/// A term by name and form, fitted.
FitState with_term(const Fitted& f, const std::string& name, const std::string& form) {
  FitState state = f.state;
  const Dictionary all = dictionary_of(extent_of(state.tracks), {});
  const auto h = std::find_if(all.hypotheses.rbegin(), all.hypotheses.rend(), [&](const Hypothesis& one) {
    return one.name == name && form_of(all.term_of(one, 1)) == form;
  });
  EXPECT_NE(h, all.hypotheses.rend()) << name;
  state.model.terms.push_back(all.term_of(*h, 1));
  f.fitter.fit(state, 2);
  return state;
}

double log_determinant(const Eigen::MatrixXd& information) {
  const Eigen::LDLT<Eigen::MatrixXd> parts(information);
  return parts.vectorD().array().log().sum();
}

TEST(NoiseRestriction, FollowsTheInformationOfTheColumns) {
  const Fitted f(small({truth::battery_by_the_clock()}));
  const FitState state = with_term(f, "speed-by-position", "map");
  const NoiseRestriction restriction = noise_restriction(f.fitter, state, 1);
  const FittedVariances at = fitted_variances(state.model.noise);
  const auto exact = [&](const FittedVariances& variances) {
    FitState other = state;
    other.model.noise = with_fitted(other.model.noise, variances);
    return -0.5 * log_determinant(f.fitter.information(other));
  };
  // At most all columns, and fewer than there are, because priors hold some.
  EXPECT_GT(restriction.columns, 5);
  EXPECT_LT(restriction.columns, static_cast<double>(kBaseColumns + state.model.terms.back().coefficients.size()));
  FittedVariances more_factor = at, less_factor = at, more_of_tracker = at;
  more_factor[fitted_variance::kFactor] *= 3;
  less_factor[fitted_variance::kFactor] /= 3;
  more_of_tracker[fitted_variance::kPosition] *= 2;
  for (const FittedVariances& other : {more_factor, less_factor, more_of_tracker, FittedVariances(0.6 * at)}) {
    const double expected = exact(other) - exact(at);
    EXPECT_NEAR(restriction(other) - restriction(at), expected, 0.3 + 0.15 * std::abs(expected));
  }
  // Half of the samples follow half of the noise that the columns do.
  EXPECT_DOUBLE_EQ(noise_restriction(f.fitter, state, 0.5).columns, restriction.columns / 2);
}

TEST(Bands, OfACurveStandAtItsPoints) {
  const Fitted f(small({truth::battery_by_the_clock()}));
  const FitState state = with_term(f, "speed-by-time", "curve");
  const Uncertainty u = uncertainty_of(f.fitter, state);
  std::vector<identification::EffectCurve> curves =
      curves_of("speed-by-time", effects_of_term(state.model.terms.front()));
  ASSERT_FALSE(curves.empty());
  identification::EffectCurve& curve = curves.front();
  set_band(curve, state.model, 0, u);
  ASSERT_EQ(curve.low_size(), curve.at_size());
  for (int i = 0; i < curve.at_size(); ++i) {
    EXPECT_LT(curve.low(i), curve.value(i));
    EXPECT_GT(curve.high(i), curve.value(i));
    EXPECT_LT(curve.high(i) - curve.low(i), 60) << "per cent";
  }
}

TEST(Bands, OfAnotherTermAreNotDrawn) {
  const Fitted f(small({truth::battery_by_the_clock()}));
  const FitState state = with_term(f, "speed-by-time", "curve");
  identification::EffectCurve curve =
      curves_of("speed-by-time", effects_of_term(state.model.terms.front())).front();
  for (double& value : *curve.mutable_value()) value += 10;
  set_band(curve, state.model, 0, uncertainty_of(f.fitter, state));
  EXPECT_EQ(curve.low_size(), 0) << "the values are not those of the term";
}

TEST(Bands, OfAMapStandInItsCells) {
  const Fitted f(small({truth::rough_patch()}));
  const FitState state = with_term(f, "speed-by-position", "map");
  std::vector<identification::EffectMap> maps =
      maps_of("speed-by-position", effects_of_term(state.model.terms.front()));
  ASSERT_FALSE(maps.empty());
  set_band(maps.front(), state.model, 0, uncertainty_of(f.fitter, state));
  ASSERT_EQ(maps.front().low_size(), maps.front().y_mm_size());
  const auto value = [&](const auto& rows) { return rows[3].values(5).number_value(); };
  EXPECT_LT(value(maps.front().low()), value(maps.front().effect()));
  EXPECT_GT(value(maps.front().high()), value(maps.front().effect()));
}

}  // namespace
}  // namespace kilotwin
