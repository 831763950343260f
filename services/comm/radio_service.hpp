/// The radio engine as a federate: reads bodies, actuation and overhead packets; publishes a radio frame to every host.
#pragma once

#include <memory>

#include "core/federation/service_context.hpp"
#include "services/comm/firmware_robots.hpp"

namespace kilotwin::comm {

/// Returns at the end of the run. `firmware`: the plan's firmware robots, or null if it has none. Throws as Session::run
/// does.
void run_service(const RunPlan& plan, const ServiceContext& context, std::unique_ptr<FirmwareRobots> firmware);

}  // namespace kilotwin::comm
