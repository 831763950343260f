#include "clients/view/frame_code.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "core/base/ids.hpp"
#include "core/base/pose.hpp"

namespace kilotwin::view {
namespace {

static_assert(std::endian::native == std::endian::little, "columns are copied as they lie in memory");

/// Writes values into memory of the right size.
class Cursor {
 public:
  explicit Cursor(char* at) : at_(at) {}
  template <class Value> void put(Value value) {
    std::memcpy(at_, &value, sizeof value);
    at_ += sizeof value;
  }

 private:
  char* at_;
};

std::uint16_t heading_and_led(double heading_rad, std::uint8_t led) {
  constexpr double kPerTurn = 1024;
  const auto heading = static_cast<std::uint32_t>(std::llround(heading_rad / (2 * kPi) * kPerTurn)) & 1023u;
  return static_cast<std::uint16_t>(heading << 6 | (led & 63u));
}

/// The four bits of a life cycle. Kilotwin's own values, from 253 on, keep their low bits.
std::uint8_t life_bits(std::uint8_t life_cycle) {
  static_assert((static_cast<unsigned>(LifeCycle::kFailed) & 15u) == 15 &&
                (static_cast<unsigned>(LifeCycle::kAbsent) & 15u) == 13);
  return life_cycle & 15u;
}

}  // namespace

PositionGrid PositionGrid::over(double half_width_mm, double half_height_mm) {
  constexpr double kMargin = 1.05, kSteps = 65535;
  const double half_mm = kMargin * std::max(half_width_mm, half_height_mm);
  return {-half_mm, 2 * half_mm / kSteps};
}

std::uint16_t PositionGrid::at(double mm) const {
  return static_cast<std::uint16_t>(std::lround(std::clamp((mm - lowest_mm) / step_mm, 0.0, 65535.0)));
}

std::string encode_frame(const FrameStamp& stamp, const FrameColumns& columns, const PositionGrid& grid) {
  const std::size_t robots = columns.x_mm.size(), movables = columns.movable_x_mm.size();
  std::string frame(kFrameHeader_bytes + kFrameMovable_bytes * movables + kFrameRobot_bytes * robots, '\0');
  Cursor to(frame.data());
  to.put(kFrameMagic);
  to.put(stamp.request);
  to.put(static_cast<double>(stamp.tick));
  to.put(static_cast<double>(stamp.next_tick));
  to.put(static_cast<std::uint32_t>(robots));
  to.put(static_cast<std::uint32_t>(movables));
  for (const auto& column : {columns.movable_x_mm, columns.movable_y_mm, columns.movable_heading_rad}) {
    for (const double value : column) to.put(static_cast<float>(value));
  }
  for (const double x_mm : columns.x_mm) to.put(grid.at(x_mm));
  for (const double y_mm : columns.y_mm) to.put(grid.at(y_mm));
  for (std::size_t i = 0; i < robots; ++i) to.put(heading_and_led(columns.heading_rad[i], columns.led[i]));
  const bool motors = !columns.motor_left.empty();
  for (std::size_t i = 0; i < robots; ++i) {
    const unsigned left = motors && columns.motor_left[i] > 0, right = motors && columns.motor_right[i] > 0;
    to.put(static_cast<std::uint8_t>(life_bits(columns.life_cycle[i]) | left << 4 | right << 5));
  }
  return frame;
}

}  // namespace kilotwin::view
