/// Camera distortion along lines through the middle of the picture, as lenses and tilted cameras cause it.
#pragma once

#include <cstddef>

#include "clients/identify/fit/fitter.hpp"

namespace kilotwin::identify {

/// Replaces a free map of the camera distortion if the evidence rises. The new form is one number per place: the scale of the picture.
/// A map of low order holds the rest, such as that of a centre beside the origin. The form has about half the columns. It
/// is therefore more accurate where few robots were.
void fit_central_distortion(const Fitter&, FitState&, std::size_t term);

}  // namespace kilotwin::identify
