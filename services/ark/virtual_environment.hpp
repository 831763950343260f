/// What robots sense that is not there: a virtual environment answers each robot with an ARK message.
#pragma once

#include <memory>
#include <optional>

#include "core/base/pose.hpp"
#include "core/geometry/convex.hpp"
#include "core/plan/station_settings.hpp"
#include "services/ark/ark_message.hpp"

namespace kilotwin::proto {
class EnvironmentState;
}

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
  /// The reading of this robot's virtual sensor; nothing where there is nothing to tell it. What the robot shows may change
  /// the environment.
  [[nodiscard]] virtual std::optional<ArkMessage> sense(const TrackedRobot& robot) = 0;

  /// What of it changes: a word for the state hash, and its part of checkpoints.
  [[nodiscard]] virtual std::uint64_t word() const { return 0; }
  virtual void save(proto::EnvironmentState&) const {}
  /// Throws RunError where it does not fit.
  virtual void load(const proto::EnvironmentState&) {}
};

/// The bearing of a place from a robot, whole degrees 0..359, anticlockwise from its heading.
[[nodiscard]] std::uint16_t bearing_deg(const Pose& p_WR, const Point2& place);

/// For `robots` robots.
[[nodiscard]] std::unique_ptr<VirtualEnvironment> make_environment(const EnvironmentSettings&,
                                                                   std::uint32_t robots);

}  // namespace kilotwin::ark
