#include "services/ark/virtual_environment.hpp"

#include "core/base/error.hpp"
#include "core/math/elementary.h"
#include "services/ark/foraging_environment.hpp"

namespace kilotwin::ark {
namespace {

/// A circle: inside or outside, and where its centre lies.
class HubEnvironment : public VirtualEnvironment {
 public:
  explicit HubEnvironment(const proto::HubEnvironment& hub)
      : centre_mm_(hub.x_mm(), hub.y_mm()), radius_squared_mm2_(hub.radius_mm() * hub.radius_mm()) {}

  [[nodiscard]] std::optional<ArkMessage> sense(const TrackedRobot& robot) override {
    const double x_mm = centre_mm_.x() - robot.p_WR.position_mm.x();
    const double y_mm = centre_mm_.y() - robot.p_WR.position_mm.y();
    const bool inside = x_mm * x_mm + y_mm * y_mm <= radius_squared_mm2_;
    return ArkMessage{static_cast<std::uint16_t>(robot.robot), static_cast<std::uint8_t>(inside ? 1 : 0),
                      bearing_deg(robot.p_WR, centre_mm_)};
  }

 private:
  Eigen::Vector2d centre_mm_;
  double radius_squared_mm2_;
};

}  // namespace

std::uint16_t bearing_deg(const Pose& p_WR, const Eigen::Vector2d& place_mm) {
  const double x_mm = place_mm.x() - p_WR.position_mm.x(), y_mm = place_mm.y() - p_WR.position_mm.y();
  const double bearing_deg = (kt_atan2(y_mm, x_mm) - p_WR.heading_rad) * (180 / kPi);
  auto degrees = static_cast<int>(kt_floor(bearing_deg + 0.5)) % 360;
  if (degrees < 0) degrees += 360;
  return static_cast<std::uint16_t>(degrees);
}

std::unique_ptr<VirtualEnvironment> make_environment(const proto::VirtualEnvironment& description,
                                                     std::uint32_t robots) {
  switch (description.kind_case()) {
    case proto::VirtualEnvironment::kHub: return std::make_unique<HubEnvironment>(description.hub());
    case proto::VirtualEnvironment::kForaging:
      return std::make_unique<ForagingEnvironment>(description.foraging(), robots);
    case proto::VirtualEnvironment::KIND_NOT_SET: break;
  }
  throw UserError("station.environment: no kind of environment; give hub { ... }");
}

}  // namespace kilotwin::ark
