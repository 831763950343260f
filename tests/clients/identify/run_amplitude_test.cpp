// The amplitude of a run outside the fit, inferred from its past.
#include "clients/identify/predict/run_amplitude.hpp"

#include <gtest/gtest.h>

#include <cmath>

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

}  // namespace
}  // namespace kilotwin::identify
