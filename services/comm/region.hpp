/// Division of the channel by space. Each engine owns the robots in its region. It also simulates robots of neighbouring
/// regions that can affect own ones within a tick (ghosts), and discards the result: in every tick the owners send the ghosts'
/// current state.
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "core/frames/frames.hpp"
#include "services/comm/air.hpp"

namespace kilotwin::comm {

/// A rectangle of the arena, mm; it includes its left and lower edges. The default is the whole plane.
struct Region {
  double left_mm = -std::numeric_limits<double>::infinity(), bottom_mm = left_mm;
  double right_mm = std::numeric_limits<double>::infinity(), top_mm = right_mm;

  [[nodiscard]] bool contains(double x_mm, double y_mm) const {
    return x_mm >= left_mm && x_mm < right_mm && y_mm >= bottom_mm && y_mm < top_mm;
  }
  /// Whether a point is within `margin_mm` of the rectangle along both axes.
  [[nodiscard]] bool is_near(double x_mm, double y_mm, double margin_mm) const {
    return x_mm >= left_mm - margin_mm && x_mm < right_mm + margin_mm && y_mm >= bottom_mm - margin_mm &&
           y_mm < top_mm + margin_mm;
  }
  [[nodiscard]] bool is_everywhere() const {
    const double most = std::numeric_limits<double>::max();
    return left_mm < -most && bottom_mm < -most && right_mm > most && top_mm > most;
  }
};

/// Robots of one region that can affect another, at one tick. One entry per robot, and per transmission.
struct RadioGhosts {
  std::vector<std::uint32_t> robot, count_word;  ///< count_word: of the robot's timer
  std::vector<std::uint64_t> time_word;          ///< of the robot's timer
  std::vector<std::uint8_t> state;
  std::vector<std::uint16_t> tx_period;
  std::vector<IrMessage> message;
  std::vector<std::uint16_t> crc_error;  ///< of the message
  std::vector<Cycles> next_send;         ///< model SIMPLE only
  std::vector<Transmission> transmissions;

  void clear() { *this = {}; }
};

}  // namespace kilotwin::comm
