#include "clients/identify/fit/numbering.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <map>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "core/stats/resampling.hpp"

namespace kilotwin::identify {
namespace {

/// Least number of tracks of a run.
constexpr std::size_t kFewestTracks = 5;

/// The biases of one track by its own measurements.
struct TrackBias {
  std::uint32_t robot, run;
  Eigen::Vector2d mean_mm_s;
  Eigen::Matrix2d precision;
};

/// Precision-weighted means and the sum of squares about them.
struct Pool {
  Eigen::Matrix2d precision = Eigen::Matrix2d::Zero();
  Eigen::Vector2d weighted = Eigen::Vector2d::Zero();
  double square = 0;
  int count = 0;
  void add(const TrackBias& t) {
    precision += t.precision;
    weighted += t.precision * t.mean_mm_s;
    square += t.mean_mm_s.dot(t.precision * t.mean_mm_s);
    ++count;
  }
  [[nodiscard]] Eigen::Vector2d mean() const { return precision.inverse() * weighted; }
  [[nodiscard]] double spread() const { return square - weighted.dot(mean()); }
};

std::vector<TrackBias> track_biases(const Fitter& fitter, const FitState& base) {
  const MotionModel& model = base.model;
  std::vector<std::vector<const TrackView*>> tracks;
  for (const TrackView& view : base.tracks.views())
    if (!view.track->held_out && view.track->samples.size() > 1) tracks.push_back({&view});
  const std::vector<Unit> units = linearise(model, tracks, blocks_of(model), {100, fitter.threads()});
  const double prior = 1 / (model.base.bias_sd_mm_s * model.base.bias_sd_mm_s);
  std::vector<TrackBias> out;
  for (std::size_t u = 0; u < units.size(); ++u) {
    const Eigen::Matrix2d all = units[u].bias_covariance.inverse(), own = all - prior * Eigen::Matrix2d::Identity();
    if (own.determinant() < prior * prior) continue;  // a track that tells next to nothing
    const std::uint32_t robot = tracks[u].front()->track->robot;
    const Eigen::Vector2d weighted = all * (model.bias_of(robot).mean_mm_s + units[u].bias_step) -
                                     prior * Eigen::Vector2d::Constant(model.base.bias_mean_mm_s);
    out.push_back({robot, tracks[u].front()->run, own.inverse() * weighted, own});
  }
  std::map<std::uint32_t, Pool> runs;
  for (const TrackBias& t : out) runs[t.run].add(t);
  for (TrackBias& t : out) t.mean_mm_s -= runs[t.run].mean();
  return out;
}

/// Sum of squares of the biases about the means of their robots' numbers.
double within(const std::vector<TrackBias>& tracks) {
  std::map<std::uint32_t, Pool> robots;
  for (const TrackBias& t : tracks) robots[t.robot].add(t);
  double sum = 0;
  for (const auto& [robot, pool] : robots) sum += pool.spread();
  return sum;
}

}  // namespace

Numbering numbering_of(const Fitter& fitter, const FitState& base) {
  // Random numberings; more make the p value finer, and cost time in proportion.
  constexpr std::size_t kTrials = 400;
  std::vector<TrackBias> tracks = track_biases(fitter, base);
  std::map<std::uint32_t, std::vector<std::size_t>> runs;
  for (std::size_t t = 0; t < tracks.size(); ++t) runs[tracks[t].run].push_back(t);
  std::erase_if(runs, [](const auto& run) { return run.second.size() < kFewestTracks; });
  if (runs.size() < 2) return {};
  std::map<std::uint32_t, std::set<std::uint32_t>> runs_of;
  for (const TrackBias& t : tracks) runs_of[t.robot].insert(t.run);
  // If no number occurs in two runs, there is nothing to compare.
  if (std::none_of(runs_of.begin(), runs_of.end(), [](const auto& of) { return of.second.size() > 1; })) return {};
  Pool all;
  for (const TrackBias& t : tracks) all.add(t);
  Numbering out;
  out.spread = all.spread() / (2.0 * (all.count - 1));
  const double own = within(tracks);
  std::mt19937_64 engine(20191);
  std::size_t as_good = 0;
  for (std::size_t trial = 0; trial < kTrials; ++trial) {
    std::vector<TrackBias> drawn = tracks;
    for (const auto& entry : runs) {
      const std::vector<std::size_t>& members = entry.second;
      stats::permute(
          members.size(), [&](std::size_t n) { return engine() % n; },
          [&](std::size_t i, std::size_t j) { std::swap(drawn[members[i]].robot, drawn[members[j]].robot); });
    }
    as_good += within(drawn) <= own ? 1u : 0u;
  }
  out.chance = stats::permutation_p(as_good, kTrials);
  return out;
}

}  // namespace kilotwin::identify
