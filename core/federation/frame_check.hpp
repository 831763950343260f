/// Checks of received samples against the plan, before an engine uses them. Engines index arrays by robot ids from frames, and any
/// program on the DDS domain can write a sample.
#pragma once

#include "core/federation/schedule.hpp"
#include "core/frames/frames.hpp"
#include "core/plan/plan.hpp"

namespace kilotwin {

/// The first defect of a frame from `publisher` for `reader`, as a clause for an error line; nullptr if the frame is valid.
[[nodiscard]] const char* defect(const BodyFrame&, const RunPlan&, FederateId publisher, FederateId reader);
[[nodiscard]] const char* defect(const ActuationFrame&, const RunPlan&, FederateId publisher, FederateId reader);
[[nodiscard]] const char* defect(const RadioFrame&, const RunPlan&, FederateId publisher, FederateId reader);
[[nodiscard]] const char* defect(const OverheadFrame&, const RunPlan&, FederateId publisher, FederateId reader);
[[nodiscard]] const char* defect(const TrackingFrame&, const RunPlan&, FederateId publisher, FederateId reader);
/// Why a relocation is impossible, or nullptr.
[[nodiscard]] const char* defect(const Relocation&, const RunPlan&);
/// The first defect of a directive, or nullptr.
[[nodiscard]] const char* defect(const Directive&, const RunPlan&);

}  // namespace kilotwin
