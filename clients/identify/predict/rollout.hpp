/// Where robots that may touch come to be: the mean of many joint futures, drawn from what is believed of them. Two robots that
/// meet head on slide past each other on either side; the future of their means would choose one.
#pragma once

#include <array>
#include <vector>

#include "clients/identify/fit/filter_pass.hpp"
#include "clients/identify/model/traffic_grids.hpp"

namespace kilotwin::identify {

/// A robot at the instant from which nothing more is measured.
struct Starting {
  const TrackView* view = nullptr;
  std::vector<const TrackFilter*> filters;  ///< what may be true of it
  std::vector<double> weights;              ///< of each, of sum 1
  double now_s = 0;                         ///< of the filters
};

/// Of a measured position.
struct Foreseen {
  double x_mm = 0, y_mm = 0, square_mm2 = 0;  ///< mean, and mean squared distance from it
};

/// `neighbours`: whether effects look at neighbours; `floors` as they are at from_s. `key` tells what is drawn.
[[nodiscard]] std::vector<Foreseen> futures(const MotionModel&, const std::vector<Starting>&, const Floors& floors,
                                            double from_s, double to_s, std::uint32_t count, bool neighbours,
                                            std::array<std::uint32_t, 2> key);

}  // namespace kilotwin::identify
