/// Spells of all tracks of the fit (spell_filter.hpp), the stalls of maximum likelihood, and whether robots stall together.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "clients/identify/fit/fit_state.hpp"
#include "clients/identify/fit/spell_filter.hpp"

namespace kilotwin::identify {

/// The tracks of the fit with spells, and without.
class SpellScan {
 public:
  SpellScan(const FitState&, std::uint32_t threads);

  struct Found {
    std::vector<TrackSpells> tracks;  ///< by view; empty for held-out ones
    std::vector<double> gains;        ///< of the log likelihood, by view
    std::size_t spells = 0;
    double gain = 0;
  };
  /// `stalls_of(v)`: those of the view v.
  [[nodiscard]] Found scan(const MotionModel&, const std::function<Stalls(std::size_t)>& stalls_of) const;
  [[nodiscard]] Found scan(const MotionModel&, const Stalls&) const;
  /// The parameters of maximum likelihood by the spells of the views that `use` picks.
  [[nodiscard]] Stalls refined(const Found&, Stalls, const std::function<bool(std::size_t)>& use) const;
  [[nodiscard]] Stalls refined(const Found&, const Stalls&) const;
  /// 95 % intervals, given the spells found: of the mean time apart by their number, a Poisson variable; of the mean duration by their
  /// durations.
  struct Intervals {
    std::pair<double, double> mean_apart_s, mean_length_s;
  };
  [[nodiscard]] Intervals intervals(const Found&, const Stalls&) const;
  /// Mean square deviation of the number of robots in a spell from its mean, over that of independent robots with the same share of
  /// time in spells: 1 for independent robots, up to their number if all stall together. Without two robots in a run: 1.
  [[nodiscard]] double dispersion(const Found&) const;
  /// The share of time in spells near walls and other robots, over that elsewhere: 1 for spells that occur by chance. An obstacle
  /// that is not where the model has it looks like a stall beside it. Without robots that are both: 1.
  [[nodiscard]] double share_at_obstacles(const Found&, const MotionModel&) const;
  [[nodiscard]] const std::vector<TrackView>& views() const { return views_; }

 private:
  /// Spells and times of the views that `use` picks.
  struct Shown {
    std::vector<Spell> spells;
    double between_s = 0, starts = 0;
  };
  [[nodiscard]] Shown shown_by(const Found&, const std::function<bool(std::size_t)>& use) const;

  const std::vector<TrackView> views_;
  const std::uint32_t threads_;
  std::vector<double> plain_;  ///< log likelihood without spells, by view
  double longest_s_ = 0, least_s_ = 0;
};

}  // namespace kilotwin::identify
