/// Maximum-likelihood estimate of process and measurement noise. The filters run once. About their paths the model
/// is linear, so other variances only need a recursion over stored matrices.
#pragma once

#include <cstdint>
#include <vector>

#include "clients/identify/fit/filter_pass.hpp"
#include "clients/identify/fit/noise_restriction.hpp"

namespace kilotwin::identify {

/// The noise of maximum likelihood. Contact noise stays as in the model. Biases count as known.
[[nodiscard]] Noise most_likely_noise(const MotionModel&, const std::vector<const TrackView*>& tracks,
                                      bool has_headings, std::uint32_t threads);

/// Ends of intervals, and the noise of the largest likelihood. Ends are NaN where nothing was estimated: contact noise, and measured
/// headings of sets without.
struct NoiseInterval {
  Noise low, high;
  Noise most_likely;
};

/// 95 % intervals by profile likelihood. The likelihood is integrated over the biases and the other columns, which the fit adapts to
/// the noise. A variance that may as well be 0 has the end 0.
[[nodiscard]] NoiseInterval noise_interval(const MotionModel&, const std::vector<const TrackView*>& tracks,
                                           const NoiseRestriction& columns, bool has_headings,
                                           std::uint32_t threads);

}  // namespace kilotwin::identify
