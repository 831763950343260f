/// Frames as viewers get them: the state of all robots at one tick in one binary message, 7 octets per robot.
/// clients/view/page/protocol.ts reads them. Little-endian:
///
///   0   u32  0x3156544b: "KTV1"
///   4   u32  number of the request that the frame answers; 0: the newest state of a live run
///   8   f64  tick
///   16  f64  tick of the next recorded state; the same tick where there is none
///   24  u32  robots N
///   28  u32  movable bodies M
///   32  f32  M times x, mm; M times y, mm; M times heading, rad
///       u16  N times x; N times y: grid coordinates, mm = lowest + step * value
///       u16  N times heading and LED: heading << 6 | LED, the heading in 1024ths of a turn, the LED r | g << 2 | b << 4
///       u8   N times state: bits 0 to 3 life cycle (0 to 6 as in kilolib, 13 absent, 14 battery flat, 15 failed),
///            bit 4 left motor on, bit 5 right motor on
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace kilotwin::view {

inline constexpr std::uint32_t kFrameMagic = 0x3156544b;
inline constexpr std::size_t kFrameHeader_bytes = 32, kFrameRobot_bytes = 7, kFrameMovable_bytes = 12;

/// The grid to which positions are rounded: 65536 steps along each axis, around the arena's centre.
struct PositionGrid {
  double lowest_mm = 0;  ///< of x and of y
  double step_mm = 1;

  /// For an arena of these half extents, and 5 % more on each side. Positions beyond are moved to the edge.
  [[nodiscard]] static PositionGrid over(double half_width_mm, double half_height_mm);
  [[nodiscard]] std::uint16_t at(double mm) const;
};

/// Columns with one entry per robot, or per movable body.
struct FrameColumns {
  std::span<const double> x_mm, y_mm, heading_rad;
  std::span<const std::uint8_t> led, life_cycle;
  std::span<const std::uint8_t> motor_left, motor_right;  ///< may be empty
  std::span<const double> movable_x_mm, movable_y_mm, movable_heading_rad;
};

struct FrameStamp {
  std::uint32_t request = 0;
  std::int64_t tick = 0, next_tick = 0;
};

[[nodiscard]] std::string encode_frame(const FrameStamp&, const FrameColumns&, const PositionGrid&);

}  // namespace kilotwin::view
