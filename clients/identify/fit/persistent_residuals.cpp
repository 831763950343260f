#include "clients/identify/fit/persistent_residuals.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "clients/identify/fit/speed_residuals.hpp"
#include "core/os/worker_pool.hpp"

namespace kilotwin::identify {
namespace {

/// Sums over pairs of residuals that are `lag` samples apart, of one track.
struct PairSums {
  double products = 0, weights = 0, process = 0;
};

PairSums sums_of(const std::vector<SpeedResidual>& all, std::size_t lag) {
  constexpr double kSameTime_s = 1e-6;  // rounding of times; a larger value joins intervals across gaps
  PairSums sums;
  for (std::size_t i = lag; i < all.size(); ++i) {
    bool together = true;
    for (std::size_t k = i - lag; k < i; ++k)
      together = together && std::abs(all[k].to_s - all[k + 1].from_s) < kSameTime_s;
    const SpeedResidual &a = all[i - lag], &b = all[i];
    const double weight = std::sqrt(a.information * b.information);
    if (!together || weight == 0) continue;
    sums.products += a.score * b.score / weight;
    sums.weights += weight;
    sums.process += weight * (a.process + b.process) / 2;
  }
  return sums;
}

/// The covariance of pairs over the process variance; 0 within chance.
double share_of(const std::vector<PairSums>& tracks) {
  constexpr std::size_t kFewest = 4;  // tracks; with fewer, their spread tells no standard error
  constexpr double kSure = 3;         // standard errors; a smaller value takes chance for persistence
  PairSums all;
  for (const PairSums& t : tracks) all.products += t.products, all.weights += t.weights, all.process += t.process;
  if (tracks.size() < kFewest || !(all.process > 0)) return 0;
  const double covariance = all.products / all.weights;
  double square = 0;
  for (const PairSums& t : tracks) square += std::pow(t.products - covariance * t.weights, 2);
  return covariance * all.weights > kSure * std::sqrt(square) ? all.products / all.process : 0;
}

}  // namespace

double persistent_share(const Fitter& fitter, const FitState& state) {
  const std::vector<TrackView>& views = state.tracks.views();
  // Tracker noise that the filter underrates makes neighbouring residuals opposite, but not those two samples apart.
  constexpr std::array<std::size_t, 2> kLags = {1, 2};
  std::array<std::vector<PairSums>, kLags.size()> sums;
  for (auto& of_lag : sums) of_lag.resize(views.size());
  os::in_parallel(views.size(), fitter.threads(), [&](std::size_t v) {
    if (views[v].track->held_out) return;
    RobotBias bias = state.model.bias_of(views[v].track->robot);
    bias.covariance.setZero();
    TrackFilter filter(state.model, bias, views[v].track->robot, views[v].number);
    SpeedResiduals residuals(state.model, kDriven);
    run_filter(filter, views[v], views[v].track->samples.size(), residuals);
    residuals.remove_mean();
    for (std::size_t i = 0; i < kLags.size(); ++i) sums[i][v] = sums_of(residuals.all, kLags[i]);
  });
  double largest = 0;
  for (auto& of_lag : sums) {
    std::erase_if(of_lag, [](const PairSums& s) { return s.weights == 0; });
    largest = std::max(largest, share_of(of_lag));
  }
  // Some noise is always white.
  constexpr double kMost = 0.98;
  return std::min(largest, kMost);
}

Noise white_part(const Noise& noise, double persistent_share) {
  Noise white = noise;
  white.factor_s *= 1 - persistent_share;
  white.wheel_mm2_s *= 1 - persistent_share;
  return white;
}

FitState with_white_noise(const Fitter& fitter, const FitState& fit) {
  FitState white = fit;
  white.model.noise = white_part(fit.model.noise, persistent_share(fitter, fit));
  return white;
}

}  // namespace kilotwin::identify
