/// Memory of effects: numbers per robot that persist from tick to tick. MemoryLayout lists them.
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
  /// Sets a robot's memory at tick 0; `memory` has size() entries.
  void start(std::uint32_t robot, std::span<double> memory) const;

  /// Advances the memory of `robots` by one tick. `robots` are at tick `from`; `x_mm`, `y_mm` and `heading_rad` are their
  /// poses one tick later. Real robots have no memory.
  void advance(Tick from, const RobotColumns& robots, std::span<const double> x_mm, std::span<const double> y_mm,
               std::span<const double> heading_rad, std::span<double> memory) const;

 private:
  using Kind = MemorySlot::Kind;
  struct Fade {
    double keep = 1;   ///< factor on the value per tick
    double renew = 0;  ///< of correlated noise: weight of the next random number
  };

  /// Next value of an episode slot with value `left_s`. The sign gives the phase, the magnitude the time left in it. A further
  /// phase is drawn at `now`.
  [[nodiscard]] double next_episode(const MemorySlot&, std::uint32_t robot, Tick now, double left_s) const;

  const RunPlan& plan_;
  const Random random_;
  double tick_s_;
  std::vector<Fade> fades_;  ///< per slot
  /// Slots that the motion command updates.
  std::optional<std::uint32_t> time_slot_, previous_slot_, lasted_slot_, earlier_turn_slot_, count_slot_;
  bool notes_motion_ = false;
};

}  // namespace kilotwin
