/// What comes over the wire, held against the plan before an engine sees it: engines index by robot, and trust their frames.
/// Anybody on the domain can write a sample.
#pragma once

#include "core/federation/schedule.hpp"
#include "core/frames/frames.hpp"
#include "core/plan/plan.hpp"

namespace kilotwin {

// What no frame of `publisher` to `reader` in this plan can be, in a few words; nullptr where nothing is wrong.
[[nodiscard]] const char* defect(const BodyFrame&, const RunPlan&, FederateId publisher, FederateId reader);
[[nodiscard]] const char* defect(const ActuationFrame&, const RunPlan&, FederateId publisher, FederateId reader);
[[nodiscard]] const char* defect(const RadioFrame&, const RunPlan&, FederateId publisher, FederateId reader);
[[nodiscard]] const char* defect(const OverheadFrame&, const RunPlan&, FederateId publisher, FederateId reader);
/// The same for a directive.
[[nodiscard]] const char* defect(const Directive&, const RunPlan&);

}  // namespace kilotwin
