/// Puts the poses of one stamp, which may come in several messages, into one tracker frame.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "clients/doors/tally.hpp"
#include "clients/doors/tracked_frame.hpp"

namespace kilotwin::doors::ros2 {

/// A frame is complete once it has all robots of the previous frame, or one message that lists all robots. An incomplete frame is
/// released after the hold time. Frames are released in the order of their stamps.
///
/// A message whose stamp is older than the last released frame is late and is dropped. Later frames wait for its robots too. If
/// the stamp is more than a second older, the source has restarted its clock, and the message begins a new series of frames.
class Gatherer {
 public:
  struct Arrival {
    std::int64_t stamp_ns = 0;
    bool whole = false;
    std::optional<std::uint64_t> frame_number;  ///< absent: frames are counted here
    std::vector<TrackedRobot> robots;
  };

  /// `hold_ns`: longest wait of a frame, from its first message on.
  explicit Gatherer(std::int64_t hold_ns) : hold_ns_(hold_ns) {}

  /// Times `now_ns` are of one steady clock. Returns the frames that are ready.
  [[nodiscard]] std::vector<TrackedFrame> add(Arrival arrival, std::int64_t now_ns, Tally& tally);
  [[nodiscard]] std::vector<TrackedFrame> expire(std::int64_t now_ns);
  /// When `expire` has something to do next; absent: nothing waits.
  [[nodiscard]] std::optional<std::int64_t> deadline_ns() const;

 private:
  struct Pending {
    std::int64_t since_ns = 0;
    std::optional<std::uint64_t> frame_number;
    bool whole = false;
    std::map<std::uint32_t, TrackedRobot> robots;
  };
  [[nodiscard]] bool complete(const Pending& pending) const;
  /// All frames up to the stamp, in order.
  [[nodiscard]] std::vector<TrackedFrame> release(std::int64_t up_to_stamp_ns);

  std::int64_t hold_ns_;
  std::map<std::int64_t, Pending> pending_;  ///< by stamp
  std::set<std::uint32_t> expected_;
  std::optional<std::int64_t> last_stamp_ns_;
  std::uint64_t next_frame_ = 0;
};

}  // namespace kilotwin::doors::ros2
