/// Finds tracked robots that may touch something that disturbs their motion.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/frames/swarm_view.hpp"
#include "core/plan/plan.hpp"

namespace kilotwin::monitor {

class Contacts {
 public:
  /// `robots`: ascending ids of the tracked robots.
  Contacts(const RunPlan& plan, std::span<const std::uint32_t> robots);

  /// Finds the robots near others, walls or obstacles. Simulated robots cannot touch real ones.
  void update(const SwarmView& swarm);
  /// Entry i belongs to robots[i].
  [[nodiscard]] bool touches(std::size_t i) const { return touches_[i] != 0; }

 private:
  [[nodiscard]] bool near_wall(double x_mm, double y_mm) const;

  const RunPlan& plan_;
  const std::vector<std::uint32_t> robots_;
  std::vector<std::uint32_t> by_x_;  ///< entries of robots_ that are present, by ascending x
  std::vector<std::uint8_t> touches_;
};

}  // namespace kilotwin::monitor
