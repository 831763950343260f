/// The result document of an identification from trajectories (identify.hpp), except for what is simulated.
#pragma once

#include <nlohmann/json.hpp>

#include "clients/identify/findings.hpp"

namespace kilotwin::identify {

/// `test`: null if there is none.
[[nodiscard]] nlohmann::json document_of(const Findings&, const MeasuredSet& train, const MeasuredSet* test,
                                         double horizon_s, std::uint32_t threads);

}  // namespace kilotwin::identify
