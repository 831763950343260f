/// The result of an identification from trajectories (idl/identification.proto), except for what is simulated.
#pragma once

#include "clients/identify/data/data_faults.hpp"
#include "clients/identify/findings.hpp"
#include "idl/identification.pb.h"

namespace kilotwin::identify {

/// `test`: null if there is none.
[[nodiscard]] identification::Identification document_of(const Findings&, const MeasuredSet& train,
                                                         const MeasuredSet* test, double horizon_s,
                                                         std::uint32_t threads);

/// Faults that were found before the fit.
void add_faults(identification::Result&, const std::vector<DataFault>&);

}  // namespace kilotwin::identify
