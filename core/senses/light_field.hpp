/// The light at robots' sensors: the sum of lamps, projected images and an ambient level. Bodies cast shadows.
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

/// A pure function of (experiment, seed, tick, poses), so alike on every host.
class LightField {
 public:
  /// For the robots of `share`. Requires plan.light_settings(). The plan must outlive this object.
  LightField(const RunPlan&, Share share);

  /// Sets the swarm and the tick for the functions below, which read the swarm: it must outlive their calls.
  void at(const SwarmView&);

  /// Mean reading of the sensor of robot `id` of the share, counts: gain * light + offset, before the converter's limits 0..1023.
  [[nodiscard]] double reading(std::uint32_t id) const;
  /// Standard deviation of one reading with this mean, counts.
  [[nodiscard]] double sd(double reading) const;

  /// The light at a point, in counts of a nominal sensor that looks along `axis`. Robot `self` casts no shadow on it.
  [[nodiscard]] double light(double x_mm, double y_mm, double z_mm, std::uint32_t self,
                             const Direction& axis = {}) const;

 private:
  const RunPlan& plan_;
  const LightSettings& light_;
  const Share share_;
  double anchor_x_mm_ = 0, anchor_y_mm_ = 0, anchor_z_mm_;  ///< the sensor's position in the robot's frame
  Direction axis_;                                          ///< the sensor's axis in the robot's frame
  std::vector<double> gain_, offset_;                       ///< per robot of the share
  const SwarmView* swarm_ = nullptr;
  std::vector<LightImage> images_;
  std::vector<Lamp> lamps_;  ///< lamps that are on
  std::optional<Shadows> shadows_;
};

}  // namespace kilotwin::senses
