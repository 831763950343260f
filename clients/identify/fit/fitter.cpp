#include "clients/identify/fit/fitter.hpp"

#include <algorithm>
#include <functional>
#include <numeric>

namespace kilotwin::identify {

std::vector<Block> blocks_of(const MotionModel& model) {
  std::vector<Block> blocks;
  for (const Term& term : model.terms) blocks.insert(blocks.end(), term.blocks.begin(), term.blocks.end());
  return blocks;
}

void Fitter::fit_noise(FitState& state) const {
  state.model.noise = most_likely_noise(state.model, state.tracks.some_tracks(kEnoughSamples), headings_, threads_);
}

NoiseInterval Fitter::noise_interval(const FitState& state) const {
  const std::vector<const TrackView*> some = state.tracks.some_tracks(kEnoughSamples);
  const auto samples = [](const std::vector<const TrackView*>& tracks) {
    return std::transform_reduce(tracks.begin(), tracks.end(), 0.0, std::plus<>(), [](const TrackView* view) {
      return static_cast<double>(view->track->samples.size());
    });
  };
  double all = 0;
  for (const std::vector<const TrackView*>& unit : state.tracks.units()) all += samples(unit);
  const NoiseRestriction columns = noise_restriction(*this, state, samples(some) / std::max(1.0, all));
  return identify::noise_interval(state.model, some, columns, headings_, threads_);
}

void Fitter::fit_base(FitState& state) const {
  if (headings_) {
    state.tracks.find_headings(state.model, threads_);
  } else {
    // In a small arena, a wrong tracked point and wrong walls can stabilise each other. The fit starts from both
    // likely tracked points and keeps the one with the higher likelihood.
    const FitState given = state;
    double best = -1e300;
    for (const double ahead_mm : {0.0, given.model.base.ahead_mm}) {
      FitState start = given;
      start.model.base.ahead_mm = ahead_mm;
      start.model.contact_range_mm = contact_range_of(start.model.base, headings_);
      start.tracks.find_headings(start.model, threads_);
      fit_walls(start);
      const double value = log_likelihood_with_contacts(start.model, start.tracks.some_tracks(kEnoughSamples));
      if (value <= best) continue;
      best = value;
      state = start;
    }
    // The walls changed the model since the headings were estimated.
    state.tracks.find_headings(state.model, threads_);
    // Contacts that are not recognised would look like wheel noise.
    fit_contact_noise(state);
  }
  fit(state, 3);
  fit_disc_centre(state);
  // Without headings, walls, disc centres and contact noise depend on each other: alternate.
  constexpr int kMostRounds = 4;
  constexpr double kSettled = 20;
  double likelihood = -1e300;
  for (int round = 0; round < (headings_ ? 1 : kMostRounds); ++round) {
    if (headings_ || round > 0) fit_walls(state);
    if (round > 0) state.tracks.find_centres(state.model, threads_);
    fit_contact_noise(state);
    fit(state, 2);
    const double found = log_likelihood(state);
    if (found < likelihood + kSettled) break;
    likelihood = found;
  }
  if (contacts_contradict_geometry(state)) {
    set_uncertain_walls(state.model);
    fit(state, 2);
  }
}

void Fitter::fit(FitState& state, int passes) const { fit_passes(state, passes); }

double Fitter::fit_for_likelihood(FitState& state, int passes) const {
  const std::optional<double> known = fit_passes(state, passes);
  return known ? *known : log_likelihood(state);
}

void Fitter::fit_until_settled(FitState& state) const {
  // Passes of the first fit, and single ones that may follow. More cost time where a fit converges slowly; fewer leave it
  // far from its end.
  constexpr int kFirst = 2, kMostMore = 6;
  // Beside a large error that the model lacked, a fit of two passes is far from its end; most fits are near it.
  constexpr double kHardly = 20, kHardlyOfGain = 0.02;
  const double before = log_likelihood(state);
  double likelihood = fit_for_likelihood(state, kFirst);
  for (int pass = 0; pass < kMostMore; ++pass) {
    const double found = fit_for_likelihood(state, 1), rise = found - likelihood;
    likelihood = found;
    if (rise < std::max(kHardly, kHardlyOfGain * (likelihood - before))) return;
  }
}

std::optional<double> Fitter::fit_passes(FitState& state, int passes) const {
  // A new camera map changes the positions of walls and of encounters.
  const bool new_camera_map = !state.model.terms.empty() && is_camera_map(state.model.terms.back());
  if (passes > 1 && new_camera_map) fit_camera_distortion(state);
  std::optional<double> likelihood;
  for (int pass = 0; pass < passes; ++pass) {
    state.tracks.find_headings(state.model, threads_);
    update_walls(state);
    // New terms explain part of the former noise once they have their amplitude.
    if (pass != 0 || passes == 1) fit_noise(state);
    likelihood = step(state);
  }
  return likelihood;
}

}  // namespace kilotwin::identify
