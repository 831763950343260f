/// The run plan of a run that is only watched, from its experiment alone: where its partitions lie, who its federates are, how its
/// trackers lie in the arena, and where bodies may be placed.
#pragma once

#include <memory>

#include "core/plan/plan.hpp"

namespace kilotwin {
namespace proto {
class Experiment;
class Manifest;
}  // namespace proto

namespace view {

/// Programs and initial poses are left out: nothing that viewers ask depends on them. So are pictures of light, unless `manifest`, the
/// run's own, has them. nullptr: no plan can be
/// made of the experiment, as of a recording without its run directory.
[[nodiscard]] std::shared_ptr<const RunPlan> plan_of(const proto::Experiment&,
                                                     const proto::Manifest* manifest = nullptr);
/// Distance from a partition's rectangle within which robots of others are known to it, mm; 0 where there is one partition.
[[nodiscard]] double ghost_margin_mm(const RunPlan&);

}  // namespace view
}  // namespace kilotwin
