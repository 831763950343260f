#include "services/ark/simulated_hearing.hpp"

#include <algorithm>
#include <optional>

#include "core/base/pose.hpp"
#include "core/math/elementary.h"
#include "services/ark/seen_robots.hpp"

namespace kilotwin::ark {
namespace {

constexpr std::uint32_t kPayloads = 1024;

double square_mm2(const SwarmView& swarm, std::uint32_t a, std::uint32_t b) {
  const double dx_mm = swarm.x_mm[a] - swarm.x_mm[b], dy_mm = swarm.y_mm[a] - swarm.y_mm[b];
  return dx_mm * dx_mm + dy_mm * dy_mm;
}

}  // namespace

SimulatedHearing::SimulatedHearing(const RunPlan& plan) : plan_(plan) {
  for (std::uint32_t robot = 0; robot < plan.robots(); ++robot) {
    if (!plan.tracked(robot)) continue;
    if (const auto& hears = plan.tracking_settings().hears_of(robot)) listeners_.push_back({robot, *hears});
  }
}

std::vector<ArkMessage> SimulatedHearing::heard(const SwarmView& swarm) const {
  std::vector<ArkMessage> messages;
  for (const Listener& listener : listeners_) {
    if (is_absent(swarm, listener.robot)) continue;
    const double range_mm = listener.settings.range_mm;
    double nearest_mm2 = range_mm * range_mm;
    std::optional<std::size_t> chosen;
    for (std::size_t n = 0; n < swarm.offer_robot.size(); ++n) {
      const std::uint32_t sender = swarm.offer_robot[n];
      if (plan_.tracked(sender)) continue;
      const double d_mm2 = square_mm2(swarm, listener.robot, sender);
      const bool is_tie = chosen && d_mm2 == nearest_mm2;
      if (d_mm2 > nearest_mm2 || (is_tie && sender > swarm.offer_robot[*chosen])) continue;
      nearest_mm2 = d_mm2;
      chosen = n;
    }
    if (!chosen) continue;
    messages.push_back({static_cast<std::uint16_t>(listener.robot), listener.settings.type,
                        payload(listener.settings, swarm, listener.robot, *chosen)});
  }
  return messages;
}

std::uint16_t SimulatedHearing::payload(const HearsSettings& settings, const SwarmView& swarm,
                                        std::uint32_t listener, std::size_t offer) {
  const std::uint32_t sender = swarm.offer_robot[offer];
  switch (settings.data) {
    case HearsSettings::Data::kOctet: return swarm.offer_message[offer][settings.octet];
    case HearsSettings::Data::kSender: return static_cast<std::uint16_t>(sender % kPayloads);
    case HearsSettings::Data::kDistance: {
      const double d_mm = __builtin_sqrt(square_mm2(swarm, listener, sender));
      return static_cast<std::uint16_t>(std::min(d_mm + 0.5, kPayloads - 1.0));
    }
    case HearsSettings::Data::kBearing: {
      const double to_rad =
          kt_atan2(swarm.y_mm[sender] - swarm.y_mm[listener], swarm.x_mm[sender] - swarm.x_mm[listener]);
      const double turn_rad = wrapped(kt_fmod(to_rad - swarm.heading_rad[listener], 2 * kPi));
      const auto degrees = static_cast<std::int32_t>(kt_floor(turn_rad * 180 / kPi + 0.5));
      return static_cast<std::uint16_t>((degrees + 360) % 360);
    }
  }
  return 0;
}

}  // namespace kilotwin::ark
