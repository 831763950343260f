/// What robots sense that is not there: a virtual environment answers each robot with an ARK message.
#pragma once

#include <memory>

#include "core/base/pose.hpp"
#include "idl/experiment.pb.h"
#include "services/ark/ark_message.hpp"

namespace kilotwin::ark {

/// A robot as the tracker sees it.
struct TrackedRobot {
  std::uint32_t robot;
  Pose p_WR;
  std::uint8_t led;  ///< r | g << 2 | b << 4
};

class VirtualEnvironment {
 public:
  virtual ~VirtualEnvironment() = default;
  /// The reading of this robot's virtual sensor.
  [[nodiscard]] virtual ArkMessage sense(const TrackedRobot& robot) const = 0;
};

[[nodiscard]] std::unique_ptr<VirtualEnvironment> make_environment(const proto::VirtualEnvironment& description);

}  // namespace kilotwin::ark
