// Stalls and slips as rare events: their law, the filter that finds spells, and the effect that is written.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "clients/identify/fit/filter_bank.hpp"
#include "clients/identify/fit/fitter.hpp"
#include "clients/identify/fit/spell_scan.hpp"
#include "clients/identify/model/model_file.hpp"
#include "clients/identify/stall_effect.hpp"
#include "tests/identify/small_set.hpp"
#include "tests/identify/truth/laboratory_effects.hpp"

namespace kilotwin {
namespace {

using namespace identify;

Stalls of_shape(double shape) {
  Stalls stalls;
  stalls.mean_apart_s = 40;
  stalls.scale_s = 6;
  stalls.tail = 2.5;
  stalls.shape = shape;
  stalls.longest_s = 200;
  return stalls;
}

class StallsOfShape : public testing::TestWithParam<double> {};

INSTANTIATE_TEST_SUITE_P(LomaxAndBurr, StallsOfShape, testing::Values(1.0, 3.0));

TEST_P(StallsOfShape, MomentsAreThoseOfTheirLaw) {
  const Stalls stalls = of_shape(GetParam());
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> uniform(1e-12, 1);
  // The mean duration, and moments of the time in spells during 10 s from a random instant on.
  double lengths = 0;
  constexpr int kDraws = 200000;
  for (int i = 0; i < kDraws; ++i) lengths += stalls.length_s(uniform(random));
  EXPECT_NEAR(lengths / kDraws, stalls.mean_length_s(), 0.02 * stalls.mean_length_s());
  double sum = 0, square = 0;
  constexpr double kOver_s = 10;
  for (int i = 0; i < kDraws; ++i) {
    bool in = uniform(random) < stalls.share();
    double left_s = in ? stalls.rest_s(uniform(random)) : -stalls.mean_apart_s * std::log(uniform(random));
    double rest_s = kOver_s, in_s = 0;
    while (rest_s > 0) {
      const double now_s = std::min(left_s, rest_s);
      if (in) in_s += now_s;
      rest_s -= now_s;
      in = !in;
      left_s = in ? stalls.length_s(uniform(random)) : -stalls.mean_apart_s * std::log(uniform(random));
    }
    sum += in_s;
    square += in_s * in_s;
  }
  EXPECT_NEAR(sum / kDraws / kOver_s, stalls.share(), 0.02 * stalls.share());
  const double variance_s = (square / kDraws - std::pow(sum / kDraws, 2)) / kOver_s;
  EXPECT_NEAR(variance_s, stalls.variance_s(kOver_s), 0.1 * variance_s);
}

TEST_P(StallsOfShape, ASpellThatHasLastedGoesOnAsOthersDid) {
  const Stalls stalls = of_shape(GetParam());
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> uniform(1e-12, 1);
  constexpr double kLasted_s = 3, kMore_s = 2;
  constexpr int kDraws = 200000;
  double lasted = 0, longer = 0, drawn = 0;
  for (int i = 0; i < kDraws; ++i) {
    const double length_s = stalls.length_s(uniform(random));
    lasted += length_s > kLasted_s;
    longer += length_s > kLasted_s + kMore_s;
    drawn += stalls.rest_after_s(kLasted_s, uniform(random)) > kMore_s;
  }
  const double share = longer / lasted;
  EXPECT_NEAR(drawn / kDraws, share, 4 * std::sqrt(share * (1 - share) / lasted));
}

TEST_P(StallsOfShape, DurationsAreFittedWithCensoring) {
  Stalls truth;
  truth.scale_s = 8;
  truth.tail = 3;
  truth.shape = GetParam();
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> uniform(1e-12, 1);
  constexpr double kSeen_s = 6, kLeast_s = 0.25;
  std::vector<Spell> spells;
  for (int i = 0; i < 4000; ++i) {
    const double length_s = truth.length_s(uniform(random));
    if (length_s > kLeast_s) spells.push_back({0, std::min(length_s, kSeen_s), length_s > kSeen_s});
  }
  Stalls fitted = truth;
  fit_lengths(spells, kLeast_s, fitted);
  EXPECT_NEAR(fitted.mean_length_s(), truth.mean_length_s(), 0.25 * truth.mean_length_s());
  for (const double t : {0.5, 2.0, 5.0}) EXPECT_NEAR(fitted.survival(t), truth.survival(t), 0.03);
}

TEST_P(StallsOfShape, IntervalsOfTheMeanDurationHoldIt) {
  Stalls truth = of_shape(GetParam());
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> uniform(1e-12, 1);
  constexpr double kLeast_s = 0.25;
  constexpr int kSets = 60, kSpells = 60;
  int holds = 0;
  for (int k = 0; k < kSets; ++k) {
    std::vector<Spell> spells;
    while (spells.size() < kSpells)
      if (const double length_s = truth.length_s(uniform(random)); length_s > kLeast_s)
        spells.push_back({0, length_s, false});
    const auto [low, high] = mean_length_interval_s(spells, kLeast_s, truth);
    holds += low <= truth.mean_length_s() && truth.mean_length_s() <= high ? 1 : 0;
  }
  // 57 are expected; below 52 with a probability of 1 %.
  EXPECT_GE(holds, 52);
}

/// A base model fitted to a scene, and the stalls that are found beside it.
struct WithStalls : BaseFit {
  explicit WithStalls(const truth::Scene& scene, std::uint64_t seed = 5) : BaseFit(scene, seed) {
    base = state.model;
    found = find_stalls(fitter, state);
  }
  MotionModel base;
  std::optional<StallEffect> found;
};

TEST(Stalls, AreFoundWithTheirParametersAndWritten) {
  truth::Scene scene = small({truth::rare_spells({30, 6, 2.5, 0})});
  scene.train_runs = 3;
  const WithStalls f(scene);
  ASSERT_TRUE(f.found);
  const Stalls& stalls = f.found->stalls;
  EXPECT_EQ(stalls.gain, 0);
  EXPECT_NEAR(stalls.mean_apart_s, 30, 6);
  EXPECT_NEAR(stalls.mean_length_s(), 4, 1.2);
  EXPECT_GT(f.found->held_out, 100);
  EXPECT_LT(f.found->mean_apart_s.first, stalls.mean_apart_s);
  EXPECT_GT(f.found->mean_apart_s.second, stalls.mean_apart_s);
  EXPECT_LT(f.found->mean_length_s.first, 4);
  EXPECT_GT(f.found->mean_length_s.second, 4);
  EXPECT_FALSE(f.found->speed);
  // The noise and the speeds are those beside the spells. With a spell every 30 s the noise keeps a remainder.
  const double truth_s = scene.factor_sd * scene.factor_sd * scene.step_s;
  EXPECT_LT(f.state.model.noise.factor_s, 2 * truth_s);
  EXPECT_GT(f.state.model.noise.factor_s, 0.5 * truth_s);
  EXPECT_LT(f.state.model.noise.factor_s + f.state.model.noise.wheel_mm2_s,
            f.base.noise.factor_s + f.base.noise.wheel_mm2_s);
  EXPECT_NEAR(f.state.model.base.straight_mm_s + f.state.model.base.bias_mean_mm_s, 10.0, 0.5);
  const proto::Model model = proto_of(f.state.model);
  int written = 0;
  for (const proto::Effect& effect : model.effect()) {
    if (effect.name() != "stalls") continue;
    ++written;
    EXPECT_EQ(effect.acts_on(), proto::Effect::WHEEL_GAIN);
    EXPECT_EQ(effect.function(0).constant(), -1);
    EXPECT_NEAR(effect.function(1).episodes().mean_apart_s(), stalls.mean_apart_s, 1e-3);
    EXPECT_NEAR(effect.function(1).episodes().tail(), stalls.tail, 1e-3);
  }
  EXPECT_EQ(written, 1);
}

TEST(Stalls, SharesOfIntervalsAreShares) {
  // A share above 1 would have a negative variance, and nothing beside the spells could be fitted.
  const WithStalls f(small({truth::rare_spells({15, 2, 1.2, 0})}));
  ASSERT_TRUE(f.found);
  for (const TrackView& view : f.state.tracks.views()) {
    ASSERT_NE(view.spells, nullptr);
    for (const float share : *view.spells) EXPECT_TRUE(share >= 0 && share <= 1) << share;
  }
  EXPECT_NE(f.state.model.base.straight_mm_s, f.base.base.straight_mm_s) << "fitted again beside the spells";
}

TEST(Stalls, SlipsHaveASpeed) {
  const WithStalls f(small({truth::rare_spells({30, 9, 3, 0.4})}));
  ASSERT_TRUE(f.found);
  EXPECT_NEAR(f.found->stalls.gain, 0.4, 0.1);
  ASSERT_TRUE(f.found->speed);
  // Three standard errors.
  const double half = (f.found->speed->second - f.found->speed->first) / 2;
  EXPECT_LT(std::abs(f.found->stalls.gain - 0.4), 1.5 * half);
  EXPECT_LT(half, 0.1);
}

/// The probability that a robot is in a spell, by its motion up to the time.
double in_spell(const FilterBank& bank) {
  double in = 0, all = 0;
  for (const FilterBank::Hypothesis& h : bank.hypotheses()) {
    all += std::exp(h.log_weight);
    if (h.spell && h.spell->in_spell) in += std::exp(h.log_weight);
  }
  return in / all;
}

TEST(Stalls, AreKnownFromThePastWhereAForecastStarts) {
  // Brier scores where the motion shows clearly whether a robot stands: of the filter, and of the share of the time in spells.
  truth::Scene scene = small({truth::rare_spells({30, 6, 2.5, 0})});
  const WithStalls f(scene);
  ASSERT_TRUE(f.found);
  double score = 0, of_share = 0, count = 0;
  for (const TrackView& view : f.state.tracks.views()) {
    FilterBank bank(f.state.model, view);
    const std::vector<Sample>& samples = view.track->samples;
    for (std::size_t i = 4; i < samples.size(); ++i) {
      bank.advance_to(samples[i].time_s);
      const double moved_mm =
                       std::hypot(samples[i].x_mm - samples[i - 4].x_mm, samples[i].y_mm - samples[i - 4].y_mm),
                   turned_rad = std::abs(wrapped_angle(samples[i].heading_rad - samples[i - 4].heading_rad)),
                   length_s = samples[i].time_s - samples[i - 4].time_s;
      const CommandState command = view.clock->at(samples[i].time_s - 1e-9);
      if (!command.driven() || command.since_s < 2 * length_s) continue;
      // Walls and other robots hold robots, too.
      constexpr double kClear_mm = 30;
      const double nearest_mm = view.neighbours->view(view.place, samples[i].time_s).nearest_mm;
      if (f.state.model.walls.at_wall(samples[i].x_mm, samples[i].y_mm, kClear_mm) || nearest_mm < 33 + kClear_mm)
        continue;
      // Clear cases only: it stood, or it moved.
      const bool stood =
          moved_mm < 1.5 && turned_rad<0.08, moves = moved_mm> 6 * length_s || turned_rad > 0.2 * length_s;
      if (stood == moves) continue;
      const double in = stood ? 1 : 0, share = f.found->stalls.share();
      score += std::pow(in_spell(bank) - in, 2);
      of_share += std::pow(share - in, 2);
      count += 1;
    }
  }
  EXPECT_GT(count, 500);
  EXPECT_LT(score, 0.3 * of_share);
}

TEST(Stalls, AreNotFoundInNoise) {
  EXPECT_FALSE(WithStalls(small({})).found);
  EXPECT_FALSE(WithStalls(small({truth::heavy_tailed_noise()})).found) << "a heavy tail";
  truth::Scene coarse = small({});
  coarse.coarse = 0.04;
  EXPECT_FALSE(WithStalls(coarse).found) << "positions that are off";
  truth::Scene crowded = small({});
  crowded.width_mm = crowded.height_mm = 400;
  EXPECT_FALSE(WithStalls(crowded).found) << "robots that block each other";
}

TEST(Stalls, AreNoMatterOfObstacles) {
  const truth::Scene scene = small({});
  auto&& [set, fitter, state] = BaseFit(scene);
  const SpellScan scan(state, 2);
  // Shares in spells: of every third interval, or of those close to another robot.
  const auto found = [&](bool close) {
    SpellScan::Found out;
    for (const TrackView& view : scan.views()) {
      TrackSpells& track = out.tracks.emplace_back();
      for (std::size_t i = 0; i < view.track->samples.size(); ++i) {
        const double nearest_mm = view.neighbours->view(view.place, view.track->samples[i].time_s).nearest_mm;
        track.share.push_back((close ? nearest_mm < 60 : i % 3 == 0) ? 1.F : 0.F);
      }
    }
    return out;
  };
  EXPECT_NEAR(scan.share_at_obstacles(found(false), state.model), 1, 0.15);
  EXPECT_GT(scan.share_at_obstacles(found(true), state.model), 5);
}

}  // namespace
}  // namespace kilotwin
