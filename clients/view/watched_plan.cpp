#include "clients/view/watched_plan.hpp"

#include "core/base/error.hpp"
#include "idl/manifest.pb.h"
#include "services/physics/engine.hpp"

namespace kilotwin::view {

std::shared_ptr<const RunPlan> plan_of(const proto::Experiment& experiment, const proto::Manifest* of_run) {
  proto::Manifest manifest;
  manifest.set_run(1);
  proto::Experiment& known = *manifest.mutable_experiment();
  known = experiment;
  if (of_run != nullptr)
    *manifest.mutable_light_raster() = of_run->light_raster();
  else if (known.has_light())
    known.mutable_light()->clear_image();
  known.clear_station();
  for (const proto::RobotGroup& group : experiment.robots()) {
    manifest.add_group_program(kNoProgram);
    for (std::uint32_t i = 0; i < group.count(); ++i) {
      manifest.add_x_mm(0);
      manifest.add_y_mm(0);
      manifest.add_heading_rad(0);
    }
  }
  try {
    return std::make_shared<const RunPlan>(std::move(manifest));
  } catch (const UserError&) {
    return nullptr;
  }
}

double ghost_margin_mm(const RunPlan& plan) { return plan.grid.size() > 1 ? physics::ghost_margin_mm(plan) : 0; }

}  // namespace kilotwin::view
