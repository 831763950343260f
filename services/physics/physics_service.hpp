/// The physics engine of one partition as a federate: bodies and ghosts out, ghosts and actuation in.
#pragma once

#include "core/federation/service_context.hpp"

namespace kilotwin::physics {

/// Returns at the end of the run. Throws as Session::run does.
void run_service(const RunPlan& plan, PartitionId partition, const ServiceContext& context);

}  // namespace kilotwin::physics
