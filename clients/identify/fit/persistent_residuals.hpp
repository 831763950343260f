/// Unexplained effects within the fitted process noise.
///
/// The fitted noise contains everything that no term explains. White noise has no covariance between successive samples; an
/// effect has, because robots keep their place, command and neighbours for seconds. Over a horizon an effect adds up in
/// proportion to time, white noise to its root only: a forecast that takes one for the other is wrong, and looks sure.
#pragma once

#include "clients/identify/fit/fitter.hpp"

namespace kilotwin::identify {

/// Share of the process variance of speed, 0..1, that persists from sample to sample on the tracks of the fit. 0 if it is within
/// three standard errors (between tracks) of none.
[[nodiscard]] double persistent_share(const Fitter&, const FitState&);

/// The noise without a share of its process variance.
[[nodiscard]] Noise white_part(const Noise&, double persistent_share);
/// The model as it would be if only the white part of its process noise were noise: it expects smaller errors of itself.
[[nodiscard]] FitState with_white_noise(const Fitter&, const FitState&);

}  // namespace kilotwin::identify
