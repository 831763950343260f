/// Effects as written, for people: how large each is, and where.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "idl/effects.pb.h"

namespace kilotwin::identify {

/// "+26 % at 0 s, -20 % at 200 s": the sizes of records of one cause, but for products of functions. Empty where there is no other.
/// Where all records have the same first factor it is taken for the amount: "...; times 0.1 (robot 3) to 1.9 (robot 17)". Curves and
/// maps are then shown as they are where the amount is 1.
[[nodiscard]] std::string size_in_words(const std::vector<proto::Effect>&);

/// Those records that are a curve over one covariate, and no part of a map: [{name, covariate, unit, acts_on, acts_on_unit, at [..], value [..]}].
[[nodiscard]] nlohmann::json curves_of(const std::string& name, const std::vector<proto::Effect>&);

/// Those that are maps over the arena, added up where they act alike: [{name, which, acts_on, unit, x_mm [..], y_mm [..],
/// effect [[..] by y]}].
[[nodiscard]] nlohmann::json maps_of(const std::string& name, const std::vector<proto::Effect>&);

}  // namespace kilotwin::identify
