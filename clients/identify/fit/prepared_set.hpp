/// The tracks of a set with what the filter needs: commands, neighbours, initial headings.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "clients/identify/fit/filter_pass.hpp"

namespace kilotwin::identify {

struct RobotPair;

/// Counts of robots whose nearest neighbour overlaps them, and of those in a ring around that distance.
struct Encounters {
  static constexpr double kRing_mm = 55;
  /// Smaller than a disc diameter, so that camera distortion does not make contacts look like overlaps.
  static constexpr double kInside_mm = 0.85 * kDiscDiameter_mm;
  /// From this relative density of overlaps on, robots do not collide with each other.
  static constexpr double kNoCollisions = 0.6;
  std::size_t within = 0, near = 0;
  /// Density of overlaps relative to the density in the ring. Prior: 0.2, with the weight of ten counts.
  [[nodiscard]] double overlap_density() const {
    constexpr double kInner = kInside_mm * kInside_mm,
                     kOuter = kRing_mm * kRing_mm - kContactRange_mm * kContactRange_mm;
    constexpr double kFew = 10;
    return (static_cast<double>(within) + 0.2 * kFew) / (static_cast<double>(near) * kInner / kOuter + kFew);
  }
};

/// The tracks of a set, ready for the filter.
class PreparedSet {
 public:
  /// Runs get the numbers `first_number`, ... Run numbers of two sets must not overlap.
  explicit PreparedSet(const MeasuredSet&, std::uint32_t first_number = 0);

  [[nodiscard]] const MeasuredSet& set() const { return *set_; }
  [[nodiscard]] std::vector<TrackView>& views() { return views_; }
  [[nodiscard]] const std::vector<TrackView>& views() const { return views_; }
  [[nodiscard]] const RunNeighbours& neighbours(std::size_t run) const { return *neighbours_[run]; }
  /// The tracks of the fit, grouped into units: by robot, or one per track if there are fewer than six robots.
  [[nodiscard]] std::vector<std::vector<const TrackView*>> units() const;
  /// Recomputes the disc centres, and with them the neighbour views.
  void find_centres(const MotionModel&, std::uint32_t threads);
  /// Estimates that belong to the tracks: disc centres and initial headings.
  struct TrackEstimates {
    std::vector<std::vector<Centres>> centres;          ///< by run; empty: measured positions
    std::vector<std::pair<double, double>> starts_rad;  ///< by view: heading and its standard deviation
  };
  [[nodiscard]] TrackEstimates estimates() const;
  /// Restores these estimates. Traffic grids are recomputed with the model's cells.
  void restore(const TrackEstimates&, const MotionModel&);
  /// Recomputes the traffic grids with the model's cells.
  void update_traffic(const MotionModel&);
  [[nodiscard]] Encounters encounters() const;
  /// Robots that came near each other, by disc centres.
  [[nodiscard]] std::vector<RobotPair> pairs() const;
  /// Estimates the initial heading of each track: the measured one, or the most likely of many hypotheses.
  void find_headings(const MotionModel&, std::uint32_t threads);

 private:
  const MeasuredSet* set_;
  std::uint32_t first_number_;
  std::vector<std::unique_ptr<RunNeighbours>> neighbours_;
  std::vector<std::vector<Centres>> centres_;  ///< by run, as last estimated; empty: measured positions
  std::vector<TrackView> views_;
};

}  // namespace kilotwin::identify
