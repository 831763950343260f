/// The radio engine as a federate: bodies, actuation and overhead packets in, radio frames to every host out.
#pragma once

#include "core/federation/service_context.hpp"

namespace kilotwin::comm {

/// Returns at the end of the run. Throws as Session::run does.
void run_service(const RunPlan& plan, const ServiceContext& context);

}  // namespace kilotwin::comm
