/// Simulation of measured runs with the fitted model. Robots start at the first measured poses and follow the
/// recorded commands; the simulated tracker samples them at the measured times. Walls are those of the fit.
#pragma once

#include <cstdint>
#include <vector>

#include "clients/identify/fit/fitter.hpp"
#include "idl/model.pb.h"

namespace kilotwin::identify {

/// One run as the simulator executes it.
struct Scene {
  struct Robot {
    const Track* track = nullptr;                ///< its commands and sample times
    double x_mm = 0, y_mm = 0, heading_rad = 0;  ///< disc centre at the first sample
  };
  Walls walls;
  bool contacts = true;      ///< true: the planar engine, robots collide; false: the kinematic engine
  std::uint32_t run = 0;     ///< value of the covariate RUN
  double command_lag_s = 0;  ///< as in BaseParameters
  std::vector<Robot> robots;

  /// Time of the last sample, s.
  [[nodiscard]] double duration_s() const;
};

/// The scene of a run. Initial headings: as PreparedSet::find_headings left them.
[[nodiscard]] Scene scene_of(const MotionModel&, const PreparedSet&, std::size_t run);

/// Samples of each robot at its measured times, with headings if they were measured. A robot rests until its first
/// sample. Deterministic in its arguments.
[[nodiscard]] std::vector<std::vector<Sample>> play(const Scene&, const proto::Model&, std::uint64_t seed);

/// Robots times ticks of a simulation: its cost.
[[nodiscard]] double robot_ticks(const Scene&);

/// Longest run that is simulated, s.
inline constexpr double kLongestPlay_s = 1e5;

}  // namespace kilotwin::identify
