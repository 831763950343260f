/// 95 % bands of the curves, maps, tables and products of a fitted model.
#pragma once

#include <vector>

#include "clients/identify/fit/step_intervals.hpp"
#include "clients/identify/fit/uncertainty.hpp"
#include "clients/identify/result/values.hpp"
#include "idl/identification.pb.h"

namespace kilotwin::identify {

/// One entry per block of a term: `block` (from 1), `axes` with one entry per covariate, `value`, `low` and `high` at each place of
/// `at`. A place is a number, or a list of one number per axis; the first axis runs fastest. Without covariates it is null. Values have
/// the unit of the block's target, places that of the covariate. A block that is a product has the values of the product.
[[nodiscard]] JsonList bands_of(const MotionModel&, std::size_t term, const Uncertainty&,
                                const std::vector<StepInterval>& = {});

/// Sets the 95 % band of a curve or map of the term, if some blocks of the term have its values.
void set_band(identification::EffectCurve&, const MotionModel&, std::size_t term, const Uncertainty&,
              const std::vector<StepInterval>& = {});
void set_band(identification::EffectMap&, const MotionModel&, std::size_t term, const Uncertainty&,
              const std::vector<StepInterval>& = {});

}  // namespace kilotwin::identify
