/// The light of a run as a picture of the floor, and where its lamps are, for viewers: as the sensors of robots would read it.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "core/frames/swarm_view.hpp"
#include "core/plan/plan.hpp"
#include "core/senses/light_field.hpp"

namespace kilotwin::view {

/// Cells of the picture along each side.
inline constexpr std::uint32_t kLightCells = 64;

class LightPicture {
 public:
  /// nullptr, or a plan without light: there is no picture.
  explicit LightPicture(std::shared_ptr<const RunPlan> plan);

  /// A message of type "light"; empty where there is none. Robots at these places, mm, cast shadows if the experiment says so;
  /// columns of another length than the number of robots cast none.
  [[nodiscard]] std::string text(std::int64_t tick, std::span<const double> x_mm, std::span<const double> y_mm);

 private:
  std::shared_ptr<const RunPlan> plan_;
  std::optional<SwarmView> swarm_;
  std::optional<senses::LightField> field_;
};

}  // namespace kilotwin::view
