/// Spells of a track (model/stalls.hpp) by a Kalman filter with several hypotheses. Each hypothesis is a history of spells with a
/// filter of its own. In each interval between two samples a spell may last, start or end; the least likely hypotheses are dropped.
#pragma once

#include <vector>

#include "clients/identify/fit/filter_pass.hpp"

namespace kilotwin::identify {

struct TrackSpells {
  double log_likelihood = 0;  ///< of the measurements, summed over the histories
  /// Share of the interval before each sample in a spell; mean over the histories. 0..1
  std::vector<float> share;
  std::vector<Spell> spells;  ///< of the most likely history
  double between_s = 0;       ///< time between its spells
};

/// With the spells that `model.stalls` describes.
[[nodiscard]] TrackSpells spells_of(const MotionModel& model, const TrackView&);

}  // namespace kilotwin::identify
