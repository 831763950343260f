/// Stalls and slips: spells in which the wheels of a robot stand still, or slip, although a motor is on (model/stalls.hpp). They occur at
/// random, so the search for terms cannot find them. They are searched after it, by a filter with hypotheses of spells.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>

#include "clients/identify/fit/fitter.hpp"
#include "idl/identification.pb.h"

namespace kilotwin::identify {

/// As of effects on the noise.
inline constexpr double kStallThreshold_log10_p = -5;

struct StallEffect {
  Stalls stalls;
  std::size_t spells = 0;     ///< in the tracks of the fit
  double log10_p = 0;         ///< of the likelihood ratio
  std::uint32_t degrees = 0;  ///< parameters of the stalls
  double gain = 0;            ///< of the log likelihood, nat
  double held_out = 0,
         held_out_se = 0;  ///< the same in cross-validation over robots, and its standard error over tracks
  /// 95 % intervals. Of the speed: by the likelihood; nothing for robots that stand still.
  std::pair<double, double> mean_apart_s, mean_length_s;
  std::optional<std::pair<double, double>> speed;
};

/// Stalls in the tracks of the fit, if they pass. The state then holds them, with everything else refitted beside them.
[[nodiscard]] std::optional<StallEffect> find_stalls(const Fitter&, FitState&);

[[nodiscard]] identification::Effect entry_of(const StallEffect&);

}  // namespace kilotwin::identify
