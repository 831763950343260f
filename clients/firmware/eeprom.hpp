/// What a firmware robot finds in its EEPROM when it is switched on.
#pragma once

#include <array>

#include "clients/firmware/flash_image.hpp"
#include "core/model/robot_parameters.hpp"

namespace kilotwin::firmware {

/// As a calibrated robot has it: kilo_uid = its id, duties of its calibration, the ranging tables of
/// core/base/ir_calibration.h, all infrared LEDs on PB0; erased (0xff) elsewhere.
[[nodiscard]] std::array<std::uint8_t, kEepromOctets> make_eeprom(std::uint32_t robot, const Calibration&);

}  // namespace kilotwin::firmware
