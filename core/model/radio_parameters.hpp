/// Per-robot parameters of the infrared transmitter and receiver: stated in radio.propagation, else drawn at random. The radio
/// uses them. So do the calibration tables in the robots' EEPROMs, with which programs convert readings to distances.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/base/ir_calibration.h"
#include "core/plan/plan.hpp"

namespace kilotwin {

/// Calibration table of kilolib: readings of the two amplifiers, ADC counts, at the distances 33, 38 ... 98 mm.
struct RangingTable {
  std::array<std::uint16_t, KILOTWIN_IR_ENTRIES> high, low;
  bool operator==(const RangingTable&) const = default;
};

class RadioParameters {
 public:
  /// Directivity: the level at bearing b (anticlockwise from ahead) is raised by ahead_db * cos(b) + left_db * sin(b).
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
  /// The calibration table in the robot's EEPROM: its own sensitivity, a nominal sender, and a calibration error.
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
