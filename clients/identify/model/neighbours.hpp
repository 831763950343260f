/// The other robots as they were measured, between samples too.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "clients/identify/model/traffic_grid.hpp"
#include "clients/identify/model/covariates.hpp"

namespace kilotwin::identify {

/// One robot among others, all at one instant. Robots whose x is NaN are not there. The others are added to the list, where
/// there is one; it must outlive the view.
[[nodiscard]] NeighbourView view_of(std::size_t robot, std::span<const double> x_mm, std::span<const double> y_mm,
                                    std::vector<OtherRobot>* list = nullptr);

/// Where the disc's centre of a track was when it was sampled.
struct Centres {
  std::vector<double> x_mm, y_mm;
};

/// What each track of a run sees of the others, on a raster of time.
class RunNeighbours {
 public:
  static constexpr double kRaster_s = 0.25;
  /// A robot that was not measured for longer than this is not there, s.
  static constexpr double kGap_s = 4;

  /// Where robots were measured; with `centres`, by track, where their discs were instead.
  explicit RunNeighbours(const Run&, const std::vector<Centres>* centres = nullptr);
  [[nodiscard]] const NeighbourView& view(std::size_t track, double time_s) const;
  /// Fills in what the floor remembers in these cells.
  void remember(const Run&, const std::array<FloorCells, kFloorCells>& cells);

  /// Where the disc of a robot was at an instant of the raster.
  struct Spot {
    double x_mm, y_mm;  ///< NaN: it was not there
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
  double start_s_ = 0;
  std::size_t instants_ = 0;
  std::vector<NeighbourView> views_;  ///< by track, then by instant
  std::vector<Spot> spots_;           ///< likewise
  /// Of all views. It stays where it is when the run is moved.
  std::unique_ptr<std::vector<OtherRobot>> others_ = std::make_unique<std::vector<OtherRobot>>();
  NeighbourView nobody_;
};

}  // namespace kilotwin::identify
