/// Receptions within one tick, by robot.
#pragma once

#include <cstdint>
#include <vector>

#include "core/frames/frames.hpp"
#include "core/model/ranging.hpp"
#include "core/plan/plan.hpp"

namespace kilotwin::proto {
class RadioState;
}

namespace kilotwin::comm {

class ReceptionLog {
 public:
  explicit ReceptionLog(std::uint32_t robots) : first_(robots + 1, 0) {}

  void clear();
  /// Registers a message; the following add() calls refer to it. Messages come in order of arrival.
  /// `crc_error`: as in ActuationFrame.
  void begin_message(const IrMessage& message, std::uint16_t crc_error = 0) {
    messages_.push_back(message);
    crc_error_.push_back(crc_error);
  }
  void add(std::uint32_t robot, Gains gains) {
    arrived_.push_back({robot, static_cast<std::uint32_t>(messages_.size() - 1), gains});
  }
  /// Sorts by robot and, for each robot, by arrival.
  void close();

  /// Number of receptions of one robot.
  [[nodiscard]] std::uint32_t count(std::uint32_t robot) const { return first_[robot + 1] - first_[robot]; }
  /// Appends the receptions of a share of the robots, and the messages received.
  void emit(Share share, RadioFrame& frame) const;

  void save(proto::RadioState&) const;
  /// Throws RunError if the part does not fit.
  void load(const proto::RadioState&);

 private:
  struct Reception {
    std::uint32_t robot, message;
    Gains gains;
  };
  std::vector<IrMessage> messages_;
  std::vector<std::uint16_t> crc_error_;  ///< per message
  std::vector<Reception> arrived_;        ///< in order of arrival
  std::vector<Reception> sorted_;         ///< by robot
  std::vector<std::uint32_t> first_;      ///< per robot: index of its first reception in sorted_; then the total
  mutable std::vector<std::uint32_t> number_;  ///< scratch of emit(): index of each message in the frame
};

}  // namespace kilotwin::comm
