/// The fitted model as a model file for the simulator (idl/model.proto).
#pragma once

#include <string>

#include "clients/identify/model/motion_model.hpp"
#include "idl/model.pb.h"

namespace kilotwin::identify {

/// Base parameters, biases, and every term as effect records. The tracked point and the tracker's noise become
/// measurement effects.
[[nodiscard]] proto::Model proto_of(const MotionModel&);

/// Protobuf text, one line per robot, with a comment on top.
[[nodiscard]] std::string text_of(const proto::Model&, const std::string& remark);

}  // namespace kilotwin::identify
