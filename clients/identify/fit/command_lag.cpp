#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <utility>

#include "clients/identify/fit/fitter.hpp"
#include "clients/identify/fit/profile.hpp"

namespace kilotwin::identify {
namespace {

/// Range of lags, s. Beyond, a clock is wrong by more than a constant.
constexpr double kLeast_s = -0.6, kMost_s = 1.0;
/// Spacing of the first search, and of its last refinement, s.
constexpr double kCoarse_s = 0.1, kFine_s = 0.004;
/// Least gain in log likelihood, by a factor of e^8: one number is fitted, and few sets have a lag.
constexpr double kLeastGain = 8;
/// Distance of the points of the first estimate, s, and the share of the required gain that it must promise.
constexpr double kProbe_s = 0.05, kPromise = 0.5;
/// Rounds of lag and base parameters in turn.
constexpr int kRounds = 2;

/// Height of the maximum of a parabola over its middle point, from three values; infinite if it has none.
double height_of_maximum(double low, double middle, double high) {
  const double slope = (high - low) / 2, curvature = 2 * middle - high - low;
  return curvature > 0 ? slope * slope / (2 * curvature) : INFINITY;
}

/// Share of the samples of the fit in some tracks.
double share_of(const FitState& state, const std::vector<std::size_t>& views) {
  double part = 0, all = 0;
  for (const std::size_t v : views) part += static_cast<double>(state.tracks.views()[v].track->samples.size());
  for (const TrackView& view : state.tracks.views())
    if (!view.track->held_out) all += static_cast<double>(view.track->samples.size());
  return part / all;
}

/// The log likelihood of some tracks as a function of the lag.
class LagLikelihood {
 public:
  using Likelihood = std::function<double(const MotionModel&, const std::vector<const TrackView*>&)>;
  LagLikelihood(Likelihood likelihood, const FitState& from, const std::vector<std::size_t>& views)
      : likelihood_(std::move(likelihood)),
        from_(from),
        views_(views),
        now_s_(from.model.base.command_lag_s),
        best_s_(now_s_) {}

  /// Goes to the maximum and returns the gain; 0 if the values nearby promise less than `least_gain`.
  double climb(double least_gain) {
    if (height_of_maximum(at(now_s_ - kProbe_s), at(now_s_), at(now_s_ + kProbe_s)) < least_gain) return 0;
    // There is one maximum: climbs on ever finer rasters.
    double step_s = kCoarse_s;
    while (step_s > kFine_s) {
      for (const double sign : {1.0, -1.0})
        while (moved(sign * step_s)) {}
      step_s /= 2.5;
    }
    return at(best_s_) - at(now_s_);
  }
  [[nodiscard]] FitState best() const { return with_lag(best_s_); }

 private:
  [[nodiscard]] FitState with_lag(double lag_s) const {
    FitState trial = from_;
    trial.model.base.command_lag_s = lag_s;
    trial.tracks.set_command_lag(lag_s);
    return trial;
  }
  double at(double lag_s) {
    if (const auto known = known_.find(lag_s); known != known_.end()) return known->second;
    const FitState trial = with_lag(lag_s);
    std::vector<const TrackView*> tracks;
    for (const std::size_t v : views_) tracks.push_back(&trial.tracks.views()[v]);
    return known_[lag_s] = likelihood_(trial.model, tracks);
  }
  bool moved(double by_s) {
    const double to_s = best_s_ + by_s;
    if (to_s < kLeast_s || to_s > kMost_s || at(to_s) <= at(best_s_)) return false;
    best_s_ = to_s;
    return true;
  }

  const Likelihood likelihood_;
  const FitState& from_;
  const std::vector<std::size_t>& views_;
  std::map<double, double> known_;
  double now_s_, best_s_;
};

}  // namespace

double Fitter::fit_command_lag(FitState& state, double least_gain) const {
  least_gain = std::max(least_gain, kLeastGain);
  const bool changes = std::any_of(state.tracks.views().begin(), state.tracks.views().end(),
                                   [](const TrackView& view) { return view.track->commands.size() > 1; });
  if (!changes) return 0;
  const std::vector<std::size_t> some = state.tracks.some_views(kEnoughSamples);
  const double least_of_some = kPromise * least_gain * share_of(state, some);
  FitState best = state;
  for (int round = 0; round < kRounds; ++round) {
    LagLikelihood likelihood(
        [this](const auto& model, const auto& tracks) { return log_likelihood_with_contacts(model, tracks); }, best,
        some);
    const double gain = likelihood.climb(round == 0 ? least_of_some : 0);
    if (round == 0 && gain < least_of_some) return 0;
    best = likelihood.best();
    // The base parameters were fitted beside the former lag.
    if (best.model.terms.empty())
      fit_base(best);
    else
      fit(best, 1);
  }
  const double gain = log_likelihood_of_all(best) - log_likelihood_of_all(state);
  if (gain < least_gain) return 0;
  state = std::move(best);
  return gain;
}

std::pair<double, double> Fitter::command_lag_interval(const FitState& state) const {
  // Start of the search for an end of the interval, and distance from which on the end counts as unknown. Another start
  // costs some steps.
  constexpr double kFirst_s = 0.01, kFarthest_s = 0.5;
  // Base parameters, biases and coefficients follow the lag by one step each.
  const auto value = [&](double lag_s) {
    FitState trial = state;
    trial.model.base.command_lag_s = lag_s;
    trial.tracks.set_command_lag(lag_s);
    step(trial);
    return log_likelihood_of_all(trial);
  };
  const double at_s = state.model.base.command_lag_s, most = value(at_s);
  const auto distance_s = [&](double sign) {
    return profile_distance([&](double far_s) { return most - value(at_s + sign * far_s); }, kFirst_s, kFarthest_s);
  };
  return {at_s - distance_s(-1), at_s + distance_s(1)};
}

}  // namespace kilotwin::identify
