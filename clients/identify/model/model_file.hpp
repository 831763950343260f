/// The fitted model as a model file for the simulator.
#pragma once

#include <string>

#include "clients/identify/model/motion_model.hpp"
#include "idl/model.pb.h"

namespace kilotwin::identify {

/// Base parameters, biases and every term as records of effects; the tracked point and the tracker's noise as measured effects.
[[nodiscard]] proto::Model proto_of(const MotionModel&);

/// As text, robots a line each, with a remark on top.
[[nodiscard]] std::string text_of(const proto::Model&, const std::string& remark);

}  // namespace kilotwin::identify
