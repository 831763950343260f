#include "clients/identify/track_search.hpp"

#include <utility>
#include <vector>

#include "clients/identify/fit/persistent_residuals.hpp"
#include "clients/identify/last_check.hpp"
#include "clients/identify/predict/prediction_errors.hpp"
#include "clients/identify/search/floor_parts.hpp"
#include "clients/identify/stall_effect.hpp"
#include "clients/identify/unexplained/prediction_windows.hpp"
#include "clients/identify/unexplained/unexplained.hpp"

namespace kilotwin::identify {
namespace {

/// Whether a model leaves a large systematic error of the tracks of its fit.
bool leaves_much(const Fitter& fitter, const FitState& fit, const MeasuredSet& train, const ForecastTimes& times) {
  const std::uint32_t threads = fitter.threads();
  const std::vector<Forecast> all = forecast(fit.model, fit.tracks, times, Tracks::kFit, threads);
  const FitState white = with_white_noise(fitter, fit);
  const std::vector<Forecast> expected = forecast(white.model, fit.tracks, times, Tracks::kFit, threads);
  // Motion in contact is uncertain, and no effect.
  const std::vector<Forecast> free =
      from_known_starts(free_ones(fit.model, fit.tracks, with_expectations_of(expected, all), times.horizon_s));
  return leaves_systematic_error(train, windows_of(fit.tracks, free, times.horizon_s), errors_of(train, free),
                                 replicates_of({{&train, &free}}, times.horizon_s), threads);
}

Search searched(const Fitter& fitter, const FitState& base, const MeasuredSet& train, const ForecastTimes& times,
                const WorkLog& log) {
  Search found =
      search(fitter, base, log, [&](const FitState& fit) { return leaves_much(fitter, fit, train, times); });
  log.begin(kTermChecks, "search", "checking each effect", found.fit.model.terms.size());
  keep_predictive_terms(fitter, train, times, found);
  fit_floor_parts(fitter, found);
  return found;
}

/// The base model beside the spells of another state.
FitState with_spells_of(const Fitter& fitter, const FitState& other, const FitState& base) {
  FitState out = other;
  out.model = base.model;
  out.model.stalls = other.model.stalls;
  out.scale = base.scale;
  out.tracks.set_command_lag(base.model.base.command_lag_s);
  out.tracks.find_centres(out.model, fitter.threads());
  fitter.fit(out, 2);
  return out;
}

void leave_out_stalls(const Fitter& fitter, FitState& fit) {
  fit.model.stalls.reset();
  fit.tracks.set_spells(std::vector<std::vector<float>>(fit.tracks.views().size()));
  fitter.fit(fit, 2);
}

}  // namespace

Search search_tracks(const Fitter& fitter, const FitState& base, const MeasuredSet& train,
                     const ForecastTimes& times, const WorkLog& log) {
  Search found = searched(fitter, base, train, times, log);
  if (found.fit.model.terms.empty()) return found;
  FitState stalling = found.fit;
  if (!find_stalls(fitter, stalling)) return found;
  Search again = searched(fitter, with_spells_of(fitter, stalling, base), train, times, log);
  leave_out_stalls(fitter, again.fit);
  for (Stage& stage : again.path) leave_out_stalls(fitter, stage.fit);
  if (again.with_curves) leave_out_stalls(fitter, again.with_curves->fit);
  return again;
}

}  // namespace kilotwin::identify
