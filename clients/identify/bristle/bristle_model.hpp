/// Motion of robots with constantly driven motors on a bristle plate, and effects of table and tracker on it.
#pragma once

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "clients/identify/bristle/bristle_set.hpp"

namespace kilotwin::bristle {

/// Effects that may be added to the base model. The base model drives straight along the measured heading, with
/// one speed for all runs.
enum class BristleEffect : std::uint8_t {
  kSense,  ///< the tracker's headings run clockwise and have an offset
  kMount,  ///< the offset differs between robots
  kAxis,   ///< the tracker sometimes confuses front and back
  kSpeed,  ///< speed per run
  kDrift,  ///< drift along an axis of the world, proportional to the speed
  kTurn,   ///< turn rate per run
};
inline constexpr std::size_t kBristleEffects = 6;
/// Limit of effects on speeds in the model file (Motion.effects_limit_mm_s). `speed_mm_s`: of the robots.
[[nodiscard]] constexpr double effects_limit_mm_s(double speed_mm_s) { return std::max(50.0, 2 * speed_mm_s); }

using BristleEffects = std::array<bool, kBristleEffects>;

/// Observations of a run at one instant, from its past only, and the position one horizon later.
struct BristleInstant {
  std::size_t run;                      ///< index
  double time_s;                        ///< of the prediction
  double x_mm, y_mm, vx_mm_s, vy_mm_s;  ///< by a line through the last half second
  double heading_rad;                   ///< as measured, mean over half a second
  double axis_rad;                      ///< axis of the heading, without sign
  double later_x_mm, later_y_mm;
};

class BristleModel {
 public:
  /// Without any fit.
  BristleModel() = default;
  /// Fits the population parameters. Parameters of single runs follow from their past.
  explicit BristleModel(const std::vector<BristleInstant>& train);

  struct Place {
    double x_mm, y_mm;
  };
  /// Predictions for instants, which must ascend in time within each run.
  [[nodiscard]] std::vector<Place> predict(const std::vector<BristleInstant>&, double horizon_s,
                                           const BristleEffects&) const;

  double speed_mm_s = 0;            ///< median
  double sense_rad = 0;             ///< heading = sense_rad - measured heading
  double drift_x = 0, drift_y = 0;  ///< relative to the speed; median over runs whose directions average out
  double drift_se = 1;              ///< per axis, by the spread of these runs
  std::size_t drift_runs = 0;
  double drift_sd = 0;  ///< between runs, per axis
  double drift_p = 1;   ///< p value of zero mean drift over these runs (Hotelling)
  double aligned = 0,
         /// 0..1: alignment of the motion with the measured heading, and with the reversed sense of rotation
      aligned_turned = 0;
  double aligned_axis = 0;  ///< the same for the axis without sign
};

[[nodiscard]] std::vector<BristleInstant> instants_of(const std::vector<BristleRun>&, double horizon_s);

/// Estimates of one run, for the table of runs.
struct BristleSummary {
  std::string run;
  double speed_mm_s, drift_x_mm_s, drift_y_mm_s, turn_rad_s, mount_rad;
};
[[nodiscard]] std::vector<BristleSummary> summaries_of(const BristleModel&, const std::vector<BristleRun>&,
                                                       const std::vector<BristleInstant>&);

}  // namespace kilotwin::bristle
