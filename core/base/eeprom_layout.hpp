/// Where kilolib keeps what a robot is, in its EEPROM. Source: kilolib.
#pragma once

#include <cstdint>

namespace kilotwin::eeprom_layout {

inline constexpr std::uint32_t kOctets = 1024;
/// Oscillator calibration; 0xff: the processor's own.
inline constexpr std::uint32_t kOsccal = 0x01;
/// Calibrated duties, one octet each.
inline constexpr std::uint32_t kTurnLeft = 0x05, kTurnRight = 0x09, kStraightLeft = 0x0c, kStraightRight = 0x14;
/// Ranging tables, KILOTWIN_IR_ENTRIES words each, high octet first.
inline constexpr std::uint32_t kIrLow = 0x20, kIrHigh = 0x50;
/// Pins of port B that drive the infrared LEDs.
inline constexpr std::uint32_t kTxMask = 0x90;
/// kilo_uid, low octet first.
inline constexpr std::uint32_t kUid = 0xb0;

}  // namespace kilotwin::eeprom_layout
