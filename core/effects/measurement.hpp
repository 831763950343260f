/// Effects on measurement: poses as a camera tracker reports them. They never act on physics. A measured position is
///   (p + body offsets) (1 + s1) (1 + s2)... + offsets,
/// with the disc's centre p and scales s. Lengths in mm, angles in rad.
#pragma once

#include <span>
#include <vector>

#include "core/effects/term.hpp"
#include "core/frames/swarm_view.hpp"

namespace kilotwin {

/// Measured poses of all robots, by id.
struct MeasuredPoses {
  std::vector<double> x_mm, y_mm, heading_rad;  ///< heading in [-pi, pi)
};

class Measurement {
 public:
  explicit Measurement(const RunPlan&);

  /// False: measured poses equal true poses.
  [[nodiscard]] bool any() const { return !terms_.empty(); }
  /// Measured poses of a swarm. Real robots keep the poses of their own tracker.
  void measure(const SwarmView&, MeasuredPoses&);

 private:
  const RunPlan& plan_;
  MotorRule motors_;
  TermList terms_;
  // Of all robots, by id.
  std::vector<std::uint32_t> robot_, who_;
  std::vector<Duties> duties_;
  std::vector<std::uint8_t> tracked_;
  // Per robot of who_.
  std::vector<double> ahead_mm_, left_mm_, scale_, offset_x_mm_, offset_y_mm_, turn_rad_;
};

}  // namespace kilotwin
