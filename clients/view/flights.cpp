#include "clients/view/flights.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "clients/view/robot_messages.hpp"
#include "idl/recording.pb.h"

namespace kilotwin::view {

void add_flights(const proto::EventRecord& event, const TickLength& length, std::vector<Flight>& to) {
  const bool received = event.kind() == proto::RECEIVED;
  if (!received && event.kind() != proto::SENT) return;
  const int count = event.robot_size();
  if (event.offset_cycles_size() != count || (received && event.sender_size() != count)) return;
  for (int i = 0; i < count; ++i) {
    const double part = static_cast<double>(event.offset_cycles(i)) / static_cast<double>(length.cycles());
    to.push_back(
        {static_cast<double>(event.tick()) + part, received ? event.sender(i) : event.robot(i), event.robot(i)});
  }
}

std::string flights_text(const FlightsAnswer& answer, const std::vector<Flight>& flights) {
  std::string senders, receivers, ticks;
  for (const Flight& flight : flights) {
    const char* const comma = senders.empty() ? "" : ",";
    senders += fmt::format("{}{}", comma, flight.sender);
    receivers += fmt::format("{}{}", comma, flight.receiver);
    ticks += fmt::format("{}{:.2f}", comma, flight.tick);
  }
  return fmt::format(
      R"({{"type":"flights","from":{},"until":{},"newest":{:.2f},"whole":{},"sender":[{}],"receiver":[{}],"tick":[{}]}})",
      answer.from, answer.until, answer.newest, answer.whole, senders, receivers, ticks);
}

void LiveFlights::take(const void* observations, std::size_t octets, std::int64_t until, const TickLength& length) {
  proto::Observations observed;
  if (!observed.ParseFromArray(observations, static_cast<int>(octets))) return;
  until_ = std::max(until_, until);
  std::vector<Flight> fresh;
  for (const proto::EventRecord& event : observed.event()) add_flights(event, length, fresh);
  flights_.insert(flights_.end(), fresh.begin(), fresh.end());
  if (flights_.size() > kMostKept)
    flights_.erase(flights_.begin(), flights_.end() - static_cast<std::ptrdiff_t>(kMostKept));
}

std::string LiveFlights::text(std::int64_t from, std::int64_t until) const {
  std::vector<Flight> wanted;
  bool whole = true;
  for (auto flight = flights_.rbegin(); flight != flights_.rend(); ++flight) {
    if (!(flight->tick > static_cast<double>(from) && flight->tick <= static_cast<double>(until))) continue;
    whole = wanted.size() < kMostFlights;
    if (!whole) break;
    wanted.push_back(*flight);
  }
  return flights_text({from, until, static_cast<double>(until_), whole}, wanted);
}

std::set<std::uint32_t> LiveFlights::heard_lately(std::uint32_t robot, double ticks) const {
  std::set<std::uint32_t> heard;
  for (const Flight& flight : flights_)
    if (flight.receiver == robot && flight.sender != robot && flight.tick > static_cast<double>(until_) - ticks)
      heard.insert(flight.sender);
  return heard;
}

std::string LiveFlights::robot_text(std::uint32_t robot, std::int64_t tick, double lately_ticks) const {
  std::uint64_t sent = 0, received = 0;
  std::map<std::uint32_t, std::uint32_t> heard;
  for (const Flight& flight : flights_) {
    if (flight.sender == robot && flight.receiver == robot) ++sent;
    if (flight.receiver != robot || flight.sender == robot) continue;
    ++received;
    ++heard[flight.sender];
  }
  nlohmann::json text{{"type", "robot"}, {"robot", robot},       {"tick", tick},
                      {"sent", sent},    {"received", received}, {"heard", partners(heard)}};
  text["lately"] = heard_lately(robot, lately_ticks);
  text["whole"] = true;
  text["since"] = flights_.empty() ? until_ : static_cast<std::int64_t>(flights_.front().tick);
  return text.dump();
}

}  // namespace kilotwin::view
