/// Effect records in words and as plot data.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "idl/effects.pb.h"

namespace kilotwin::identify {

/// "+26 % at 0 s, -20 % at 200 s": the sizes of the records of one term. Empty for products of functions. If all
/// records share their first factor, that factor is an amplitude: "...; times 0.1 (robot 3) to 1.9 (robot 17)".
/// The curve is then given at amplitude 1.
[[nodiscard]] std::string size_in_words(const std::vector<proto::Effect>&);

/// Records that are curves over one covariate: [{name, covariate, unit, acts_on, acts_on_unit, at [..], value
/// [..]}].
[[nodiscard]] nlohmann::json curves_of(const std::string& name, const std::vector<proto::Effect>&);

/// Records that are maps over the arena, summed per target: [{name, which, acts_on, unit, x_mm [..], y_mm [..],
/// effect [y][x]}].
[[nodiscard]] nlohmann::json maps_of(const std::string& name, const std::vector<proto::Effect>&);

}  // namespace kilotwin::identify
