/// From commands to the motion that the current model predicts, tick by tick, for the robots that are watched.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "clients/monitor/noise_terms.hpp"
#include "clients/monitor/wheel_motion.hpp"
#include "core/effects/arena_fields.hpp"
#include "core/effects/memory.hpp"
#include "core/effects/motion_effects.hpp"
#include "core/frames/swarm_view.hpp"
#include "services/physics/drive.hpp"

namespace kilotwin::monitor {

class CommandedMotion {
 public:
  /// `watched`: ascending ids.
  CommandedMotion(const RunPlan& plan, std::span<const std::uint32_t> watched);

  /// Computes the motion of the step from swarm.tick. `duties`: acting duties of all robots, by id. Ticks ascend by one.
  void advance(const SwarmView& swarm, std::span<const Duties> duties);
  /// Per watched robot, of the last step.
  [[nodiscard]] const std::vector<WheelMotion>& motion() const { return motion_; }

 private:
  void remember(const SwarmView& swarm);
  void add_effects(Tick from, const SwarmView& swarm, std::span<const Duties> duties);
  void add_noise(std::size_t i, std::uint32_t robot, Duties duties);

  const RunPlan plan_;  ///< without noise
  const std::vector<std::uint32_t> watched_;
  const std::vector<NoiseTerm> noise_;
  const double factor_variance_s_;
  physics::DriveModel drive_;
  physics::Drives drives_;
  MotionEffects effects_;
  MotionChanges changes_;
  EffectMemory memory_;
  ArenaFields fields_;
  std::vector<WheelMotion> motion_;
  // Of all robots by id, at the tick of the last step.
  std::vector<std::uint32_t> ids_;
  std::vector<std::uint8_t> tracked_;
  std::vector<double> remembered_, x_mm_, y_mm_, heading_rad_;
  std::vector<Duties> duties_;
  std::optional<Tick> last_;
};

}  // namespace kilotwin::monitor
