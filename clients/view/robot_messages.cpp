#include "clients/view/robot_messages.hpp"

#include <algorithm>
#include <chrono>
#include <limits>
#include <nlohmann/json.hpp>

#include "clients/view/curves.hpp"
#include "clients/view/recently_used.hpp"

namespace kilotwin::view {
namespace {

using Clock = std::chrono::steady_clock;
using recorder::StateIndex;

constexpr std::size_t kMostRobots = 16;
/// Pairs of robots that are listed for one robot.
constexpr std::size_t kMostPartners = 8;

}  // namespace

RobotMessages::RobotMessages(recorder::Reader& reader, const StateIndex& index) : reader_(reader), index_(index) {
  for (const int kind : reader_.header().event()) {
    has_sent_ |= kind == proto::SENT;
    has_received_ |= kind == proto::RECEIVED;
  }
}

/// Takes the records of a kind that follow those read, up to a tick. False: it took too long.
template <class Take>
bool RobotMessages::read_on(std::uint32_t kind, std::size_t& read, std::int64_t tick, const Take& take) {
  const std::vector<StateIndex::Entry>& all = index_.events(kind);
  const std::int64_t settled =
      index_.ended() || all.empty() ? std::numeric_limits<std::int64_t>::max() : all.back().tick - kSettled_ticks;
  const auto until = Clock::now() + kReadFor;
  while (read < all.size() && all[read].tick <= std::min(tick, settled)) {
    reader_.go_to(all[read++].offset);
    const proto::Record* const record = reader_.next();
    if (record != nullptr && record->has_event()) take(record->event());
    if (read % 64 == 0 && Clock::now() > until) return false;
  }
  return true;
}

MessageCounts RobotMessages::until(std::uint32_t robot, std::int64_t tick) {
  Known& known = recently_used(
      known_, kMostRobots, [robot](const Known& one) { return one.robot == robot; }, Known{robot, 0, 0, {}, {}});
  MessageCounts counts;
  counts.whole = read_on(proto::SENT, known.sent_read, tick, [&](const proto::EventRecord& event) {
    const auto count = std::count(event.robot().begin(), event.robot().end(), robot);
    known.sent.insert(known.sent.end(), static_cast<std::size_t>(count), event.tick());
  });
  counts.whole &= read_on(proto::RECEIVED, known.received_read, tick, [&](const proto::EventRecord& event) {
    for (int i = 0; i < std::min(event.robot_size(), event.sender_size()); ++i)
      if (event.robot(i) == robot) known.received.emplace_back(event.tick(), event.sender(i));
  });
  if (has_sent_)
    counts.sent = static_cast<std::uint64_t>(std::upper_bound(known.sent.begin(), known.sent.end(), tick) -
                                             known.sent.begin());
  if (!has_received_) return counts;
  counts.received = 0;
  for (const auto& [when, sender] : known.received) {
    if (when > tick) break;
    ++*counts.received;
    ++counts.heard[sender];
  }
  return counts;
}

nlohmann::json partners(const std::map<std::uint32_t, std::uint32_t>& counts) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> list(counts.begin(), counts.end());
  std::stable_sort(list.begin(), list.end(), [](const auto& a, const auto& b) { return a.second > b.second; });
  if (list.size() > kMostPartners) list.resize(kMostPartners);
  nlohmann::json text = nlohmann::json::array();
  for (const auto& [robot, count] : list) text.push_back({{"robot", robot}, {"count", count}});
  return text;
}

}  // namespace kilotwin::view
