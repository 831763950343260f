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
  /// Outer radius of the ring. A larger one gives more counts, from farther away, where the density may be another one.
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

/// The tracks of a set, ready for the filter, and what a fit estimates of them: initial headings, disc centres, and
/// what neighbours see of them. One value: a copy shares what is constant, and a change of the copy leaves the original
/// as it is.
class PreparedSet {
 public:
  /// Runs get the numbers `first_number`, ... Run numbers of two sets must not overlap. The set must outlive all copies.
  explicit PreparedSet(const MeasuredSet&, std::uint32_t first_number = 0);

  [[nodiscard]] const MeasuredSet& set() const { return *set_; }
  [[nodiscard]] const std::vector<TrackView>& views() const { return views_; }
  [[nodiscard]] const RunNeighbours& neighbours(std::size_t run) const { return *neighbours_[run]; }
  /// The tracks of the fit, grouped into units: by robot, or one per track if there are fewer than six robots.
  [[nodiscard]] std::vector<std::vector<const TrackView*>> units() const;
  /// Tracks of the fit, spread over the set, up to this number of samples.
  [[nodiscard]] std::vector<const TrackView*> some_tracks(std::size_t samples) const;
  /// Their indices in views().
  [[nodiscard]] std::vector<std::size_t> some_views(std::size_t samples) const;
  [[nodiscard]] Encounters encounters() const;
  /// Robots that came near each other, by disc centres.
  [[nodiscard]] std::vector<RobotPair> pairs() const;

  /// Work done on these tracks and all copies of them: sub-steps of filters, each times its columns if it is linearised.
  /// It depends on the data alone, not on the machine.
  [[nodiscard]] std::uint64_t work() const { return *work_; }

  /// Lets robots follow their commands this much later than stamped, s.
  void set_command_lag(double lag_s);
  /// Estimates the disc centres, and with them what neighbours see.
  void find_centres(const MotionModel&, std::uint32_t threads);
  /// Estimates the initial heading of each track: the measured one, or the most likely of many hypotheses.
  void find_headings(const MotionModel&, std::uint32_t threads);
  /// By view: TrackView::spells; an empty vector stands for unknown.
  void set_spells(std::vector<std::vector<float>>);
  /// Computes the traffic grids with the model's cells.
  void update_traffic(const MotionModel&);

 private:
  void set_neighbours(std::size_t run, RunNeighbours);

  const MeasuredSet* set_;
  std::uint32_t first_number_;
  double command_lag_s_ = 0;
  /// By view; constant.
  std::shared_ptr<const std::vector<CommandClock>> clocks_;
  std::shared_ptr<const std::vector<std::vector<bool>>> at_boundary_;
  std::shared_ptr<const std::vector<std::vector<float>>> spells_;
  /// By run; what they point to is constant.
  std::vector<std::shared_ptr<const RunNeighbours>> neighbours_;
  std::vector<TrackView> views_;
  std::shared_ptr<std::atomic<std::uint64_t>> work_ = std::make_shared<std::atomic<std::uint64_t>>(0);
};

}  // namespace kilotwin::identify
