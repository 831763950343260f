// Errors of tracks whose samples lie beside the predicted times.
#include <gtest/gtest.h>

#include <cmath>

#include "clients/identify/fit/fitter.hpp"
#include "clients/identify/identify.hpp"
#include "clients/identify/predict/evaluation.hpp"
#include "tests/identify/small_set.hpp"

namespace kilotwin {
namespace {

/// Nearly without noise, so that the error shows where a prediction refers to another time than its sample.
truth::Scene quiet() {
  truth::Scene scene = small({});
  scene.factor_sd = 0.005;
  scene.bias_sd_mm_s = 0.2;
  scene.tracker_sd_mm = 0.05;
  scene.heading_sd_rad = 0.002;
  scene.missing = 0;
  scene.contacts = false;
  scene.width_mm = scene.height_mm = 0;
  scene.train_s = 60;
  return scene;
}

identify::PredictionErrors errors_in(const identify::MeasuredSet& set) {
  identify::FitState base(set);
  identify::Fitter(set, 2).fit_base(base);
  return identify::errors_of(set,
                             identify::forecast(base.model, base.tracks, {10, 5, 10}, identify::Tracks::kAll, 2));
}

TEST(Sampling, ErrorsReferToTheTimesOfSamples) {
  const truth::Scene regular = quiet();
  truth::Scene jittered = regular;
  jittered.jitter = 0.4;
  const identify::PredictionErrors at_times = errors_in(set_of(regular, played(regular))),
                                   beside = errors_in(set_of(jittered, played(jittered)));
  // At 10 mm/s a sample 0.12 s off its time shows an error of 1.2 mm.
  EXPECT_LT(at_times.rmse_mm(), 0.6);
  EXPECT_LT(beside.rmse_mm(), 1.3 * at_times.rmse_mm());
  EXPECT_GE(beside.rows, at_times.rows);
}

TEST(Sampling, FramesMayBeShifted) {
  const truth::Scene scene = quiet();
  identify::MeasuredSet set = set_of(scene, played(scene));
  const std::size_t rows = errors_in(set).rows;
  for (identify::Run& run : set.runs)
    for (identify::Track& track : run.tracks) {
      for (identify::Sample& s : track.samples) s.time_s += 0.2;
      for (identify::CommandChange& change : track.commands) change.time_s += 0.2;
    }
  const identify::PredictionErrors shifted = errors_in(set);
  // Each track lacks the first prediction: nothing is measured one horizon before.
  EXPECT_EQ(shifted.rows, rows - set.tracks());
  EXPECT_LT(shifted.rmse_mm(), 0.6);
}

TEST(Sampling, SetsWithJitterGetAnError) {
  for (const std::uint64_t seed : {40000U, 40004U}) {
    truth::Scene scene = truth::nothing_to_find(seed);
    ASSERT_GT(scene.jitter, 0);
    const truth::Play play = played(scene, seed);
    const identify::MeasuredSet train = set_of(scene, play);
    truth::Play of_test = play;
    of_test.train = play.test;
    const identify::MeasuredSet test = set_of(scene, of_test);
    identify::Options options;
    options.find_effects = false;
    const identification::Result result = identify::identify(train, &test, options).found.result();
    // 60 s: predictions for 10, 15... 60 s of each robot, less those of frames that miss it.
    EXPECT_GT(result.after().rows(), 8 * static_cast<std::uint32_t>(scene.robots)) << seed;
    EXPECT_GT(result.after().rmse_mm().number_value(), 0) << seed;
  }
}

}  // namespace
}  // namespace kilotwin
