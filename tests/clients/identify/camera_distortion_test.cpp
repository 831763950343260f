// Camera distortion: contacts away from the fitted walls are noticed, and the walls are straight again once a map
// removes the distortion.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "clients/identify/fit/fitter.hpp"
#include "clients/identify/search/central_distortion.hpp"
#include "clients/identify/search/shape_refinement.hpp"
#include "core/random/random.hpp"

namespace kilotwin::identify {
namespace {

constexpr double kWide_mm = 220, kHigh_mm = 180;  ///< half the sides of the area of disc centres
constexpr double kBarrel = 0.15;

/// The place at which a point of the floor is seen.
using Picture = std::function<Eigen::Vector2d(double x_mm, double y_mm)>;

/// Shrinks the image by `bent` at the corners, with an even power of the distance from its middle.
Picture lens(double bent, int power = 2) {
  return [bent, power](double x_mm, double y_mm) -> Eigen::Vector2d {
    const double square = (x_mm * x_mm + y_mm * y_mm) / (kWide_mm * kWide_mm + kHigh_mm * kHigh_mm);
    return (1 - bent * std::pow(square, power / 2)) * Eigen::Vector2d(x_mm, y_mm);
  };
}

/// Moves rows of the picture sideways, which no scale about a centre does.
Eigen::Vector2d sheared(double x_mm, double y_mm) { return {x_mm + 12 * std::sin(y_mm / 60), y_mm}; }

/// Robots without mutual collisions between walls, simulated with arcs of 50 ms, seen through a camera.
MeasuredSet behind_walls(const Picture& seen) {
  const Random random(21);
  const double dt = 0.05, factor_s = 0.001, tracker_mm = 0.3, tracker_rad = 0.03, duration_s = 150;
  MeasuredSet set;
  set.has_commands = set.has_headings = true;
  Run& run = set.runs.emplace_back();
  for (std::uint32_t r = 0; r < 8; ++r) {
    Track& track = run.tracks.emplace_back();
    track.robot = r;
    track.commands.push_back({-1e300, Motion::kStop});
    double x = 90.0 * (r % 4) - 135, y = 90.0 * (r / 4) - 45, heading = 1.7 * r, next_s = 0;
    for (int k = 0; k * dt <= duration_s; ++k) {
      const double t = k * dt;
      const auto noise = [&](Stream stream, std::uint32_t draw) { return random.normal(stream, r, Tick{k}, draw); };
      if (k % 10 == 0) {
        const Eigen::Vector2d at = seen(x, y);
        track.samples.push_back({t, at[0] + tracker_mm * noise(Stream::kMeasurementNoise, 0),
                                 at[1] + tracker_mm * noise(Stream::kMeasurementNoise, 1),
                                 wrapped_angle(heading + tracker_rad * noise(Stream::kMeasurementNoise, 2))});
      }
      if (t >= next_s - 1e-9) {
        const bool straight = track.commands.back().motion != Motion::kStraight;
        const double draw = random.uniform(Stream::kLayout, r, Tick{k}, 0);
        track.commands.push_back({t, straight ? Motion::kStraight : draw < 0.5 ? Motion::kLeft : Motion::kRight});
        next_s = t + (straight ? 5 + 10 * draw : 1 + 2 * draw);
      }
      const Eigen::Vector2d v = nominal_speeds(BaseParameters{}, track.commands.back().motion);
      const double sd = std::sqrt(factor_s / dt);
      Rates rates;
      rates.left_mm_s = v[0] * (1 + sd * noise(Stream::kWheelFactor, 0));
      rates.right_mm_s = v[1] * (1 + sd * noise(Stream::kWheelFactor, 1));
      const double axle = BaseParameters{}.centre_mm;
      const Arc arc = arc_of(rates, 25, heading, dt);
      const double from_x = x - axle * std::cos(heading), from_y = y - axle * std::sin(heading);
      heading += arc.dheading_rad;
      x = std::clamp(from_x + arc.dx_mm + axle * std::cos(heading), -kWide_mm, kWide_mm);
      y = std::clamp(from_y + arc.dy_mm + axle * std::sin(heading), -kHigh_mm, kHigh_mm);
    }
  }
  return set;
}

/// A camera map with coefficients 0.
Term camera_map() {
  Factor plane;
  plane.shape = Factor::Shape::kPolynomials2;
  plane.axis.of = Covariate::kX;
  plane.and_axis.of = Covariate::kY;
  plane.low = -250;
  plane.high = 250;
  plane.and_low = -210;
  plane.and_high = 210;
  plane.count = 3;
  const Basis basis{{plane}};
  const auto columns = 2 * static_cast<Eigen::Index>(basis.size());
  return {"camera-by-position",
          {{Target::kMeasuredX, basis, kAlways}, {Target::kMeasuredY, basis, kAlways}},
          Eigen::VectorXd::Zero(columns),
          Eigen::VectorXd::Constant(columns, 1 / (30.0 * 30.0))};
}

TEST(CameraDistortion, WallsAreCertainWithoutDistortion) {
  const MeasuredSet set = behind_walls(lens(0));
  const Fitter fitter(set, 2);
  FitState state(set);
  MotionModel& model = state.model;
  fitter.fit_base(state);
  EXPECT_FALSE(model.walls_uncertain);
  EXPECT_NEAR(model.walls.x_high_mm, kWide_mm, 3);
  EXPECT_NEAR(model.walls.y_low_mm, -kHigh_mm, 3);
  // After a forced doubt the walls are accepted again.
  model.walls_uncertain = true;
  fitter.fit_contacts(state);
  EXPECT_FALSE(model.walls_uncertain);
  EXPECT_NEAR(model.walls.x_high_mm, kWide_mm, 3);
}

TEST(CameraDistortion, WallsAreUncertainUntilAMapRemovesTheDistortion) {
  const MeasuredSet set = behind_walls(lens(kBarrel));
  const Fitter fitter(set, 2);
  FitState state(set);
  MotionModel& model = state.model;
  fitter.fit_base(state);
  ASSERT_TRUE(model.walls_uncertain);
  model.terms.push_back(camera_map());
  fitter.fit(state, 2);
  EXPECT_FALSE(model.walls_uncertain);
  // Walls in the world. The scale follows from the priors of the speeds only.
  EXPECT_NEAR((model.walls.x_high_mm - model.walls.x_low_mm) / (model.walls.y_high_mm - model.walls.y_low_mm),
              kWide_mm / kHigh_mm, 0.02);
  EXPECT_NEAR(model.walls.x_high_mm - model.walls.x_low_mm, 2 * kWide_mm, 20);
}

/// A model with a refined map of a picture, before and after the form of a lens was tried.
struct Fits {
  FitState free, central;
  double evidence_free = 0, evidence_central = 0;
};
Fits fits_of(const MeasuredSet& set) {
  const Fitter fitter(set, 2);
  FitState state(set);
  fitter.fit_base(state);
  state.model.terms.push_back(camera_map());
  fitter.fit(state, 2);
  refine_curves(fitter, state, 0);
  Fits out{state, state, fitter.log_evidence(state), 0};
  fit_central_distortion(fitter, out.central, 0);
  out.evidence_central = fitter.log_evidence(out.central);
  return out;
}
bool has_scale(const FitState& state) {
  const std::vector<Block>& blocks = state.model.terms.front().blocks;
  return std::any_of(blocks.begin(), blocks.end(),
                     [](const Block& block) { return block.target == Target::kMeasuredScale; });
}

TEST(CameraDistortion, ALensBecomesAScaleOfThePicture) {
  // A map of low order holds a lens of the second power. This one is of the fourth.
  const Fits fits = fits_of(behind_walls(lens(kBarrel, 4)));
  EXPECT_FALSE(has_scale(fits.free));
  EXPECT_TRUE(has_scale(fits.central));
  EXPECT_GT(fits.evidence_central, fits.evidence_free);
}

TEST(CameraDistortion, APictureThatNoScaleExplainsKeepsItsMap) {
  const Fits fits = fits_of(behind_walls(sheared));
  EXPECT_FALSE(has_scale(fits.central));
  EXPECT_EQ(fits.evidence_central, fits.evidence_free);
}

}  // namespace
}  // namespace kilotwin::identify
