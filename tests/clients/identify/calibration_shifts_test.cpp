// Calibration shifts of the camera: found at their times and with their sizes, in all runs or in one; no false
// alarms.
#include "clients/identify/search/calibration_shifts.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "core/random/random.hpp"

namespace kilotwin::identify {
namespace {

constexpr std::uint32_t kRobots = 8, kRuns = 2;

/// Robots without walls that drive straight, turn and rest, with wheel and tracker noise. `push` displaces robots
/// in the world, `seen` maps true poses to measured samples.
MeasuredSet played(std::uint64_t seed, const std::function<double(double time_s, bool driven)>& push_x_mm_s,
                   const std::function<void(std::uint32_t run, Sample&)>& seen) {
  const Random random(seed);
  const double dt = 0.02, factor_s = 0.001, tracker_mm = 0.5, tracker_rad = 0.03, duration_s = 60;
  MeasuredSet set;
  set.has_commands = set.has_headings = true;
  for (std::uint32_t run = 0; run < kRuns; ++run) {
    Run& made = set.runs.emplace_back();
    made.name = "r" + std::to_string(run);
    for (std::uint32_t robot = 0; robot < kRobots; ++robot) {
      Track& track = made.tracks.emplace_back();
      track.robot = robot;
      const std::uint32_t entity = 100 * run + robot;
      double x = 150.0 * (robot % 4) - 225, y = 300.0 * (robot / 4) - 150, heading = entity, next_s = 0;
      track.commands.push_back({-1e300, Motion::kStop});
      for (int k = 0; k * dt <= duration_s; ++k) {
        const double t = k * dt;
        const auto noise = [&](Stream stream, std::uint32_t draw) {
          return random.normal(stream, entity, Tick{k}, draw);
        };
        if (k % 25 == 0) {
          Sample sample{t, x + 9.2 * std::cos(heading), y + 9.2 * std::sin(heading), heading};
          seen(run, sample);
          sample.x_mm += tracker_mm * noise(Stream::kMeasurementNoise, 0);
          sample.y_mm += tracker_mm * noise(Stream::kMeasurementNoise, 1);
          sample.heading_rad =
              wrapped_angle(sample.heading_rad + tracker_rad * noise(Stream::kMeasurementNoise, 2));
          track.samples.push_back(sample);
        }
        if (t >= next_s - 1e-9) {
          const double draw = random.uniform(Stream::kLayout, entity, Tick{k}, 0);
          const auto last = static_cast<int>(track.commands.back().motion);
          track.commands.push_back({t, static_cast<Motion>((last + 1 + static_cast<int>(3 * draw)) % 4)});
          next_s = t + 1 + 3 * draw;
        }
        const Motion motion = track.commands.back().motion;
        const Eigen::Vector2d v = nominal_speeds(BaseParameters{}, motion);
        const double sd = std::sqrt(factor_s / dt);
        Rates rates;
        rates.left_mm_s = v[0] * (1 + sd * noise(Stream::kWheelFactor, 0));
        rates.right_mm_s = v[1] * (1 + sd * noise(Stream::kWheelFactor, 1));
        rates.drift_x_mm_s = push_x_mm_s(t, motion != Motion::kStop);
        const Arc arc = arc_of(rates, 25, heading, dt);
        x += arc.dx_mm;
        y += arc.dy_mm;
        heading += arc.dheading_rad;
      }
    }
  }
  return set;
}

double no_push(double, bool) { return 0; }

void shift_and_turn(Sample& s, double x_mm, double turn_rad) {
  const double c = std::cos(turn_rad), n = std::sin(turn_rad), x = s.x_mm;
  s.x_mm = c * x - n * s.y_mm + x_mm;
  s.y_mm = n * x + c * s.y_mm;
  s.heading_rad += turn_rad;
}

struct Found {
  MotionModel model;
  std::vector<CalibrationShift> shifts;
};
Found found_in(const MeasuredSet& set) {
  const Fitter fitter(set, 2);
  FitState state(set);
  fitter.fit_base(state);
  std::vector<CalibrationShift> shifts = add_calibration_shifts(fitter, state);
  return {state.model, std::move(shifts)};
}

TEST(CalibrationShifts, NoneWithAFixedCamera) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed)
    EXPECT_TRUE(found_in(played(seed, no_push, [](std::uint32_t, Sample&) {})).shifts.empty()) << seed;
}

TEST(CalibrationShifts, TimesAndSizesAreRecovered) {
  const Found found = found_in(played(4, no_push, [](std::uint32_t, Sample& s) {
    if (s.time_s >= 22.7 && s.time_s < 41.3) shift_and_turn(s, 4, 0.02);
  }));
  ASSERT_EQ(found.shifts.size(), 2u);
  for (const CalibrationShift& shift : found.shifts) {
    const bool first = shift.time_s < 30;
    EXPECT_FALSE(shift.run);
    EXPECT_NEAR(shift.time_s, first ? 22.7 : 41.3, 0.3);
    const double sign = first ? 1 : -1;
    EXPECT_NEAR(shift.size[0], sign * 4, 5 * shift.sd[0] + 0.1);
    EXPECT_NEAR(shift.size[2], sign * 0.02, 5 * shift.sd[2] + 1e-3);
    EXPECT_NEAR(shift.size[3], 0, 5 * shift.sd[3] + 1e-3);
  }
  // The fitted model predicts the shift of a robot at rest.
  Situation at;
  at.time_s = 30;
  const Eigen::Vector3d during = found.model.measured(100, 0, 0, at);
  at.time_s = 10;
  const Eigen::Vector3d before = found.model.measured(100, 0, 0, at);
  EXPECT_NEAR(during[0] - before[0], 4, 0.5);
  EXPECT_NEAR(during[1] - before[1], 0.02 * 109.2, 0.5);
  EXPECT_NEAR(during[2] - before[2], 0.02, 0.003);
}

TEST(CalibrationShifts, AShiftInOneRunBelongsToThatRun) {
  const Found found = found_in(played(5, no_push, [](std::uint32_t run, Sample& s) {
    if (run == 1 && s.time_s >= 31.2) shift_and_turn(s, -7, 0);
  }));
  ASSERT_EQ(found.shifts.size(), 1u);
  ASSERT_TRUE(found.shifts[0].run);
  EXPECT_EQ(*found.shifts[0].run, 1u);
  Situation at;
  at.time_s = 50;
  for (at.run = 0; at.run < 3; ++at.run)
    EXPECT_NEAR(found.model.measured(0, 0, 0, at)[0] - found.model.base.ahead_mm, at.run == 1 ? -7 : 0, 0.6);
}

// Robots at rest separate the two: a push displaces driven robots only.
TEST(CalibrationShifts, APushOfDrivenRobotsIsNoShift) {
  const auto push = [](double t, bool driven) { return driven && t >= 30.1 && t < 30.3 ? 40.0 : 0.0; };
  EXPECT_TRUE(found_in(played(6, push, [](std::uint32_t, Sample&) {})).shifts.empty());
}

}  // namespace
}  // namespace kilotwin::identify
