#include "clients/identify/replay/simulation_check.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "clients/identify/replay/replay.hpp"
#include "clients/identify/replay/track_statistics.hpp"
#include "core/os/worker_pool.hpp"

namespace kilotwin::identify {
namespace {

using nlohmann::json;

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

json means_of(const Tally& tally) {
  json out = json::array();
  for (std::size_t i = 0; i < tally.weight.size(); ++i)
    out.push_back(tally.weight[i] > 0 ? json(tally.sum[i] / tally.weight[i]) : json());
  return out;
}

/// Plot data of a statistic, summed over all robots.
void add_plot(json& out, const Statistic& statistic, const Tally& measured, const Tally& base, const Tally& full) {
  switch (statistic.kind) {
    case Statistic::Kind::kHistogram:
      out["distributions"].push_back({{"name", statistic.name},
                                      {"unit", statistic.unit},
                                      {"edges", statistic.at},
                                      {"measured", measured.weight},
                                      {"base", base.weight},
                                      {"simulated", full.weight}});
      return;
    case Statistic::Kind::kSquares:
      out["msd"] = {{"lag_s", statistic.at},
                    {"measured_mm2", means_of(measured)},
                    {"base_mm2", means_of(base)},
                    {"simulated_mm2", means_of(full)}};
      return;
    case Statistic::Kind::kMeans:
      if (statistic.at.size() < 2) return;
      out["speed_over_time"] = {{"time_s", statistic.at},
                                {"measured_mm_s", means_of(measured)},
                                {"base_mm_s", means_of(base)},
                                {"simulated_mm_s", means_of(full)}};
      return;
  }
}

std::string words_of(const json& statistics, bool decidable, const char* unit) {
  if (!decidable) return fmt::format("Too few {}s for the permutation test.", unit);
  std::vector<std::string> differ, differed;
  for (const json& s : statistics) {
    if (!s["agrees"].get<bool>()) differ.push_back(s["name"]);
    if (s["base_p"].get<double>() < kSurprise) differed.push_back(s["name"]);
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

}  // namespace

json simulation_check(const WrittenModel& base, const WrittenModel& full, PreparedSet set, Tracks which,
                      std::uint32_t threads) {
  set.find_headings(full.fitted, threads);
  const std::size_t runs = set.set().runs.size();
  std::vector<Played> played;
  std::vector<const Track*> tracks;
  std::vector<std::uint32_t> robots;
  double cost = 0;
  for (std::size_t run = 0; run < runs; ++run) {
    Played p{scene_of(base.fitted, set, run), scene_of(full.fitted, set, run), {}};
    for (std::size_t r = 0; r < p.full.robots.size(); ++r) {
      const Track* const track = p.full.robots[r].track;
      if (!counts(*track, which)) continue;
      p.compared.push_back(r);
      tracks.push_back(track);
      robots.push_back(track->robot);
    }
    if (p.compared.empty()) continue;
    if (p.full.duration_s() > kLongestPlay_s || p.full.duration_s() <= 0) return json::object();
    cost += robot_ticks(p.full);
    played.push_back(std::move(p));
  }
  const BaseParameters& b = full.fitted.base;
  const TrackStatistics statistics(tracks, full.fitted.walls, std::hypot(b.ahead_mm - b.centre_mm, b.left_mm));
  if (statistics.list().empty() || cost * kFewestSeeds > kMostRobotTicks) return json::object();
  const auto seeds =
      static_cast<std::size_t>(std::clamp(kMostRobotTicks / cost, double{kFewestSeeds}, double{kMostSeeds}));

  const Units units(robots);
  Tallies none;
  for (const Statistic& s : statistics.list())
    none.emplace_back(units.count, Tally{std::vector<double>(s.bins()), std::vector<double>(s.bins())});
  Tallies measured = none;
  std::size_t track = 0;
  for (const Played& p : played) add_run(run_of(p.full, {}), p.compared, statistics, units, track, measured);
  // Base model with each seed first, then the full model. Without effects both are one.
  const std::size_t first_full = full.fitted.terms.empty() ? 0 : seeds;
  std::vector<Tallies> simulated(first_full + seeds, none);
  os::in_parallel(simulated.size(), threads, [&](std::size_t k) {
    std::size_t at = 0;
    for (std::size_t p = 0; p < played.size(); ++p) {
      const Scene& scene = k < first_full ? played[p].base : played[p].full;
      const proto::Model& written = k < first_full ? base.written : full.written;
      const Run run = run_of(scene, play(scene, written, 1 + k % seeds + p * 1000));
      add_run(run, played[p].compared, statistics, units, at, simulated[k]);
    }
    match_weights(measured, simulated[k]);
  });

  json out, list = json::array();
  const bool decidable = units.count >= kFewestUnits;
  bool agrees = true;
  std::vector<json> entries(statistics.list().size());
  os::in_parallel(entries.size(), threads, [&](std::size_t s) {
    const Statistic& statistic = statistics.list()[s];
    const auto of = [&](std::size_t first) {
      std::vector<std::vector<Tally>> all;
      for (std::size_t k = first; k < first + seeds; ++k) all.push_back(simulated[k][s]);
      return compare(statistic, measured[s], all);
    };
    const Comparison is = of(first_full), was = first_full == 0 ? is : of(0);
    const double scale = statistic.kind == Statistic::Kind::kSquares ? 100 : 1;  // logarithms in per cent
    entries[s] = {{"name", statistic.name},
                  {"unit", statistic.distance_unit},
                  {"distance", scale * is.distance},
                  {"by_chance_95", scale * is.by_chance_95},
                  {"p", is.p},
                  {"agrees", decidable ? json(is.p >= kSurprise) : json()},
                  {"base_distance", scale * was.distance},
                  {"base_p", was.p}};
  });
  for (std::size_t s = 0; s < entries.size(); ++s) {
    const Statistic& statistic = statistics.list()[s];
    list.push_back(entries[s]);
    if (decidable) agrees = agrees && entries[s]["agrees"].get<bool>();
    const auto sum = [&](std::size_t first) {
      Tally all = sum_of(statistic, simulated[first][s]);
      for (std::size_t k = first + 1; k < first + seeds; ++k) all.add(sum_of(statistic, simulated[k][s]));
      return all;
    };
    add_plot(out, statistic, sum_of(statistic, measured[s]), sum(0), sum(first_full));
  }
  const char* const unit = units.by_robot ? "robot" : "track";
  out["simulated"] = {{"engine", full.fitted.contacts ? "planar" : "kinematic"},
                      {"seeds", seeds},
                      {"runs", played.size()},
                      {"units", units.count},
                      {"unit", unit},
                      {"statistics", list},
                      {"agrees", decidable ? json(agrees) : json()},
                      {"in_words", words_of(list, decidable, unit)}};
  return out;
}

}  // namespace kilotwin::identify
