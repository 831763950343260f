/// The station as a federate, and with it the run's one ingress and its metrics: it stamps external input; it adds up
/// the state hash and the counters of all federates; it tells observers how the run goes. It is the only one that sees the
/// complete state of every tick, which it hands to the run's observer (the recorder).
#pragma once

#include "core/federation/run_observer.hpp"
#include "core/federation/service_context.hpp"

namespace kilotwin::ark {

/// Returns at the end of the run with what it added up to. A run that breaks returns too, with `failure` set: what was
/// recorded until then stays usable.
RunTotals run_service(const RunPlan& plan, const ServiceContext& context, RunObserver& observer);

}  // namespace kilotwin::ark
