/// How a robot that is always on goes, and what a base model without knowledge of the table and the tracker leaves out.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "clients/identify/bristle/bristle_set.hpp"

namespace kilotwin::bristle {

/// What may be added to the base model, which goes straight where the tracker says it heads, all runs at one speed.
enum class RideEffect : std::uint8_t {
  kSense,  ///< the tracker counts headings the other way round, and from another axis
  kMount,  ///< ... and from an axis of each robot's own
  kAxis,   ///< it takes the front for the back at times
  kSpeed,  ///< each run has a speed of its own
  kDrift,  ///< something carries the robot along an axis of the room, in proportion to its speed
  kTurn,   ///< each run has a turn rate of its own
};
inline constexpr std::size_t kRideEffects = 6;
using RideEffects = std::array<bool, kRideEffects>;

/// What is known of a run at one instant, from its past alone, and where it was a horizon later.
struct RideInstant {
  std::size_t run;                      ///< index
  double time_s;                        ///< of what is predicted
  double x_mm, y_mm, vx_mm_s, vy_mm_s;  ///< by a line through the last half second
  double heading_rad;                   ///< as measured: mean over it
  double axis_rad;                      ///< the same, front and back not told apart
  double later_x_mm, later_y_mm;
};

class RideModel {
 public:
  /// Fits what is common to all runs to instants of runs. Each run's own values come from its past.
  explicit RideModel(const std::vector<RideInstant>& train);

  struct Place {
    double x_mm, y_mm;
  };
  /// Predictions for instants, which stand in order of time within each run.
  [[nodiscard]] std::vector<Place> predict(const std::vector<RideInstant>&, double horizon_s,
                                           const RideEffects&) const;

  double speed_mm_s = 0;            ///< median
  double sense_rad = 0;             ///< heading = sense_rad - measured heading
  double drift_x = 0, drift_y = 0;  ///< of the speed, in the median over runs that went in many directions
  double drift_se = 1;              ///< of either, by the spread of these runs
  std::size_t drift_runs = 0;
  double drift_sd = 0;  ///< between runs, of either
  double drift_p = 1;   ///< chance of a mean as far from 0 over these runs, were it 0 (Hotelling)
  double aligned = 0,
         aligned_turned = 0;  ///< 0..1: how well the way goes with the heading as measured, and the other way round
  double aligned_axis = 0;    ///< the same where front and back are not told apart
};

[[nodiscard]] std::vector<RideInstant> instants_of(const std::vector<RiddenRun>&, double horizon_s);

/// What a run says of itself: for the table of runs.
struct RideSummary {
  std::string run;
  double speed_mm_s, drift_x_mm_s, drift_y_mm_s, turn_rad_s, mount_rad;
};
[[nodiscard]] std::vector<RideSummary> summaries_of(const RideModel&, const std::vector<RiddenRun>&,
                                                    const std::vector<RideInstant>&);

}  // namespace kilotwin::bristle
