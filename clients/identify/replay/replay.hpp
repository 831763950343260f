/// Measured runs once more, in the simulator: robots of a written model start where measured ones were seen first, are told the
/// same, and are looked at by the simulator's tracker at the same times. The walls are those that the measured robots showed.
#pragma once

#include <cstdint>
#include <vector>

#include "clients/identify/fit/fitter.hpp"
#include "idl/model.pb.h"

namespace kilotwin::identify {

/// Of one run, as the simulator is to play it.
struct Scene {
  struct Robot {
    const Track* track = nullptr;                ///< what it is told, and when it is looked at
    double x_mm = 0, y_mm = 0, heading_rad = 0;  ///< of the disc's centre, at the first sample
  };
  Room room;
  bool contacts = true;   ///< robots push each other: the planar engine; else the kinematic one
  std::uint32_t run = 0;  ///< the covariate RUN
  std::vector<Robot> robots;

  /// Of the last sample.
  [[nodiscard]] double duration_s() const;
};

/// The scene of a run; headings at the start as PreparedSet::find_headings left them.
[[nodiscard]] Scene scene_of(const MotionModel&, const PreparedSet&, std::size_t run);

/// What the tracker sees of each robot of the scene, at the times of its samples; headings where they were measured. A robot
/// rests until its first sample. The same for the same arguments.
[[nodiscard]] std::vector<std::vector<Sample>> play(const Scene&, const proto::Model&, std::uint64_t seed);

/// Robots times ticks that play() steps through: what it costs.
[[nodiscard]] double robot_ticks(const Scene&);

/// Runs longer than this are not played, s.
inline constexpr double kLongestPlay_s = 1e5;

}  // namespace kilotwin::identify
