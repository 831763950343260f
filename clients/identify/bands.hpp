/// 95 % bands of the curves and maps of a fitted model.
#pragma once

#include "clients/identify/fit/uncertainty.hpp"
#include "clients/identify/result/values.hpp"
#include "idl/identification.pb.h"

namespace kilotwin::identify {

/// One entry per block of a term that depends on one covariate, on position, or on nothing: `block` (from 1), `value`, `low`
/// and `high` at each place of `at`. Values have the unit of the block's target; places that of the covariate. Blocks that
/// depend on the other robots' paths or on a product of covariates have none, nor have maps with edges.
[[nodiscard]] JsonList bands_of(const MotionModel&, std::size_t term, const Uncertainty&);

/// Sets the 95 % band of a curve or map of the term, if the blocks of the term that have its values depend on nothing else.
void set_band(identification::EffectCurve&, const MotionModel&, std::size_t term, const Uncertainty&);
void set_band(identification::EffectMap&, const MotionModel&, std::size_t term, const Uncertainty&);

}  // namespace kilotwin::identify
