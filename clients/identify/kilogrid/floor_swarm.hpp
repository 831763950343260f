/// Swarm with the known program in the planar engine, and the floor's reports of it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "clients/identify/kilogrid/floor_log.hpp"
#include "clients/identify/kilogrid/floor_program.hpp"
#include "clients/identify/kilogrid/floor_reporter.hpp"
#include "idl/model.pb.h"

namespace kilotwin::kilogrid {

/// The boundary in sections of equal length, anticlockwise from the origin.
inline constexpr std::size_t kBoundarySections = 24;
/// The boundary section nearest to a position.
[[nodiscard]] std::size_t boundary_section(const Floor&, double x_mm, double y_mm);

/// Distance from a position to the centre of the nearest boundary cell, mm.
[[nodiscard]] double boundary_cell_distance_mm(const Floor&, double x_mm, double y_mm);

/// The given inputs of a run.
struct FloorScene {
  std::string name;
  double duration_s = 0;
  std::vector<double> x_mm, y_mm;  ///< initial positions in the floor's frame
};

/// The scene of a measured run: each robot starts in the cell of its first report, without overlaps.
[[nodiscard]] FloorScene scene_of(const FloorRun&, const Floor&, std::uint64_t seed);

/// One run of the model. Deterministic in its arguments.
[[nodiscard]] FloorRun simulate(const FloorScene&, const Floor&, const proto::Model&, const WalkTimes&,
                                const FloorRadio&, std::uint64_t seed);

}  // namespace kilotwin::kilogrid
