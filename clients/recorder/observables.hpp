/// Observables: quantities over time that are defined for any swarm, computed from a recording.
///
///   msd            mean over robots of the squared distance from their position in the first state, mm^2
///   displacement   mean over robots of that distance, mm
///   spread         root mean square distance of the robots from their centroid, mm
///   nearest        mean over robots of the distance to their nearest neighbour, centre to centre, mm
///   pushed         mean over movable bodies of the distance from their position in the first state, mm
///   polarisation   length of the mean of all heading vectors: 0 (no common direction) .. 1 (all equal)
///
/// An undefined quantity is NaN: the nearest neighbour of a single robot, or movable bodies in a run without any.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "clients/recorder/reader.hpp"
#include "clients/recorder/state_index.hpp"

namespace kilotwin::recorder {

enum class Observable : std::uint8_t { kMsd, kDisplacement, kSpread, kNearest, kPolarisation, kPushed };

struct ObservableInfo {
  std::string_view name;   ///< in tables and on the command line
  std::string_view title;  ///< in plots
  std::string_view unit;   ///< in plots; empty for a pure number
  std::string_view column_suffix;
};

inline constexpr std::array<ObservableInfo, 6> kObservables = {{
    {"msd", "mean square displacement", "mm\u00b2", "_mm2"},
    {"displacement", "displacement", "mm", "_mm"},
    {"spread", "spread about the centroid", "mm", "_mm"},
    {"nearest", "distance to the nearest robot", "mm", "_mm"},
    {"polarisation", "polarisation", "", ""},
    {"pushed", "displacement of movable bodies", "mm", "_mm"},
}};

/// An observable of the experiment.
struct OwnCurve {
  std::string name;
  std::vector<double> value;
};

/// Observables of one run, one value per recorded state.
struct ObservableCurves {
  std::vector<OwnCurve> own;
  std::vector<double> time_s;
  std::array<std::vector<double>, kObservables.size()> value;

  [[nodiscard]] const std::vector<double>& of(Observable o) const { return value[static_cast<std::size_t>(o)]; }
};

/// Computes observables state by state; every state must have the same robots.
class ObservableObserver {
 public:
  void add(double time_s, std::span<const double> x_mm, std::span<const double> y_mm,
           std::span<const double> heading_rad, std::span<const double> movable_x_mm = {},
           std::span<const double> movable_y_mm = {});
  [[nodiscard]] const ObservableCurves& curves() const { return curves_; }

 private:
  std::vector<double> start_x_mm_, start_y_mm_, movable_start_x_mm_, movable_start_y_mm_;
  ObservableCurves curves_;
};

/// Observables of all remaining states of a recording, those of the experiment included. Throws UserError where the recording holds an
/// expression that cannot be read.
[[nodiscard]] ObservableCurves observe(Reader& recording);
/// The same of every `step`-th state from the first on, and of the last. `index`: of the same recording.
[[nodiscard]] ObservableCurves observe_every(Reader& recording, const StateIndex& index, std::size_t step);
/// The same, followed by those of each group of robots as if the swarm were that group. Movable bodies stay as they are.
[[nodiscard]] std::vector<ObservableCurves> observe_with_groups(Reader& recording);

/// Mean over robots of the distance to their nearest neighbour; NaN for fewer than two robots.
[[nodiscard]] double mean_nearest_distance_mm(std::span<const double> x_mm, std::span<const double> y_mm);

}  // namespace kilotwin::recorder
