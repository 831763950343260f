/// The behaviours host as a federate: it reads radio frames and publishes actuation frames.
#pragma once

#include "core/federation/service_context.hpp"

namespace kilotwin::behaviours {

/// Runs the host to the end of the run. Throws the errors of Session::run().
void run_service(const RunPlan& plan, HostId host, const ServiceContext& context);

}  // namespace kilotwin::behaviours
