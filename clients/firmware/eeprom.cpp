#include "clients/firmware/eeprom.hpp"

#include "core/base/eeprom_layout.hpp"
#include "core/base/ir_calibration.h"

namespace kilotwin::firmware {

std::array<std::uint8_t, kEepromOctets> make_eeprom(std::uint32_t robot, const Calibration& calibration) {
  namespace layout = eeprom_layout;
  static_assert(layout::kOctets == kEepromOctets);
  constexpr std::array<std::uint16_t, KILOTWIN_IR_ENTRIES> kLow KILOTWIN_IR_LOW, kHigh KILOTWIN_IR_HIGH;
  std::array<std::uint8_t, kEepromOctets> octets{};
  octets.fill(0xff);
  octets[layout::kTurnLeft] = calibration.turn_left;
  octets[layout::kTurnRight] = calibration.turn_right;
  octets[layout::kStraightLeft] = calibration.straight_left;
  octets[layout::kStraightRight] = calibration.straight_right;
  for (std::size_t i = 0; i < kLow.size(); ++i) {
    octets[layout::kIrLow + 2 * i] = static_cast<std::uint8_t>(kLow[i] >> 8);
    octets[layout::kIrLow + 2 * i + 1] = static_cast<std::uint8_t>(kLow[i] & 0xff);
    octets[layout::kIrHigh + 2 * i] = static_cast<std::uint8_t>(kHigh[i] >> 8);
    octets[layout::kIrHigh + 2 * i + 1] = static_cast<std::uint8_t>(kHigh[i] & 0xff);
  }
  octets[layout::kTxMask] = 1;
  octets[layout::kUid] = static_cast<std::uint8_t>(robot & 0xff);
  octets[layout::kUid + 1] = static_cast<std::uint8_t>(robot >> 8 & 0xff);
  return octets;
}

}  // namespace kilotwin::firmware
