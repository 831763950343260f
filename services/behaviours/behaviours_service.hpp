/// A behaviours host as a federate: radio frames in, actuation out.
#pragma once

#include "core/federation/service_context.hpp"

namespace kilotwin::behaviours {

/// Returns at the end of the run. Throws as Session::run does.
void run_service(const RunPlan& plan, HostId host, const ServiceContext& context);

}  // namespace kilotwin::behaviours
