// The amplitude of a run outside the fit, inferred from its past.
#include "clients/identify/predict/run_amplitude.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "clients/identify/search/hypotheses.hpp"

namespace kilotwin::identify {
namespace {

MotionModel with_speeds_of_runs(const std::vector<double>& gain) {
  MotionModel model;
  Factor which;
  which.shape = Factor::Shape::kTable;
  which.axis.of = Covariate::kRun;
  for (std::size_t r = 0; r < gain.size(); ++r) which.points.push_back(static_cast<double>(r));
  const auto n = static_cast<Eigen::Index>(gain.size());
  model.terms.push_back(
      {"speed-by-run", {{Target::kGain, Basis{{which}}}}, Eigen::VectorXd(n), Eigen::VectorXd::Ones(n)});
  for (Eigen::Index r = 0; r < n; ++r) model.terms[0].coefficients[r] = gain[static_cast<std::size_t>(r)];
  return model;
}

double gain_of(const MotionModel& model, std::uint32_t run) {
  Situation s;
  s.run = run;
  s.commands.command = Motion::kStraight;
  return model.rates(s, Eigen::Vector2d::Zero()).left_gain - 1;
}

TEST(RunAmplitude, ATrainingRunKeepsItsAmplitude) {
  const MotionModel model = with_speeds_of_runs({-0.1, 0.2, 0});
  const RunAmplitude amplitude(model, 1);
  ASSERT_EQ(amplitude.models().size(), 1u);
  EXPECT_DOUBLE_EQ(gain_of(amplitude.models()[0], 1), 0.2);
  EXPECT_EQ(RunAmplitude(MotionModel{}, 7).models().size(), 1u);
}

TEST(RunAmplitude, ARunThatIsHeldOutIsUnknown) {
  MeasuredSet set;
  for (int r = 0; r < 3; ++r) {
    Track& track = set.runs.emplace_back().tracks.emplace_back();
    track.held_out = r == 1;
    track.commands.push_back({-1e300, Motion::kStraight});
    for (int i = 0; i < 20; ++i) track.samples.push_back({0.5 * i, 5.0 * i, 0, 0});
  }
  const Extent extent = extent_of(PreparedSet(set));
  EXPECT_EQ(extent.runs, (std::vector<std::uint32_t>{0, 2}));
  MotionModel model = with_speeds_of_runs({0.1, 0.2});
  model.terms[0].blocks[0].basis.factors[0].points.assign(extent.runs.begin(), extent.runs.end());
  EXPECT_EQ(RunAmplitude(model, 1).models().size(), 13u) << "inferred from its past";
  EXPECT_EQ(RunAmplitude(model, 2).models().size(), 1u);
}

TEST(RunAmplitude, ThePriorIsTheMeanOfAllRuns) {
  const RunAmplitude amplitude(with_speeds_of_runs({-0.1, 0.2, 0.05}), 9);
  const std::vector<double> nothing(amplitude.models().size(), 0);
  const RunAmplitude::Between mean = amplitude.mean(nothing);
  const double low = gain_of(amplitude.models()[mean.low], 9), high = gain_of(amplitude.models()[mean.high], 9);
  EXPECT_NEAR(low + mean.part * (high - low), 0.05, 1e-9);
}

TEST(RunAmplitude, ThePosteriorFollowsTheData) {
  // A posterior much narrower than the raster, beyond the other runs' amplitudes.
  const RunAmplitude amplitude(with_speeds_of_runs({-0.1, 0.2, 0.05, -0.03}), 9);
  for (const double truth : {-0.2, 0.013, 0.31}) {
    for (const double sd : {0.002, 0.02}) {
      std::vector<double> log_likelihood;
      for (const MotionModel& model : amplitude.models())
        log_likelihood.push_back(-0.5 * std::pow((gain_of(model, 9) - truth) / sd, 2));
      const RunAmplitude::Between mean = amplitude.mean(log_likelihood);
      const double low = gain_of(amplitude.models()[mean.low], 9), high = gain_of(amplitude.models()[mean.high], 9);
      EXPECT_NEAR(low + mean.part * (high - low), truth, 0.3 * sd) << truth << " " << sd;
    }
  }
}

/// Of a run whose gain is `truth(time)`: ten samples of sd 0.02 every 5 s.
template <class Truth>
DriftingAmplitude::Known known_at(const RunAmplitude& amplitude, double end_s, double ahead_s, const Truth& truth) {
  DriftingAmplitude follows(amplitude);
  std::vector<double> log_likelihood(amplitude.models().size(), 0);
  DriftingAmplitude::Known known;
  for (double time_s = 5; time_s <= end_s; time_s += 5) {
    for (std::size_t i = 0; i < log_likelihood.size(); ++i)
      log_likelihood[i] -= 10 * 0.5 * std::pow((gain_of(amplitude.models()[i], 9) - truth(time_s)) / 0.02, 2);
    known = follows.at(time_s, ahead_s, log_likelihood);
  }
  return known;
}

TEST(RunAmplitude, ASteadyDriftIsFollowedWithoutLag) {
  const RunAmplitude amplitude(with_speeds_of_runs({-0.1, 0.2, 0.05, -0.03}), 9);
  const auto falls = [](double time_s) { return 0.2 - 0.4 * time_s / 200; };
  const DriftingAmplitude::Known known = known_at(amplitude, 200, 10, falls);
  ASSERT_TRUE(known.ahead.has_value());
  EXPECT_NEAR(gain_of(amplitude.model_at(*known.ahead), 9), falls(205), 0.01);
  EXPECT_NEAR(gain_of(amplitude.model_at(known.passed), 9), falls(197.5), 0.01);
}

TEST(RunAmplitude, AWaveIsFollowed) {
  const RunAmplitude amplitude(with_speeds_of_runs({-0.1, 0.2, 0.05, -0.03}), 9);
  const auto wave = [](double time_s) { return 0.15 * std::sin(2 * M_PI * time_s / 340); };
  for (const double end_s : {120.0, 170.0, 255.0, 300.0}) {
    const DriftingAmplitude::Known known = known_at(amplitude, end_s, 10, wave);
    ASSERT_TRUE(known.ahead.has_value()) << end_s;
    EXPECT_NEAR(gain_of(amplitude.model_at(*known.ahead), 9), wave(end_s + 5), 0.015) << end_s;
  }
}

TEST(RunAmplitude, WithoutDriftTheWholePastCounts) {
  const RunAmplitude amplitude(with_speeds_of_runs({-0.1, 0.2, 0.05, -0.03}), 9);
  const auto noisy = [](double time_s) { return 0.07 + 0.006 * std::cos(7.3 * time_s); };
  const DriftingAmplitude::Known known = known_at(amplitude, 200, 10, noisy);
  EXPECT_FALSE(known.ahead.has_value());
  EXPECT_NEAR(gain_of(amplitude.model_at(known.passed), 9), 0.07, 0.002);
}

TEST(RunAmplitude, ARunOutsideTheFitHasACourseOfItsOwn) {
  // Runs 0 and 1 rise and fall over 100 s by 0.2: a run outside the fit gets one amplitude from their spread.
  MotionModel model = with_speeds_of_runs({0, 0});
  Factor course;
  course.shape = Factor::Shape::kCosines;
  course.axis.of = Covariate::kTime;
  course.high = 100;
  course.first = 0;
  course.count = 2;
  model.terms[0].blocks[0].basis.factors.push_back(course);
  model.terms[0].coefficients = Eigen::Vector4d(0, 0.2, 0, -0.2);
  model.terms[0].precision = Eigen::Vector4d::Ones();
  EXPECT_EQ(RunAmplitude(model, 1).models().size(), 1u);
  const RunAmplitude amplitude(model, 9);
  ASSERT_EQ(amplitude.models().size(), 13u);
  EXPECT_TRUE(amplitude.over_time());
  EXPECT_FALSE(RunAmplitude(with_speeds_of_runs({0, 0.2}), 9).over_time());
  EXPECT_NEAR(gain_of(amplitude.models()[6], 9), 0, 1e-12);
  // The root mean square of 0.2 cos over whole half-waves, for two runs: times sqrt(2 (1 + 1/2)), at four standard deviations.
  EXPECT_NEAR(gain_of(amplitude.models()[12], 9), 4 * 0.2 / std::sqrt(2) * std::sqrt(3), 1e-6);
}

}  // namespace
}  // namespace kilotwin::identify
