/// What effects are worth where nothing was fitted: how much more probable they make what was measured there.
#pragma once

#include "clients/identify/fit/prepared_set.hpp"

namespace kilotwin::identify {

/// A gain in log likelihood, in nats, with its standard error over robots.
struct HeldOutGain {
  double nat = 0, nat_se = 0;
};

/// Of one model over another on all tracks of a set, or on those held out: each measurement is foretold from those before it, a
/// robot's bias being known as well as the model knows it. Both models start from the headings that explain most with them.
/// What was measured after touching counts too, as models differ in when they take a robot to touch: both have the same measurements.
[[nodiscard]] HeldOutGain held_out_gain(const MotionModel& with, const MotionModel& without, PreparedSet&,
                                        bool held_out_only, std::uint32_t threads);

}  // namespace kilotwin::identify
