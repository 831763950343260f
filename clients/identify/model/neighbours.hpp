/// The measured positions of all robots of a run on a time raster, and the neighbours of each robot there.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "clients/identify/model/covariates.hpp"
#include "clients/identify/model/traffic_grid.hpp"

namespace kilotwin::identify {

/// A robot as the neighbour of another one, at one instant.
struct Neighbour {
  std::uint32_t robot = 0;  ///< robot number
  bool driven = true;       ///< whether a motor is commanded to turn
};

/// The neighbours of one robot at one instant. x = NaN: the robot is absent. Appends the neighbours to `list` if
/// given; the list must outlive the view. `who`: one per robot, or empty: all are driven and have the number 0.
[[nodiscard]] NeighbourView view_of(std::size_t robot, std::span<const double> x_mm, std::span<const double> y_mm,
                                    std::vector<OtherRobot>* list = nullptr, std::span<const Neighbour> who = {});

/// Disc centres of a track at its sample times, mm.
struct Centres {
  std::vector<double> x_mm, y_mm;
};

/// Neighbour views of all tracks of a run.
class RunNeighbours {
 public:
  /// Time between the instants of the views. A finer raster costs time and memory; a coarser one shows neighbours where
  /// they were.
  static constexpr double kRaster_s = 0.25;
  /// A robot is absent in gaps longer than this, s.
  static constexpr double kGap_s = 4;

  /// From measured positions, or from estimated disc centres by track. `command_lag_s`: as of CommandClock.
  explicit RunNeighbours(const Run&, const std::vector<Centres>* centres = nullptr, double command_lag_s = 0);
  /// With another lag: other robots are driven at other instants. The traffic stays as it is until update_traffic().
  void set_command_lag(const Run&, double command_lag_s);
  [[nodiscard]] const NeighbourView& view(std::size_t track, double time_s) const;
  /// Computes the traffic for these grids.
  void update_traffic(const Run&, const std::array<GridCells, kTrafficGrids>& cells);

  /// Disc centre of a robot at one instant of the raster, mm.
  struct Spot {
    double x_mm, y_mm;  ///< NaN: absent
    bool driven;
  };
  [[nodiscard]] std::size_t instants() const { return spots_.empty() ? 0 : instants_; }
  [[nodiscard]] double time_s(std::size_t instant) const {
    return start_s_ + static_cast<double>(instant) * kRaster_s;
  }
  [[nodiscard]] const Spot& spot(std::size_t track, std::size_t instant) const {
    return spots_[track * instants_ + instant];
  }

 private:
  void set_driven(const Run&, double command_lag_s);
  void find_views(const Run&);

  double start_s_ = 0;
  std::size_t instants_ = 0;
  std::vector<NeighbourView> views_;  ///< [track][instant]
  std::vector<Spot> spots_;           ///< [track][instant]
  /// Neighbours of all views. On the heap and shared, so that views stay valid in a copy.
  std::shared_ptr<const std::vector<OtherRobot>> others_;
  NeighbourView nobody_;
};

}  // namespace kilotwin::identify
