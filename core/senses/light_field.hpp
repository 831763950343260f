/// The light that robots' sensors see: lamps, projected pictures and an ambient level, in shadow where bodies stand between.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "core/frames/swarm_view.hpp"
#include "core/plan/plan.hpp"
#include "core/senses/light_image.hpp"
#include "core/senses/light_source.hpp"
#include "core/senses/shadows.hpp"

namespace kilotwin::senses {

/// A pure function of (experiment, seed, tick, poses): the same on every host.
class LightField {
 public:
  /// For robots of `share`. The plan has light and must outlive this object.
  LightField(const RunPlan&, Share share);

  /// The field among a swarm, at its tick. Readings are of that swarm: it must outlive them.
  void at(const SwarmView&);

  /// What the sensor of robot `id` of the share gives on average, counts before the converter cuts them to 0..1023: its gain
  /// times the light there, and its offset.
  [[nodiscard]] double reading(std::uint32_t id) const;
  /// Standard deviation of one reading of that average, counts.
  [[nodiscard]] double sd(double reading) const;

  /// The light at a place, in counts of a nominal sensor. `self` throws no shadow there.
  [[nodiscard]] double light(double x_mm, double y_mm, double z_mm, std::uint32_t self) const;

 private:
  const RunPlan& plan_;
  const LightSettings& light_;
  const Share share_;
  double anchor_x_mm_ = 0, anchor_y_mm_ = 0, anchor_z_mm_;  ///< the sensor's place on a robot with heading 0
  std::vector<double> gain_, offset_;                       ///< per robot of the share
  const SwarmView* swarm_ = nullptr;
  std::vector<LightImage> images_;
  std::vector<Lamp> lamps_;  ///< those that shine
  std::optional<Shadows> shadows_;
};

}  // namespace kilotwin::senses
