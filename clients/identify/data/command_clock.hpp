/// The command of a robot over time, and the motor-on times that follow from its commands. Times s.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "clients/identify/data/measured_set.hpp"

namespace kilotwin::identify {

/// Time constants, s, of exponentially discounted motor-on time (a motor that cools down, a battery that
/// recovers): weight exp(-age / constant).
inline constexpr std::array<double, 4> kDecayTimes_s = {5, 15, 40, 120};

/// The command of a robot at an instant, and its history.
struct CommandState {
  Motion command = Motion::kStop, previous = Motion::kStop, last_turn = Motion::kStop;
  Motion earlier_turn = Motion::kStop;     ///< latest turn before the present command; kStop: none
  bool first = true;                       ///< true: no command came before; `previous` is kStop then
  double since_s = 0;                      ///< since the command changed
  double count = 0;                        ///< number of changes of the command, that to the present one included
  double previous_lasted_s = 0;            ///< duration of the previous command; 0 if there was none
  std::array<double, 2> motor_s = {0, 0};  ///< motor-on time of the left and the right motor
  double driven_s = 0;                     ///< time for which either motor was on
  double since_rest_s = 0;                 ///< time for which either motor was on without a rest of both
  /// Discounted motor-on times [time constant][left, right, either] at the start of the command.
  std::array<std::array<double, 3>, kDecayTimes_s.size()> initial_discounted_s = {};

  [[nodiscard]] bool driven() const { return command != Motion::kStop; }
  [[nodiscard]] bool left_on() const { return command == Motion::kStraight || command == Motion::kRight; }
  [[nodiscard]] bool right_on() const { return command == Motion::kStraight || command == Motion::kLeft; }
  /// Advances by `by_s` under the same command.
  void advance(double by_s);
  /// Discounted motor-on time, s, for kDecayTimes_s[forget] and a motor: 0 left, 1 right, 2 either.
  [[nodiscard]] double discounted_s(std::size_t decay_index, std::size_t motor) const;
};

/// The commands of a track as a piecewise constant function of time.
class CommandClock {
 public:
  /// `lag_s`: the robot follows each command but its first this much later than stamped.
  explicit CommandClock(const Track&, double lag_s = 0);
  /// The state at a time. At a change: under the new command.
  [[nodiscard]] CommandState at(double time_s) const;
  /// Time of the first change after `after_s`; infinite if there is none.
  [[nodiscard]] double next_change_s(double after_s) const;

 private:
  [[nodiscard]] std::size_t piece(double time_s) const;
  std::vector<double> starts_s_;
  std::vector<CommandState> states_;  ///< at the start of each piece
};

}  // namespace kilotwin::identify
