/// What robots remember for effects, from tick to tick: MemoryLayout says which numbers.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "core/effects/robots.hpp"
#include "core/random/random.hpp"

namespace kilotwin {

class EffectMemory {
 public:
  explicit EffectMemory(const RunPlan&);

  /// Doubles per robot.
  [[nodiscard]] std::uint32_t size() const { return plan_.memory.size(); }
  /// At tick 0; `memory` has size() entries.
  void start(std::uint32_t robot, std::span<double> memory) const;

  /// From tick `from`, at which `robots` were, to the next, at which they have the poses `x_mm`... `memory` is that of
  /// `robots`. Real robots remember nothing.
  void advance(Tick from, const RobotColumns& robots, std::span<const double> x_mm, std::span<const double> y_mm,
               std::span<const double> heading_rad, std::span<double> memory) const;

 private:
  using Kind = MemorySlot::Kind;
  struct Fade {
    double keep = 1;   ///< of the value in a tick
    double renew = 0;  ///< of noise: the weight of the new number
  };

  /// What a slot of episodes holds after `left_s`, as long as a phase lasts and when the next one is drawn at `now`.
  [[nodiscard]] double next_episode(const MemorySlot&, std::uint32_t robot, Tick now, double left_s) const;

  const RunPlan& plan_;
  const Random random_;
  double tick_s_;
  std::vector<Fade> fades_;  ///< per slot
  /// Slots that the command keeps up to date.
  std::optional<std::uint32_t> time_slot_, previous_slot_, lasted_slot_;
  bool notes_motion_ = false;
};

}  // namespace kilotwin
