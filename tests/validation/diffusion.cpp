#include <fmt/format.h>

#include "tests/validation/reference.hpp"
#include "tests/validation/validations.hpp"

namespace kilotwin::validation {
namespace {

/// Within this part of the peer's figure.
constexpr double kAgreement = 0.1;

Figure msd_at(const std::vector<Recorded>& swarms, double time_s) {
  std::vector<double> values;
  for (const Recorded& run : swarms) values.push_back(run.msd_mm2(0, run.state_at(time_s)));
  return mean_of(values);
}

}  // namespace

void validate_diffusion(Runs& runs, Verdicts& verdicts, Effort effort) {
  const std::string experiment = runs.source("experiments/diffusion.txtpb"),
                    seeds = effort.quick ? "1..20" : "1..200";
  // With few runs, their own spread is allowed for.
  const double errors = effort.quick ? 2 : 0;
  verdicts.section(fmt::format("mean square displacement of a crowd of 50, seeds {}: diffusion.txtpb", seeds));
  const std::vector<Recorded> crowd = runs.sweep(experiment, {"--seeds", seeds});
  const std::vector<Recorded> free =
      runs.sweep(experiment, {"--seeds", seeds, "--set", "physics.engine=KINEMATIC"});
  for (const ReferencePoint& point : kDiffusionRing) {
    verdicts.near_in_parts(fmt::format("peer, {:.0f} s", point.time_s), "mm^2", msd_at(crowd, point.time_s),
                           {point.value, point.error}, kAgreement, errors);
  }
  for (const ReferencePoint& point : kDiffusionFar) {
    verdicts.near_in_parts(fmt::format("without contact: peer with robots far apart, {:.0f} s", point.time_s),
                           "mm^2", msd_at(free, point.time_s), {point.value, point.error}, kAgreement, errors);
  }
  for (const double time_s : {10.0, 60.0, 120.0, 180.0}) {
    const Figure with = msd_at(crowd, time_s), without = msd_at(free, time_s);
    // What contact takes away lies far outside of what 10 % would explain.
    verdicts.at_least(fmt::format("without contact over with contact, {:.0f} s", time_s), "",
                      {without.value / with.value}, 1 + 2 * kAgreement);
  }
}

}  // namespace kilotwin::validation
