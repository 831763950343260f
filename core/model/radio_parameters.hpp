/// What each robot's infrared transmitter and receiver have of their own: stated in radio.propagation, else drawn. For the
/// radio, and for the tables in the robots' EEPROMs by which their programs make distances of readings.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/base/ir_calibration.h"
#include "core/plan/plan.hpp"

namespace kilotwin {

/// Readings of the two amplifiers at 33, 38.. 98 mm, as kilolib keeps them.
struct RangingTable {
  std::array<std::uint16_t, KILOTWIN_IR_ENTRIES> high, low;
  bool operator==(const RangingTable&) const = default;
};

class RadioParameters {
 public:
  /// What a level depends on the bearing by: a vector in the robot's frame, dB.
  struct Bearing {
    double ahead_db = 0, left_db = 0;
  };

  /// A pure function of the plan's experiment and seed. Without the PROPAGATION model all robots are nominal.
  explicit RadioParameters(const RunPlan&);

  [[nodiscard]] double power_db(std::uint32_t robot) const { return power_db_[robot]; }
  [[nodiscard]] double sensitivity_db(std::uint32_t robot) const { return sensitivity_db_[robot]; }
  [[nodiscard]] const Bearing& power_bearing(std::uint32_t robot) const { return power_bearing_[robot]; }
  [[nodiscard]] const Bearing& sensitivity_bearing(std::uint32_t robot) const {
    return sensitivity_bearing_[robot];
  }
  /// As the robot was calibrated: with its own sensitivity, a nominal sender and an error.
  [[nodiscard]] RangingTable table(std::uint32_t robot) const;
  /// Whether any robot's table differs from the nominal one.
  [[nodiscard]] bool own_tables() const { return own_tables_; }

 private:
  double decay_db_per_mm_;
  bool own_tables_ = false;
  std::vector<double> power_db_, sensitivity_db_, calibration_db_;
  std::vector<Bearing> power_bearing_, sensitivity_bearing_;
  std::vector<std::pair<std::uint32_t, RangingTable>> stated_;
};

}  // namespace kilotwin
