/// Noise by maximum likelihood: of the motion and of the tracker, apart. Filters are led along their tracks once; about those
/// paths they are linear, so that other noises are tried by recursions over matrices that stay as they are.
#pragma once

#include <cstdint>
#include <vector>

#include "clients/identify/fit/filter_pass.hpp"

namespace kilotwin::identify {

/// The noise that makes these tracks most probable, walls' and contacts' as the model has them. Biases count as known.
[[nodiscard]] Noise most_likely_noise(const MotionModel&, const std::vector<const TrackView*>& tracks,
                                      bool has_headings, std::uint32_t threads);

}  // namespace kilotwin::identify
