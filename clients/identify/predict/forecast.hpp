/// Predictions: from what was measured of a run up to an instant, where its robots will be seen some seconds later.
#pragma once

#include <vector>

#include "clients/identify/fit/fitter.hpp"

namespace kilotwin::identify {

struct Predicted {
  std::uint32_t run;    ///< place in the set
  std::uint32_t place;  ///< of the track in its run
  double time_s;
  double x_mm, y_mm;
  double spread_mm;  ///< its own idea of the root of the mean squared distance to what will be measured
};

struct Asked {
  double first_s = 10, every_s = 5, horizon_s = 10;
  /// So many joint futures of robots that may touch; 0: that of their means alone, for a quick look.
  std::uint32_t futures = 0;
};

/// Predictions of all robots of the tracks (of those held out, with `held_out_only`) at first_s, first_s + every_s ... up to
/// the last sample of each. All robots of a run go on together, so that effects of neighbours look ahead as well.
[[nodiscard]] std::vector<Predicted> predict(const MotionModel&, const PreparedSet&, const Asked&,
                                             bool held_out_only, std::uint32_t threads);

/// What was measured at a time; false where nothing was within a hundredth of a second.
[[nodiscard]] bool measured_at(const Track&, double time_s, Sample&);

}  // namespace kilotwin::identify
