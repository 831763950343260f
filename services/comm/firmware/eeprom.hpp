/// The initial EEPROM of a firmware robot.
#pragma once

#include <array>

#include "core/base/eeprom_layout.h"
#include "core/model/radio_parameters.hpp"
#include "core/model/robot_parameters.hpp"
#include "services/comm/firmware/flash_image.hpp"

namespace kilotwin::firmware {

/// The content that a calibrated robot has: core/base/eeprom_layout.h.
[[nodiscard]] inline std::array<std::uint8_t, kEepromOctets> make_eeprom(std::uint16_t uid,
                                                                         const Calibration& calibration,
                                                                         const RangingTable& ranging) {
  static_assert(kEepromOctets == KILOTWIN_EEPROM_OCTETS);
  std::array<std::uint8_t, kEepromOctets> octets{};
  kilotwin_fill_eeprom(octets.data(), {uid, calibration.turn_left, calibration.turn_right,
                                       calibration.straight_left, calibration.straight_right});
  kilotwin_fill_ranging(octets.data(), ranging.high.data(), ranging.low.data());
  return octets;
}

}  // namespace kilotwin::firmware
