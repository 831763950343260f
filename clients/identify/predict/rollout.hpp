/// Monte Carlo rollouts of robots that may touch: the mean over joint futures sampled from the filters'
/// distributions. Two robots that meet head-on pass on either side, which no single mean path represents.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "clients/identify/fit/filter_pass.hpp"
#include "clients/identify/fit/spell_branches.hpp"
#include "clients/identify/model/traffic_grids.hpp"

namespace kilotwin::identify {

/// A robot at the start of the forecast.
struct RolloutStart {
  const TrackView* view = nullptr;
  std::vector<const TrackFilter*> filters;             ///< one per hypothesis
  std::vector<double> weights;                         ///< of the hypotheses, with sum 1
  double now_s = 0;                                    ///< time of the filters
  std::vector<std::optional<SpellState>> spells = {};  ///< by hypothesis, for a model with stalls; none: at random
};

/// Moments of a measured position.
struct RolloutMoments {
  double x_mm = 0, y_mm = 0, square_mm2 = 0;  ///< mean, and mean squared distance from it
};

/// `neighbours`: whether any effect uses neighbours. `grids`: the traffic at from_s. `key`: of the random
/// generator.
[[nodiscard]] std::vector<RolloutMoments> rollouts(const MotionModel&, const std::vector<RolloutStart>&,
                                                   const TrafficGrids& grids, double from_s, double to_s,
                                                   std::uint32_t count, bool neighbours,
                                                   std::array<std::uint32_t, 2> key);

}  // namespace kilotwin::identify
