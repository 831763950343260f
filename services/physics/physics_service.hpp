/// One partition's physics engine as a federate: reads ghosts and actuation, publishes bodies and ghosts.
#pragma once

#include "core/federation/service_context.hpp"

namespace kilotwin::physics {

/// Returns at the end of the run. Throws as Session::run does.
void run_service(const RunPlan& plan, PartitionId partition, const ServiceContext& context);

}  // namespace kilotwin::physics
