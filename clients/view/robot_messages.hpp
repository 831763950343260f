/// Messages of single robots up to a tick, from the events SENT and RECEIVED of a recording, which may still grow.
#pragma once

#include <cstdint>
#include <list>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "clients/recorder/reader.hpp"
#include "clients/recorder/state_index.hpp"

namespace kilotwin::view {

struct MessageCounts {
  std::optional<std::uint64_t> sent, received;   ///< nothing: these events are not recorded
  std::map<std::uint32_t, std::uint32_t> heard;  ///< received, by sender
  bool whole = true;                             ///< false: reading all takes longer; another call continues
};

class RobotMessages {
 public:
  /// Both must outlive this object. The caller calls it from one thread at a time.
  RobotMessages(recorder::Reader& reader, const recorder::StateIndex& index);

  /// These events are recorded.
  [[nodiscard]] bool any() const { return has_sent_ || has_received_; }
  /// Events up to a tick. It reads for 40 ms at most. Of a recording that grows, the last 4 s are not counted.
  [[nodiscard]] MessageCounts until(std::uint32_t robot, std::int64_t tick);

 private:
  /// Messages of a robot, from the first records of each kind.
  struct Known {
    std::uint32_t robot = 0;
    std::size_t sent_read = 0, received_read = 0;                  ///< records
    std::vector<std::int64_t> sent;                                ///< ticks
    std::vector<std::pair<std::int64_t, std::uint32_t>> received;  ///< tick and sender
  };
  template <class Take>
  [[nodiscard]] bool read_on(std::uint32_t kind, std::size_t& read, std::int64_t tick, const Take& take);

  recorder::Reader& reader_;
  const recorder::StateIndex& index_;
  bool has_sent_ = false, has_received_ = false;
  std::list<Known> known_;  // the one that was used last is the first
};

/// The robots with most messages, 8 at most, in descending order: {"robot", "count"} each.
[[nodiscard]] nlohmann::json partners(const std::map<std::uint32_t, std::uint32_t>& counts);

}  // namespace kilotwin::view
