/// Messages as they fly, for viewers: who sent, who received, when. They come from events of the kinds SENT and RECEIVED, of a
/// recording or as the radio of a live run reports them.
#pragma once

#include <cstdint>
#include <deque>
#include <set>
#include <string>
#include <vector>

#include "core/base/time.hpp"

namespace kilotwin {
namespace proto {
class EventRecord;
}

namespace view {

/// Flights of one answer at most; of more, the newest count.
inline constexpr std::size_t kMostFlights = 1500;
/// Robots that were heard within this time have a line to the one that heard them.
inline constexpr double kLately_s = 3;

struct Flight {
  double tick = 0;                         ///< when the packet ended, not whole
  std::uint32_t sender = 0, receiver = 0;  ///< alike: the packet was sent
};

/// Adds what an event says of messages; nothing of other kinds. Events whose columns differ in length are left out.
void add_flights(const proto::EventRecord& event, const TickLength& length, std::vector<Flight>& to);

struct FlightsAnswer {
  std::int64_t from = 0, until = 0;  ///< flights that ended after tick `from`, up to tick `until`
  double newest = 0;                 ///< tick up to which flights are known; in a recording `until`
  bool whole = true;                 ///< false: there were more
};
/// A message of type "flights".
[[nodiscard]] std::string flights_text(const FlightsAnswer& answer, const std::vector<Flight>& flights);

/// The newest flights of a live run.
class LiveFlights {
 public:
  /// Takes a message Observations of idl/recording.proto, which may be empty: what the radio saw up to tick `until`.
  void take(const void* observations, std::size_t octets, std::int64_t until, const TickLength& length);
  [[nodiscard]] std::string text(std::int64_t from, std::int64_t until) const;
  /// A message of type "robot", of the newest kMostKept messages of the swarm. `lately_ticks`: as for heard_lately().
  [[nodiscard]] std::string robot_text(std::uint32_t robot, std::int64_t tick, double lately_ticks) const;
  /// Robots that a robot has heard within the last ticks.
  [[nodiscard]] std::set<std::uint32_t> heard_lately(std::uint32_t robot, double ticks) const;
  void clear() { *this = {}; }

 private:
  static constexpr std::size_t kMostKept = 16 * kMostFlights;
  std::deque<Flight> flights_;
  std::int64_t until_ = 0;
};

}  // namespace view
}  // namespace kilotwin
