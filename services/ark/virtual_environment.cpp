#include "services/ark/virtual_environment.hpp"

#include "core/base/error.hpp"
#include "core/math/elementary.h"
#include "services/ark/foraging_environment.hpp"

namespace kilotwin::ark {
namespace {

/// A circle: inside or outside, and where its centre lies.
class HubEnvironment : public VirtualEnvironment {
 public:
  explicit HubEnvironment(const HubSettings& hub)
      : centre_{hub.x_mm, hub.y_mm}, radius_squared_mm2_(hub.radius_mm * hub.radius_mm) {}

  [[nodiscard]] std::optional<ArkMessage> sense(const TrackedRobot& robot) override {
    const double x_mm = centre_.x_mm - robot.p_WR.x_mm;
    const double y_mm = centre_.y_mm - robot.p_WR.y_mm;
    const bool inside = x_mm * x_mm + y_mm * y_mm <= radius_squared_mm2_;
    return ArkMessage{static_cast<std::uint16_t>(robot.robot), static_cast<std::uint8_t>(inside ? 1 : 0),
                      bearing_deg(robot.p_WR, centre_)};
  }

 private:
  Point2 centre_;
  double radius_squared_mm2_;
};

}  // namespace

std::uint16_t bearing_deg(const Pose& p_WR, const Point2& place) {
  const double x_mm = place.x_mm - p_WR.x_mm, y_mm = place.y_mm - p_WR.y_mm;
  const double bearing_deg = (kt_atan2(y_mm, x_mm) - p_WR.heading_rad) * (180 / kPi);
  auto degrees = static_cast<int>(kt_floor(bearing_deg + 0.5)) % 360;
  if (degrees < 0) degrees += 360;
  return static_cast<std::uint16_t>(degrees);
}

std::unique_ptr<VirtualEnvironment> make_environment(const EnvironmentSettings& settings, std::uint32_t robots) {
  if (const auto* const hub = std::get_if<HubSettings>(&settings)) return std::make_unique<HubEnvironment>(*hub);
  if (const auto* const foraging = std::get_if<ForagingSettings>(&settings))
    return std::make_unique<ForagingEnvironment>(*foraging, robots);
  throw UserError("station.environment: no kind of environment; give hub { ... }");
}

}  // namespace kilotwin::ark
