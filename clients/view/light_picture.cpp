#include "clients/view/light_picture.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/base/base64.hpp"
#include "core/plan/senses_settings.hpp"
#include "core/plan/world.hpp"

namespace kilotwin::view {
namespace {

/// The colour of light on the floor, and how opaque it is where sensors read their maximum.
constexpr std::array<unsigned char, 3> kColour{255, 176, 32};
constexpr double kMostAlpha = 190, kLargestReading = 1023;
/// No robot: nobody's own shadow is left out.
constexpr std::uint32_t kNobody = 0xffffffff;
/// Robots whose places are not known stand so far away that they cast no shadow on the arena.
constexpr double kFarAway_mm = 1e7;

}  // namespace

LightPicture::LightPicture(std::shared_ptr<const RunPlan> plan) : plan_(std::move(plan)) {
  if (!plan_ || !plan_->light_settings()) return;
  swarm_.emplace(plan_->robots(), 0, 0);
  field_.emplace(*plan_, Share{0, 0});
}

std::string LightPicture::text(std::int64_t tick, std::span<const double> x_mm, std::span<const double> y_mm) {
  if (!field_) return {};
  swarm_->tick = Tick{tick};
  const bool known = x_mm.size() == plan_->robots() && y_mm.size() == plan_->robots();
  swarm_->x_mm.assign(plan_->robots(), kFarAway_mm);
  swarm_->y_mm.assign(plan_->robots(), kFarAway_mm);
  if (known) {
    std::copy(x_mm.begin(), x_mm.end(), swarm_->x_mm.begin());
    std::copy(y_mm.begin(), y_mm.end(), swarm_->y_mm.begin());
  }
  field_->at(*swarm_);

  const LightSettings& light = *plan_->light_settings();
  const double half_width_mm = plan_->world.arena.half_width_mm(),
               half_height_mm = plan_->world.arena.half_height_mm();
  const auto centre_of = [](std::uint32_t cell) { return (2.0 * cell + 1) / kLightCells - 1; };
  std::string rgba;
  for (std::uint32_t row = 0; row < kLightCells; ++row) {
    for (std::uint32_t column = 0; column < kLightCells; ++column) {
      const double reading = field_->light(half_width_mm * centre_of(column), -half_height_mm * centre_of(row),
                                           light.sensor.height_mm, kNobody);
      // The root shows the fall with the square of the distance over more of the arena.
      const double part = std::sqrt(std::clamp(reading / kLargestReading, 0.0, 1.0));
      rgba.append(reinterpret_cast<const char*>(kColour.data()), kColour.size());
      rgba += static_cast<char>(static_cast<unsigned char>(std::lround(kMostAlpha * part)));
    }
  }
  nlohmann::json lamps = nlohmann::json::array();
  for (const LightSourceSettings& source : light.sources) {
    const senses::Lamp lamp = senses::lamp_at(source, plan_->tick_length.seconds_at(Tick{tick}));
    lamps.push_back({{"x", lamp.x_mm}, {"y", lamp.y_mm}, {"on", lamp.intensity > 0}});
  }
  return nlohmann::json{{"type", "light"},
                        {"tick", tick},
                        {"lamps", lamps},
                        {"floor",
                         {{"columns", kLightCells},
                          {"rows", kLightCells},
                          {"rgba", base64(rgba)},
                          {"circles", nlohmann::json::array()}}}}
      .dump();
}

}  // namespace kilotwin::view
