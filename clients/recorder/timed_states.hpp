/// The states of a recorded run at any time, also between two recorded ones.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "clients/recorder/overview.hpp"
#include "clients/recorder/paths.hpp"
#include "clients/recorder/reader.hpp"

namespace kilotwin::recorder {

/// Between two states positions are interpolated along a straight line, headings along the shorter way. An LED and a life cycle
/// keep their value until the next state.
class TimedStates {
 public:
  /// Throws UserError where the recording has no state.
  explicit TimedStates(const std::filesystem::path& recording);

  [[nodiscard]] double first_s() const { return first_s_; }
  /// The state at a time, which must not be less than that of the call before; nothing after the last state.
  [[nodiscard]] std::optional<Snapshot> at(double time_s);

  /// After at(): the recorded states around that time. Both are the first one up to its time.
  [[nodiscard]] const Snapshot& before() const { return before_; }
  [[nodiscard]] const Snapshot& after() const { return after_; }
  /// The tick of before().
  [[nodiscard]] std::int64_t tick() const { return before_tick_; }
  /// The pictures that virtual environments had painted by before().
  [[nodiscard]] const Floors& floors() const { return floors_; }

 private:
  /// Moves after_ to the next state. False at the end.
  [[nodiscard]] bool advance();

  Reader reader_;
  Snapshot before_, after_;
  std::int64_t before_tick_ = 0, after_tick_ = 0;
  double first_s_ = 0;
  Floors floors_, floors_after_;
};

}  // namespace kilotwin::recorder
