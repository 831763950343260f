/// The radio of measured robots, for experiments that state none.
#pragma once

#include "idl/experiment.pb.h"

namespace kilotwin {

/// With `model: PROPAGATION` and without a block `propagation`: sets the distribution that was fitted to the measured grids of
/// 25 robots (experiments/models/radio-25-robots.txtpb, docs/results/radio.md), with its range and oscillators unless the
/// experiment states them. Other experiments stay as they are.
void use_measured_radio(proto::Experiment&);

}  // namespace kilotwin
