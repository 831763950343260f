/// Effect records in words and as plot data.
#pragma once

#include <string>
#include <vector>

#include "idl/effects.pb.h"
#include "idl/identification.pb.h"

namespace kilotwin::identify {

/// "+26 % at 0 s, -20 % at 200 s": the sizes of the records of one term. Empty for products of functions. If all
/// records share their first factor, that factor is an amplitude: "...; times 0.1 (robot 3) to 1.9 (robot 17)".
/// The curve is then given at amplitude 1.
[[nodiscard]] std::string size_in_words(const std::vector<proto::Effect>&);

/// Records that are curves over one covariate.
[[nodiscard]] std::vector<identification::EffectCurve> curves_of(const std::string& name,
                                                                 const std::vector<proto::Effect>&);

/// Records that are maps over the arena, summed per target.
[[nodiscard]] std::vector<identification::EffectMap> maps_of(const std::string& name,
                                                             const std::vector<proto::Effect>&);

}  // namespace kilotwin::identify
