#include "clients/identify/search/visits.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "clients/identify/fit/speed_residuals.hpp"
#include "core/os/worker_pool.hpp"

namespace kilotwin::identify {

Visits visits_of(const Fitter& fitter, const FitState& state, std::uint8_t during) {
  const MotionModel& model = state.model;
  const PreparedSet& set = state.tracks;
  const std::vector<TrackView>& views = set.views();
  std::vector<std::vector<SpeedResidual>> residuals(views.size());
  os::in_parallel(views.size(), fitter.threads(), [&](std::size_t v) {
    if (views[v].track->held_out) return;
    RobotBias bias = model.bias_of(views[v].track->robot);
    bias.covariance.setZero();
    TrackFilter filter(model, bias, views[v].track->robot, views[v].number);
    SpeedResiduals sums(model, during);
    run_filter(filter, views[v], views[v].track->samples.size(), sums);
    sums.remove_mean();
    residuals[v] = std::move(sums.all);
  });
  // Robots times instants, at most about: beyond, instants are left out. More cost time for each grid of cells that is
  // tried.
  constexpr std::size_t kMost = 150000;
  const auto tracks_of = [&](std::size_t r) { return set.set().runs[r].tracks.size(); };
  std::vector<std::vector<Instant>> runs(set.set().runs.size());
  std::size_t all = 0;
  for (std::size_t r = 0; r < runs.size(); ++r)
    if (tracks_of(r) > 0) all += set.neighbours(r).instants() * tracks_of(r);
  const std::size_t every = all / kMost + 1;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const RunNeighbours& near = set.neighbours(r);
    const std::size_t tracks = tracks_of(r);
    if (tracks == 0) continue;
    runs[r].resize((near.instants() + every - 1) / every);
    // [track][instant].
    std::vector<std::vector<std::pair<float, float>>> known(tracks);
    for (std::size_t v = 0; v < views.size(); ++v) {
      if (views[v].run != r) continue;
      auto& own = known[views[v].place];
      own.assign(runs[r].size(), {0.0F, 0.0F});
      for (const SpeedResidual& residual : residuals[v]) {
        const auto at = [&](double time_s) {
          const double i = std::ceil((time_s - near.time_s(0)) / RunNeighbours::kRaster_s - 1e-6);
          return static_cast<std::size_t>(std::clamp(i, 0.0, static_cast<double>(near.instants())));
        };
        const std::size_t first = at(residual.from_s), last = at(residual.to_s);
        const auto share = 1.0F / static_cast<float>(std::max<std::size_t>(last - first, 1));
        for (std::size_t i = first; i < last; ++i) {
          own[i / every].first += share * static_cast<float>(residual.score);
          own[i / every].second += share * static_cast<float>(residual.information);
        }
      }
    }
    for (std::size_t i = 0; i < runs[r].size(); ++i) {
      for (std::size_t t = 0; t < tracks; ++t) {
        const RunNeighbours::Spot& s = near.spot(t, i * every);
        if (std::isnan(s.x_mm)) continue;
        const auto [score, information] = known[t].empty() ? std::pair{0.0F, 0.0F} : known[t][i];
        runs[r][i].push_back({static_cast<std::uint32_t>(t), static_cast<float>(s.x_mm), static_cast<float>(s.y_mm),
                              score, information, s.driven});
      }
    }
  }
  return {std::move(runs), static_cast<double>(every) * RunNeighbours::kRaster_s};
}

}  // namespace kilotwin::identify
