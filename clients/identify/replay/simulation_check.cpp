#include "clients/identify/replay/simulation_check.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "clients/identify/replay/replay.hpp"
#include "clients/identify/replay/track_statistics.hpp"
#include "clients/identify/result/values.hpp"
#include "core/os/worker_pool.hpp"

namespace kilotwin::identify {
namespace {

/// Simulations of a model, at most and at least. More make statistics less random and cost time; a set too large for the
/// least number is not checked.
constexpr std::size_t kMostSeeds = 8, kFewestSeeds = 2;
/// Bound on robots times ticks over all simulations of a model: about ten seconds of one core.
constexpr double kMostRobotTicks = 3e7;
/// With fewer units, the smallest p of the permutation test exceeds kSurprise.
constexpr std::size_t kFewestUnits = 8;
constexpr double kSurprise = 0.01;

/// Exchangeable units of the permutation test: all tracks of a robot, or single tracks if there are few robots.
struct Units {
  explicit Units(const std::vector<std::uint32_t>& robot_of_track) {
    std::vector<std::uint32_t> robots = robot_of_track;
    std::sort(robots.begin(), robots.end());
    robots.erase(std::unique(robots.begin(), robots.end()), robots.end());
    by_robot = robots.size() >= kFewestUnits;
    count = by_robot ? robots.size() : robot_of_track.size();
    for (std::size_t t = 0; t < robot_of_track.size(); ++t) {
      const auto place = std::lower_bound(robots.begin(), robots.end(), robot_of_track[t]) - robots.begin();
      of_track.push_back(by_robot ? static_cast<std::size_t>(place) : t);
    }
  }
  bool by_robot = false;
  std::size_t count = 0;
  std::vector<std::size_t> of_track;
};

/// [statistic][unit]
using Tallies = std::vector<std::vector<Tally>>;

/// A run to compare, and its scenes.
struct Played {
  Scene base, full;
  std::vector<std::size_t> compared;  ///< indices in the scene
};

/// Adds the tallies of a run's compared tracks; `track` counts tracks over all runs.
void add_run(const Run& run, const std::vector<std::size_t>& compared, const TrackStatistics& statistics,
             const Units& units, std::size_t& track, Tallies& to) {
  const RunNeighbours neighbours(run);
  for (const std::size_t place : compared) {
    const std::vector<Tally> own = statistics.tally(run.tracks[place], neighbours, place);
    for (std::size_t s = 0; s < own.size(); ++s) to[s][units.of_track[track]].add(own[s]);
    ++track;
  }
}

/// The run of a scene as measured, or with the given samples.
Run run_of(const Scene& scene, std::vector<std::vector<Sample>> samples) {
  Run run;
  for (std::size_t r = 0; r < scene.robots.size(); ++r) {
    run.tracks.push_back(*scene.robots[r].track);
    if (!samples.empty()) run.tracks.back().samples = std::move(samples[r]);
  }
  return run;
}

/// Scales simulated tallies to the weights of the measured ones: exclusion of contacts leaves different amounts of
/// data.
void match_weights(const Tallies& measured, Tallies& simulated) {
  for (std::size_t s = 0; s < measured.size(); ++s) {
    for (std::size_t u = 0; u < measured[s].size(); ++u) {
      const double own = simulated[s][u].total();
      if (own > 0) simulated[s][u].scale(measured[s][u].total() / own);
    }
  }
}

Tally sum_of(const Statistic& statistic, const std::vector<Tally>& tallies) {
  Tally sum{std::vector<double>(statistic.bins()), std::vector<double>(statistic.bins())};
  for (const Tally& tally : tallies) sum.add(tally);
  return sum;
}

/// Null where nothing was measured.
JsonList means_of(const Tally& tally) {
  JsonList out;
  for (std::size_t i = 0; i < tally.weight.size(); ++i)
    *out.add_values() = tally.weight[i] > 0 ? json_value(tally.sum[i] / tally.weight[i]) : json_null();
  return out;
}

/// Plot data of a statistic, summed over all robots.
void add_plot(identification::Identification& out, const Statistic& statistic, const Tally& measured,
              const Tally& base, const Tally& full) {
  switch (statistic.kind) {
    case Statistic::Kind::kHistogram: {
      identification::Distribution& plot = *out.add_distributions();
      plot.set_name(statistic.name);
      plot.set_unit(statistic.unit);
      assign(plot.mutable_edges(), statistic.at);
      assign(plot.mutable_measured(), measured.weight);
      assign(plot.mutable_base(), base.weight);
      assign(plot.mutable_simulated(), full.weight);
      return;
    }
    case Statistic::Kind::kSquares: {
      identification::Msd& plot = *out.mutable_msd();
      assign(plot.mutable_lag_s(), statistic.at);
      *plot.mutable_measured_mm2() = means_of(measured);
      *plot.mutable_base_mm2() = means_of(base);
      *plot.mutable_simulated_mm2() = means_of(full);
      return;
    }
    case Statistic::Kind::kMeans: {
      if (statistic.at.size() < 2) return;
      identification::SpeedOverTime& plot = *out.mutable_speed_over_time();
      assign(plot.mutable_time_s(), statistic.at);
      *plot.mutable_measured_mm_s() = means_of(measured);
      *plot.mutable_base_mm_s() = means_of(base);
      *plot.mutable_simulated_mm_s() = means_of(full);
      return;
    }
  }
}

std::string words_of(const identification::Simulated& simulated, bool decidable) {
  if (!decidable) return fmt::format("Too few {}s for the permutation test.", simulated.unit());
  std::vector<std::string> differ, differed;
  for (const identification::SimulatedStatistic& s : simulated.statistics()) {
    if (!s.agrees().bool_value()) differ.push_back(s.name());
    if (s.base_p() < kSurprise) differed.push_back(s.name());
  }
  std::string out = differ.empty() ? "Simulations of this model agree with the measured tracks in all of these"
                                   : fmt::format("Simulations of this model differ from the measured tracks in {}",
                                                 fmt::join(differ, ", "));
  out += differed.empty() ? "; so do those of the base model."
                          : fmt::format("; those of the base model differ in {}.", fmt::join(differed, ", "));
  if (!differ.empty() && differed.empty())
    out = fmt::format(
        "Simulations of this model differ from the measured tracks in {}; those of the base model do not.",
        fmt::join(differ, ", "));
  return out;
}

/// The compared data: runs with their scenes, and all compared tracks.
struct Comparable {
  std::vector<Played> played;
  std::vector<const Track*> tracks;
  std::vector<std::uint32_t> robots;  ///< of the tracks
  double robot_ticks = 0;             ///< of one simulation
  bool too_long = false;

  Comparable(const WrittenModel& base, const WrittenModel& full, const PreparedSet& set, Tracks which) {
    for (std::size_t run = 0; run < set.set().runs.size() && !too_long; ++run) {
      Played p{scene_of(base.fitted, set, run), scene_of(full.fitted, set, run), {}};
      for (std::size_t r = 0; r < p.full.robots.size(); ++r) {
        const Track* const track = p.full.robots[r].track;
        if (!counts(*track, which)) continue;
        p.compared.push_back(r);
        tracks.push_back(track);
        robots.push_back(track->robot);
      }
      if (p.compared.empty()) continue;
      too_long = p.full.duration_s() > kLongestPlay_s || p.full.duration_s() <= 0;
      robot_ticks += identify::robot_ticks(p.full);
      played.push_back(std::move(p));
    }
  }
};

/// Tallies of the measured tracks, and of each simulation.
struct AllTallies {
  Tallies measured;
  std::vector<Tallies> simulated;  ///< by seed: the base model if it differs, then the full model
  std::size_t seeds, first_full;

  AllTallies(const Comparable& of, const TrackStatistics& statistics, const Units& units, const WrittenModel& base,
             const WrittenModel& full, std::uint32_t threads)
      : seeds(static_cast<std::size_t>(
            std::clamp(kMostRobotTicks / of.robot_ticks, double{kFewestSeeds}, double{kMostSeeds}))),
        // Without effects and with the same lag both models are one.
        first_full(full.fitted.terms.empty() && full.fitted.base.command_lag_s == base.fitted.base.command_lag_s
                       ? 0
                       : seeds) {
    for (const Statistic& s : statistics.list())
      measured.emplace_back(units.count, Tally{std::vector<double>(s.bins()), std::vector<double>(s.bins())});
    simulated.assign(first_full + seeds, measured);
    std::size_t track = 0;
    for (const Played& p : of.played) add_run(run_of(p.full, {}), p.compared, statistics, units, track, measured);
    os::in_parallel(simulated.size(), threads, [&](std::size_t k) {
      std::size_t at = 0;
      for (std::size_t p = 0; p < of.played.size(); ++p) {
        const Scene& scene = k < first_full ? of.played[p].base : of.played[p].full;
        const proto::Model& written = k < first_full ? base.written : full.written;
        const Run run = run_of(scene, play(scene, written, 1 + k % seeds + p * 1000));
        add_run(run, of.played[p].compared, statistics, units, at, simulated[k]);
      }
      match_weights(measured, simulated[k]);
    });
  }

  /// All robots and seeds of one model.
  [[nodiscard]] Tally sum(const Statistic& statistic, std::size_t s, std::size_t first) const {
    Tally all = sum_of(statistic, simulated[first][s]);
    for (std::size_t k = first + 1; k < first + seeds; ++k) all.add(sum_of(statistic, simulated[k][s]));
    return all;
  }
  [[nodiscard]] Comparison comparison(const Statistic& statistic, std::size_t s, std::size_t first) const {
    std::vector<std::vector<Tally>> all;
    for (std::size_t k = first; k < first + seeds; ++k) all.push_back(simulated[k][s]);
    return compare(statistic, measured[s], all);
  }
};

identification::SimulatedStatistic entry_of(const Statistic& statistic, std::size_t s, const AllTallies& tallies,
                                            bool decidable) {
  const Comparison is = tallies.comparison(statistic, s, tallies.first_full),
                   was = tallies.first_full == 0 ? is : tallies.comparison(statistic, s, 0);
  const double scale = statistic.kind == Statistic::Kind::kSquares ? 100 : 1;  // logarithms in per cent
  identification::SimulatedStatistic entry;
  entry.set_name(statistic.name);
  entry.set_unit(statistic.distance_unit);
  entry.set_distance(scale * is.distance);
  entry.set_by_chance_95(scale * is.by_chance_95);
  entry.set_p(is.p);
  *entry.mutable_agrees() = decidable ? json_value(is.p >= kSurprise) : json_null();
  entry.set_base_distance(scale * was.distance);
  entry.set_base_p(was.p);
  return entry;
}

}  // namespace

void add_simulation_check(const WrittenModel& base, const WrittenModel& full, PreparedSet set, Tracks which,
                          std::uint32_t threads, identification::Identification& out) {
  set.find_headings(full.fitted, threads);
  const Comparable comparable(base, full, set, which);
  if (comparable.too_long) return;
  const BaseParameters& b = full.fitted.base;
  const TrackStatistics statistics(comparable.tracks, full.fitted.walls,
                                   std::hypot(b.ahead_mm - b.centre_mm, b.left_mm));
  if (statistics.list().empty() || comparable.robot_ticks * kFewestSeeds > kMostRobotTicks) return;
  const Units units(comparable.robots);
  const AllTallies tallies(comparable, statistics, units, base, full, threads);

  identification::Simulated& simulated = *out.mutable_result()->mutable_simulated();
  simulated.set_engine(full.fitted.contacts ? "planar" : "kinematic");
  simulated.set_seeds(static_cast<std::uint32_t>(tallies.seeds));
  simulated.set_runs(static_cast<std::uint32_t>(comparable.played.size()));
  simulated.set_units(static_cast<std::uint32_t>(units.count));
  simulated.set_unit(units.by_robot ? "robot" : "track");
  const bool decidable = units.count >= kFewestUnits;
  std::vector<identification::SimulatedStatistic> entries(statistics.list().size());
  os::in_parallel(entries.size(), threads,
                  [&](std::size_t s) { entries[s] = entry_of(statistics.list()[s], s, tallies, decidable); });
  bool agrees = true;
  for (std::size_t s = 0; s < entries.size(); ++s) {
    const Statistic& statistic = statistics.list()[s];
    agrees = agrees && entries[s].agrees().bool_value();
    *simulated.add_statistics() = std::move(entries[s]);
    add_plot(out, statistic, sum_of(statistic, tallies.measured[s]), tallies.sum(statistic, s, 0),
             tallies.sum(statistic, s, tallies.first_full));
  }
  *simulated.mutable_agrees() = decidable ? json_value(agrees) : json_null();
  simulated.set_in_words(words_of(simulated, decidable));
}

}  // namespace kilotwin::identify
