/// Gain of effects in log likelihood on held-out data.
#pragma once

#include "clients/identify/fit/prepared_set.hpp"

namespace kilotwin::identify {

/// Gain in nats, with its standard error over robots.
struct HeldOutGain {
  double nat = 0, nat_se = 0;
};

/// Gain of one model over another on tracks of a set. Each measurement is predicted
/// from the previous ones with the biases that the model knows. Each model estimates the initial headings itself.
/// Measurements after contacts count too: the models differ in contacts, and both need the same measurements.
[[nodiscard]] HeldOutGain held_out_gain(const MotionModel& with, const MotionModel& without, const PreparedSet&,
                                        Tracks of, std::uint32_t threads);

}  // namespace kilotwin::identify
