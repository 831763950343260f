/// What tracks look like, whatever made them: distributions of speed and turning of robots that are driven and touch nothing, of
/// the distance from walls, mean speed over the run, mean square displacement. Two sets of tracks under the same commands, seen at the same times, are told apart by them.
#pragma once

#include <string>
#include <vector>

#include "clients/identify/data/measured_set.hpp"
#include "clients/identify/model/neighbours.hpp"
#include "clients/identify/model/contact_geometry.hpp"

namespace kilotwin::identify {

struct Statistic {
  enum class Kind : std::uint8_t {
    kHistogram,  ///< counts between edges
    kMeans,      ///< means at places
    kSquares,    ///< means that are compared by their ratio
  };
  Kind kind;
  std::string name, unit;
  std::vector<double> at;  ///< edges (histogram), or the places of the bins
  std::string distance_unit;

  [[nodiscard]] std::size_t bins() const { return kind == Kind::kHistogram ? at.size() - 1 : at.size(); }
};

/// Sums of one statistic over tracks, bin by bin; they add up.
struct Tally {
  std::vector<double> sum, weight;  ///< kHistogram: weights alone

  void add(const Tally&);
  void scale(double by);
  [[nodiscard]] double total() const;
};

/// The statistics with bins that suit a set of tracks. Only those that these tracks can fill.
class TrackStatistics {
 public:
  /// Of `tracks` of robots that walk in `room`, seen at a point so far from the middle of their discs.
  TrackStatistics(const std::vector<const Track*>& tracks, const Room& room, double off_centre_mm);

  [[nodiscard]] const std::vector<Statistic>& list() const { return list_; }
  /// One per statistic, of the track at this place of a run.
  [[nodiscard]] std::vector<Tally> tally(const Track&, const RunNeighbours&, std::size_t place) const;

 private:
  /// Calls speed(middle time, mm/s) and turn(rad/s) for stretches under one command, while driven; where neighbours are given,
  /// of robots that touch nothing.
  template <class Speed, class Turn>
  void stretches(const Track&, const RunNeighbours*, std::size_t place, Speed&&, Turn&&) const;
  [[nodiscard]] bool touches(const Sample& from, const Sample& to, const RunNeighbours&, std::size_t place) const;
  [[nodiscard]] double wall_distance_mm(const Sample&) const;

  Room room_;
  bool has_walls_;
  double off_centre_mm_;
  double stretch_s_ = 2, first_s_ = 0, last_s_ = 0;
  std::vector<Statistic> list_;
};

/// How far two tallies of a statistic are apart: the mean shift between histograms (of Wasserstein), in their unit; the mean
/// absolute difference of means; of squares the mean absolute logarithm of the ratio. 0 where either is empty.
[[nodiscard]] double distance(const Statistic&, const Tally&, const Tally&);

/// Whether measured robots differ from simulated ones by more than chance.
struct Comparison {
  double distance = 0;      ///< mean over the simulations
  double by_chance_95 = 0;  ///< 95 % of distances are below it where only chance differs
  double p = 1;             ///< the chance of as large a distance
};

/// By exchanging measured and simulated ones unit by unit at random: tracks of one unit depend on each other, units do not.
/// `measured` has a tally per unit, `simulated` the same for each simulation.
[[nodiscard]] Comparison compare(const Statistic&, const std::vector<Tally>& measured,
                                 const std::vector<std::vector<Tally>>& simulated);

}  // namespace kilotwin::identify
