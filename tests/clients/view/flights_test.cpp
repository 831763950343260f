// Messages as they fly: what events say of them, and how many a viewer is told of.
#include "clients/view/flights.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "idl/recording.pb.h"

namespace kilotwin::view {
namespace {

using nlohmann::json;

constexpr TickLength kLength{262144};

proto::EventRecord event_of(proto::RecordedEvent kind, std::int64_t tick, std::uint32_t robot,
                            std::uint32_t sender) {
  proto::EventRecord event;
  event.set_tick(tick);
  event.set_kind(kind);
  event.add_robot(robot);
  event.add_offset_cycles(65536);
  if (kind == proto::RECEIVED) event.add_sender(sender);
  return event;
}

TEST(Flights, AreMessagesSentAndReceived) {
  std::vector<Flight> flights;
  add_flights(event_of(proto::RECEIVED, 10, 3, 8), kLength, flights);
  add_flights(event_of(proto::SENT, 11, 5, 0), kLength, flights);
  add_flights(event_of(proto::LED, 12, 5, 0), kLength, flights);
  ASSERT_EQ(flights.size(), 2u);
  EXPECT_EQ(flights[0].sender, 8u);
  EXPECT_EQ(flights[0].receiver, 3u);
  EXPECT_EQ(flights[0].tick, 10.25);
  EXPECT_EQ(flights[1].sender, 5u);
  EXPECT_EQ(flights[1].receiver, 5u);
  proto::EventRecord damaged = event_of(proto::RECEIVED, 10, 3, 8);
  damaged.add_robot(4);
  add_flights(damaged, kLength, flights);
  EXPECT_EQ(flights.size(), 2u);
}

TEST(LiveFlights, TellTheNewestOfATimeAndForgetOldOnes) {
  LiveFlights live;
  for (std::int64_t tick = 0; tick < 40; ++tick) {
    proto::Observations observed;
    for (std::uint32_t i = 0; i < 1000; ++i) *observed.add_event() = event_of(proto::RECEIVED, tick, i, i + 1);
    const std::string octets = observed.SerializeAsString();
    live.take(octets.data(), octets.size(), tick + 1, kLength);
  }
  const json one = json::parse(live.text(30, 31));
  EXPECT_EQ(one["type"], "flights");
  EXPECT_EQ(one["tick"].size(), 1000u);
  EXPECT_EQ(one["whole"], true);
  EXPECT_EQ(one["newest"], 40);
  const json more = json::parse(live.text(0, 100));
  EXPECT_EQ(more["tick"].size(), kMostFlights);
  EXPECT_EQ(more["whole"], false);
  EXPECT_EQ(more["tick"][0], 39.25) << "the newest count";
  EXPECT_TRUE(json::parse(live.text(0, 5))["tick"].empty()) << "too long ago";
  live.take("damaged", 7, 99, kLength);
  EXPECT_EQ(json::parse(live.text(30, 31)), one);
}

TEST(LiveFlights, TellWhatARobotHasSentAndWhomItHasHeard) {
  LiveFlights live;
  proto::Observations observed;
  *observed.add_event() = event_of(proto::RECEIVED, 10, 3, 8);
  *observed.add_event() = event_of(proto::RECEIVED, 90, 3, 9);
  *observed.add_event() = event_of(proto::RECEIVED, 91, 3, 9);
  *observed.add_event() = event_of(proto::RECEIVED, 91, 4, 3);
  *observed.add_event() = event_of(proto::SENT, 91, 3, 0);
  const std::string octets = observed.SerializeAsString();
  live.take(octets.data(), octets.size(), 100, kLength);
  const json robot = json::parse(live.robot_text(3, 99, 20));
  EXPECT_EQ(robot["sent"], 1);
  EXPECT_EQ(robot["received"], 3);
  EXPECT_EQ(robot["heard"][0]["robot"], 9);
  EXPECT_EQ(robot["heard"][0]["count"], 2);
  EXPECT_EQ(robot["lately"].size(), 1u);
  EXPECT_EQ(robot["lately"][0], 9);
  EXPECT_EQ(robot["since"], 10);
}

}  // namespace
}  // namespace kilotwin::view
