/// Parts of a map of the floor: the disc or the half plane that explains most of the map's variance.
#pragma once

#include <vector>

#include "clients/identify/fit/prepared_set.hpp"
#include "clients/identify/model/motion_model.hpp"
#include "clients/identify/search/hypotheses.hpp"

namespace kilotwin::identify {

/// The value of a map where and when a robot was.
struct MapPoint {
  double time_s, x_mm, y_mm, value;
};

/// The places with a coordinate below an edge. The coordinate is the distance from a point (kPointDistance: a disc) or that along a
/// direction (kAlong: a half plane).
struct MapPart {
  Axis axis;
  double edge_mm;
};

/// Measured positions of the set, at most some thousands, with value 0.
[[nodiscard]] std::vector<MapPoint> positions_of(const PreparedSet&);
/// Adds `factor` times the effect of some blocks of a term on the target there. Of gains, which multiply each other and the base
/// speeds, the logarithm of 1 + gain; those of one wheel count half for kGain.
void add_effect(std::vector<MapPoint>&, const Term&, Target, double factor, std::size_t first_block = 0,
                std::size_t end_block = SIZE_MAX);
void subtract_mean(std::vector<MapPoint>&);
[[nodiscard]] double sum_of_squares(const std::vector<MapPoint>&);

/// The part of the sum of squares that the contrast between a part and the rest explains. The values of `points` sum to 0. 0 if a part
/// holds few points, or all but few.
[[nodiscard]] double explained_by(const std::vector<MapPoint>& points, const MapPart&);
/// The disc, or the half plane, that explains most.
[[nodiscard]] MapPart best_disc(const std::vector<MapPoint>& points, const Extent&);
[[nodiscard]] MapPart best_half_plane(const std::vector<MapPoint>& points, const Extent&);
/// The edge at which one step over the coordinate explains most.
[[nodiscard]] double best_edge_mm(const std::vector<MapPoint>& points, const Axis&);

}  // namespace kilotwin::identify
