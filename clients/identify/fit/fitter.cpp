#include "clients/identify/fit/fitter.hpp"

#include <algorithm>

#include "clients/identify/fit/noise_fit.hpp"

namespace kilotwin::identify {

std::vector<Block> blocks_of(const MotionModel& model) {
  std::vector<Block> blocks;
  for (const Term& term : model.terms) blocks.insert(blocks.end(), term.blocks.begin(), term.blocks.end());
  return blocks;
}

std::vector<const TrackView*> Fitter::some_tracks(std::size_t samples) const {
  std::vector<const TrackView*> chosen, all;
  for (const TrackView& view : set_.views())
    if (!view.track->held_out) all.push_back(&view);
  std::size_t sum = 0;
  for (std::size_t i = 0; i < all.size() && sum < samples; ++i) {
    chosen.push_back(all[(i * 7919) % all.size()]);
    sum += chosen.back()->track->samples.size();
  }
  std::sort(chosen.begin(), chosen.end());
  chosen.erase(std::unique(chosen.begin(), chosen.end()), chosen.end());
  return chosen;
}

void Fitter::fit_noise(MotionModel& model) const {
  model.noise = most_likely_noise(model, some_tracks(kEnoughSamples), set_.set().has_headings, threads_);
}

void Fitter::fit_base(MotionModel& model) const {
  const bool headings = set_.set().has_headings;
  if (headings) {
    set_.find_headings(model, threads_);
  } else {
    // In a small arena, a wrong tracked point and wrong walls can stabilise each other. The fit starts from both
    // likely tracked points and keeps the one with the higher likelihood.
    const std::vector<const TrackView*> tracks = some_tracks(kEnoughSamples);
    const MotionModel given = model;
    double best = -1e300;
    for (const double ahead_mm : {0.0, given.base.ahead_mm}) {
      MotionModel start = given;
      start.base.ahead_mm = ahead_mm;
      start.contact_range_mm = contact_range_of(start.base, headings);
      set_.find_headings(start, threads_);
      fit_walls(start);
      const double value = log_likelihood_with_contacts(start, tracks);
      if (value <= best) continue;
      best = value;
      model = start;
    }
    set_.find_headings(model, threads_);
    // Contacts that are not recognised would look like wheel noise.
    fit_contact_noise(model);
  }
  fit(model, 3);
  fit_disc_centre(model);
  // Without headings, walls, disc centres and contact noise depend on each other: alternate.
  constexpr int kMostRounds = 4;
  constexpr double kSettled = 20;
  double likelihood = -1e300;
  for (int round = 0; round < (headings ? 1 : kMostRounds); ++round) {
    if (headings || round > 0) fit_walls(model);
    if (round > 0) set_.find_centres(model, threads_);
    fit_contact_noise(model);
    fit(model, 2);
    const double found = log_likelihood(model);
    if (found < likelihood + kSettled) break;
    likelihood = found;
  }
  if (contacts_contradict_geometry(model)) {
    model = with_uncertain_walls(model);
    fit(model, 2);
  }
}

void Fitter::fit(MotionModel& model, int passes) const {
  // A new camera map changes the positions of walls and of encounters.
  const bool new_camera_map = !model.terms.empty() && is_camera_map(model.terms.back());
  if (passes > 1 && new_camera_map) fit_camera_distortion(model);
  for (int pass = 0; pass < passes; ++pass) {
    set_.find_headings(model, threads_);
    update_walls(model);
    // New terms explain part of the former noise once they have their amplitude.
    if (pass != 0 || passes == 1) fit_noise(model);
    step(model);
  }
}

}  // namespace kilotwin::identify
