/// What was received within one tick, by robot.
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
  /// Registers a message; the receptions that follow are of it. Messages come in the order of their arrival.
  void begin_message(const IrMessage& message) { messages_.push_back(message); }
  void add(std::uint32_t robot, Gains gains) {
    arrived_.push_back({robot, static_cast<std::uint32_t>(messages_.size() - 1), gains});
  }
  /// Sorts by robot and, for each robot, by arrival.
  void close();

  /// Receptions of one robot.
  [[nodiscard]] std::uint32_t count(std::uint32_t robot) const { return first_[robot + 1] - first_[robot]; }
  /// Appends the receptions of a share of the robots, and the messages that it received.
  void emit(Share share, RadioFrame& frame) const;

  void save(proto::RadioState&) const;
  /// Throws RunError where the part does not fit.
  void load(const proto::RadioState&);

 private:
  struct Reception {
    std::uint32_t robot, message;
    Gains gains;
  };
  std::vector<IrMessage> messages_;
  std::vector<Reception> arrived_;  ///< in order of arrival
  std::vector<Reception> sorted_;   ///< by robot
  std::vector<std::uint32_t>
      first_;  ///< per robot: where its receptions begin in sorted_; one more entry at the end
  mutable std::vector<std::uint32_t> number_;  ///< scratch of emit: per message, its index in the frame
};

}  // namespace kilotwin::comm
