/// Summary statistics of tracks: distributions of speed and turn rate of driven robots without contacts, distance
/// from walls, mean speed over the run, mean square displacement. They compare two sets of tracks with the same
/// commands and sample times.
#pragma once

#include <string>
#include <vector>

#include "clients/identify/data/measured_set.hpp"
#include "clients/identify/model/contact_geometry.hpp"
#include "clients/identify/model/neighbours.hpp"

namespace kilotwin::identify {

struct Statistic {
  enum class Kind : std::uint8_t {
    kHistogram,  ///< counts between edges
    kMeans,      ///< means at points
    kSquares,    ///< means that are compared by their ratio
  };
  Kind kind;
  std::string name, unit;
  std::vector<double> at;  ///< bin edges (histogram), or the points
  std::string distance_unit;

  [[nodiscard]] std::size_t bins() const { return kind == Kind::kHistogram ? at.size() - 1 : at.size(); }
};

/// Sums of one statistic over tracks, per bin. Tallies add up.
struct Tally {
  std::vector<double> sum, weight;  ///< kHistogram uses the weights only

  void add(const Tally&);
  void scale(double by);
  [[nodiscard]] double total() const;
};

/// The statistics that a set of tracks supports, with suitable bins.
class TrackStatistics {
 public:
  /// `off_centre_mm`: distance of the tracked point from the disc centre.
  TrackStatistics(const std::vector<const Track*>& tracks, const Walls& walls, double off_centre_mm);

  [[nodiscard]] const std::vector<Statistic>& list() const { return list_; }
  /// One tally per statistic, for the track at index `place` of a run.
  [[nodiscard]] std::vector<Tally> tally(const Track&, const RunNeighbours&, std::size_t place) const;

 private:
  /// Calls speed(midpoint s, mm/s) and turn(rad/s) for motion segments of driven robots. With neighbours: segments
  /// without contacts only.
  template <class Speed, class Turn>
  void motion_segments(const Track&, const RunNeighbours*, std::size_t place, Speed&&, Turn&&) const;
  [[nodiscard]] bool in_contact(const Sample& from, const Sample& to, const RunNeighbours&,
                                std::size_t place) const;
  [[nodiscard]] double wall_distance_mm(const Sample&) const;

  Walls walls_;
  bool has_walls_;
  double off_centre_mm_;
  double segment_s_ = 2, first_s_ = 0, last_s_ = 0;
  std::vector<Statistic> list_;
};

/// Distance between two tallies. Histograms: the 1-Wasserstein distance, in their unit. Means: the mean absolute
/// difference. Mean squares: the mean absolute logarithm of the ratio. 0 if either is empty.
[[nodiscard]] double distance(const Statistic&, const Tally&, const Tally&);

/// Result of a permutation test of measured against simulated tracks.
struct Comparison {
  double distance = 0;      ///< mean over the simulations
  double by_chance_95 = 0;  ///< 0.95 quantile under the null hypothesis
  double p = 1;             ///< p value
};

/// Permutation test: exchanges the labels measured and simulated at random, per unit, because tracks of one unit
/// depend on each other. `measured` has one tally per unit, `simulated` one per simulation and unit.
[[nodiscard]] Comparison compare(const Statistic&, const std::vector<Tally>& measured,
                                 const std::vector<std::vector<Tally>>& simulated);

}  // namespace kilotwin::identify
