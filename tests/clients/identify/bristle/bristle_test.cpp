// Bristle plate tracks: planted effects are recovered; no effects in data without effects.
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <filesystem>
#include <set>

#include "clients/identify/bristle/bristle_model.hpp"
#include "clients/identify/bristle/identify_bristle.hpp"
#include "clients/identify/bristle/velocity_circle.hpp"

namespace kilotwin::bristle {
namespace {

/// The test's own random numbers.
class Noise {
 public:
  explicit Noise(std::uint64_t seed) : state_(seed * 2654435761u + 88172645463325252u) {}
  double uniform() {
    state_ ^= state_ << 13;
    state_ ^= state_ >> 7;
    state_ ^= state_ << 17;
    return static_cast<double>(state_ >> 11) * 0x1p-53;
  }
  double normal() {
    double sum = -6;
    for (int i = 0; i < 12; ++i) sum += uniform();
    return sum;
  }

 private:
  std::uint64_t state_;
};

struct Truth {
  bool mirrored = false, flips = false;
  double drift_x = 0, drift_y = 0, mount_rad = 0, turn_rad_s = 0;
};

std::vector<BristleRun> runs_of(const Truth& truth, std::uint64_t seed, std::size_t count) {
  std::vector<BristleRun> runs;
  for (std::size_t r = 0; r < count; ++r) {
    Noise noise(seed + r);
    BristleRun run;
    run.name = "run" + std::to_string(100 + r);
    const double speed = 80;
    double x = 0, y = 0, heading = 6 * noise.uniform();
    for (int i = 0; i < 15 * 60; ++i) {
      heading += 0.03 * noise.normal() + truth.turn_rad_s / 15;
      x += (speed * std::cos(heading) + truth.drift_x) / 15;
      y += (speed * std::sin(heading) + truth.drift_y) / 15;
      run.time_s.push_back(i / 15.0);
      run.x_mm.push_back(x + 0.3 * noise.normal());
      run.y_mm.push_back(y + 0.3 * noise.normal());
      const bool flipped = truth.flips && (i / 40 + static_cast<int>(r)) % 3 == 0;
      const double seen = (truth.mirrored ? -heading + 1.4 : heading) + truth.mount_rad +
                          (flipped ? 3.14159265 : 0) + 0.05 * noise.normal();
      run.heading_rad.push_back(std::remainder(seen, 2 * 3.14159265358979));
    }
    runs.push_back(std::move(run));
  }
  return runs;
}

std::set<std::string> found(const identify::Identified& identified) {
  std::set<std::string> names;
  for (const identification::Effect& effect : identified.found.result().effects()) names.insert(effect.name());
  return names;
}

double before_mm(const identify::Identified& identified) {
  return identified.found.result().before().rmse_mm().number_value();
}
double after_mm(const identify::Identified& identified) {
  return identified.found.result().after().rmse_mm().number_value();
}
double parameter(const identification::Effect& effect, const char* name) {
  return effect.parameters().fields().at(name).number_value();
}

identify::Options second() {
  identify::Options options;
  options.horizon_s = 1;
  return options;
}

identify::Identified all_stages(std::vector<BristleRun> train, std::vector<BristleRun> test,
                                const identify::Options& options) {
  return identify::identified_by(*bristle_study(std::move(train), std::move(test), options), options);
}

TEST(Bristle, NoEffectInDataWithoutEffects) {
  int alarms = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed)
    alarms += found(all_stages(runs_of({}, 1000 * seed, 12), {}, second())).empty() ? 0 : 1;
  EXPECT_LE(alarms, 1);
}

TEST(Bristle, ClockwiseHeadingsAreDetected) {
  const auto identified = all_stages(runs_of({.mirrored = true}, 50, 12), {}, second());
  EXPECT_TRUE(found(identified).contains("heading-sense"));
  EXPECT_LT(after_mm(identified), 0.25 * before_mm(identified));
  ASSERT_GE(identified.model.effect_size(), 1);
  EXPECT_NEAR(identified.model.effect(0).function(0).linear().at_zero(), 1.4, 0.1);
}

TEST(Bristle, ConfusedFrontAndBackIsDetectedToo) {
  const auto names = found(all_stages(runs_of({.mirrored = true, .flips = true}, 70, 12), {}, second()));
  EXPECT_TRUE(names.contains("heading-sense"));
  EXPECT_TRUE(names.contains("front-for-back"));
}

TEST(Bristle, AnInclineCausesADownhillDrift) {
  const auto identified =
      all_stages(runs_of({.mirrored = true, .drift_x = -32, .drift_y = 8}, 90, 12), {}, second());
  EXPECT_TRUE(found(identified).contains("downhill"));
  for (const identification::Effect& effect : identified.found.result().effects()) {
    if (effect.name() != "downhill") continue;
    // Relative to the speed of 80 mm/s. These robots hardly turn: the drift only shows across their headings.
    const double se = parameter(effect, "se");
    EXPECT_LT(se, 0.07);
    EXPECT_NEAR(parameter(effect, "x"), -0.4, 3 * se);
    EXPECT_NEAR(parameter(effect, "y"), 0.1, 3 * se);
  }
}

TEST(Bristle, TheSizeOfTheDriftDoesNotDependOnTheTrackersHeadings) {
  const auto identified = all_stages(
      runs_of({.mirrored = true, .flips = true, .drift_x = 24, .drift_y = 24, .mount_rad = 0.4, .turn_rad_s = 0.15},
              110, 12),
      {}, second());
  for (const identification::Effect& effect : identified.found.result().effects()) {
    if (effect.name() != "downhill") continue;
    // Displacements in half a second are chords of the arc, at most 1 % short.
    EXPECT_NEAR(parameter(effect, "x"), 0.3, 0.01);
    EXPECT_NEAR(parameter(effect, "y"), 0.3, 0.01);
  }
  EXPECT_TRUE(found(identified).contains("downhill"));
}

TEST(VelocityCircle, IsExactOnACircleAndKeepsThePriorOnAPoint) {
  std::vector<std::complex<double>> circle, point;
  for (int i = 0; i < 40; ++i) {
    circle.push_back(std::complex<double>(12, -5) + std::polar(50.0, 0.3 * i));
    point.push_back({60, 0});
  }
  circle[7] = {400, 0};  // an outlier
  const VelocityCircle exact = fit_circle(circle, 0, 0);
  EXPECT_NEAR(exact.speed_mm_s, 50, 0.5);
  EXPECT_NEAR(exact.drift.real(), 12.0 / 50, 0.01);
  EXPECT_NEAR(exact.drift.imag(), -5.0 / 50, 0.01);
  const VelocityCircle prior_share = fit_circle(point, 0.2, 6);
  EXPECT_NEAR(prior_share.prior_share, 1, 1e-9);
  EXPECT_NEAR(prior_share.drift.real(), 0.2, 0.02);
  EXPECT_NEAR(prior_share.speed_mm_s, 50, 1);
}

TEST(Bristle, ImplausibleRowsAreRemoved) {
  BristleRun run = runs_of({}, 1, 1)[0];
  run.x_mm[100] += 300;
  run.y_mm[101] -= 400;
  drop_implausible_rows(run);
  EXPECT_EQ(run.dropped, 2u);
  EXPECT_EQ(run.size(), 898u);
}

TEST(Bristle, TheMeasuredRunsShowTrackerEffects) {
  const std::filesystem::path data = std::filesystem::path(KILOTWIN_SOURCES) / "../shared/data/bristle";
  if (!std::filesystem::exists(data))
    GTEST_SKIP() << "there is no " << data << ": the measured runs are not part of the project";
  ASSERT_TRUE(has_bristle_runs(data));
  const auto identified = all_stages(read_bristle_runs(data), {}, second());
  const auto names = found(identified);
  EXPECT_TRUE(names.contains("heading-sense"));
  EXPECT_TRUE(names.contains("front-for-back"));
  EXPECT_LT(after_mm(identified), 0.75 * before_mm(identified));
  // Runs differ by more than the effects, so gains are counted per run.
  for (const identification::Effect& effect : identified.found.result().effects()) {
    const identification::Evidence& evidence = effect.evidence();
    EXPECT_GT(evidence.held_out_gain().number_value(), evidence.held_out_gain_se().number_value()) << effect.name();
  }
}

}  // namespace
}  // namespace kilotwin::bristle
