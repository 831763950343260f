/// The command of a robot as a function of time, and what its motors did until then.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "clients/identify/data/measured_set.hpp"

namespace kilotwin::identify {

/// Within these times, s, what motors did is forgotten: by exp(-age / time). Of a warm motor that cools, of a battery that recovers.
inline constexpr std::array<double, 4> kForget_s = {5, 15, 40, 120};

/// What the commands of a robot say of an instant.
struct CommandState {
  Motion command = Motion::kStop, previous = Motion::kStop, last_turn = Motion::kStop;
  bool first = true;                       ///< no command came before; `previous` is kStop then
  double since_s = 0;                      ///< since the command changed
  double previous_lasted_s = 0;            ///< 0 where there was none
  std::array<double, 2> motor_s = {0, 0};  ///< for which the motor of the left, of the right wheel has turned
  double driven_s = 0;                     ///< for which either has
  double since_rest_s = 0;                 ///< for which either has without a rest of both
  /// What is left of these times of the left, the right, of either motor, with kForget_s, when the command began.
  std::array<std::array<double, 3>, kForget_s.size()> left_s = {};

  [[nodiscard]] bool driven() const { return command != Motion::kStop; }
  [[nodiscard]] bool left_on() const { return command == Motion::kStraight || command == Motion::kRight; }
  [[nodiscard]] bool right_on() const { return command == Motion::kStraight || command == Motion::kLeft; }
  /// `by_s` later, under the same command.
  void advance(double by_s);
  /// Of a motor (0: of the left wheel, 1: of the right) or of either (2), what kForget_s[forget] leaves of its time.
  [[nodiscard]] double remembered_s(std::size_t forget, std::size_t motor) const;
};

/// The commands of a track, piece by piece.
class CommandClock {
 public:
  explicit CommandClock(const Track&);
  /// At a time: of the command that then starts or lasts.
  [[nodiscard]] CommandState at(double time_s) const;
  /// The first change after that time; infinite where there is none.
  [[nodiscard]] double next_change_s(double after_s) const;

 private:
  [[nodiscard]] std::size_t piece(double time_s) const;
  std::vector<double> starts_s_;
  std::vector<CommandState> states_;  ///< at the start of each piece
};

}  // namespace kilotwin::identify
