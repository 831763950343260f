/// Plays a log as if a tracker saw it: rows become tracker frames on a clock that advances with wall time.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "clients/doors/door.hpp"
#include "clients/doors/logs/log_reader.hpp"
#include "clients/doors/tally.hpp"

namespace kilotwin::doors {

/// Extent of a log, found by reading all of it.
struct LogExtent {
  std::uint64_t rows = 0;
  double first_s = 0, last_s = 0;
};
/// Throws UserError with the place of the first error; a log without a row is one.
[[nodiscard]] LogExtent check_log(const std::filesystem::path& file, const proto::LogDoor& log);

/// Rows as frames. Pure: who plays them waits until each is due.
class LogPlayer {
 public:
  struct Due {
    std::int64_t after_ns = 0;  ///< since the beginning of the play; never descends
    TrackedFrame frame;         ///< captured at `after_ns` on a clock that shows 0 at the beginning
  };
  /// `speed`: how many times faster than it was logged. With `loop`, the log restarts at its end, for ever; the pause
  /// is as long as a mean period of its rows. `door` must outlive it.
  LogPlayer(const Door& door, std::filesystem::path file, const LogExtent& extent, double speed, bool loop);
  [[nodiscard]] std::optional<Due> next();
  [[nodiscard]] Tally& tally() { return tally_; }

 private:
  [[nodiscard]] std::optional<TrackedRobot> placed(const LogRobot& robot);

  const Door& door_;
  std::filesystem::path file_;
  LogExtent extent_;
  double speed_;
  bool loop_;
  LogReader reader_;
  double begins_s_ = 0;  ///< of this turn of the log, in its own time since the beginning
  std::uint64_t frame_ = 0;
  Tally tally_;
};

}  // namespace kilotwin::doors
