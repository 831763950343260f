// Real robots hear simulated ones through the station: who is heard, what the message holds, within which limits.
#include "services/ark/simulated_hearing.hpp"

#include <gtest/gtest.h>

#include <map>

#include "idl/checkpoint.pb.h"
#include "services/ark/station_engine.hpp"
#include "tests/support/scenes.hpp"

namespace kilotwin::ark {
namespace {

/// Robots 0 to 3 are simulated, 40 mm apart on the x axis; 4 and 5 are real and hear within 60 mm.
class Hall {
 public:
  explicit Hall(const std::string& hears, const std::string& more = "")
      : plan(testing::make_plan(
            "robots { count: 4 } robots { count: 2 body: TRACKED hears_simulated { range_mm: 60 " + hears +
                " } } " + more,
            {{0, 0, 0}, {40, 0, 0}, {80, 0, 0}, {120, 0, 0}, {45, 30, 0}, {0, 300, 0}})),
        swarm(6, 0, plan.memory.size()) {
    for (std::uint32_t i = 0; i < 6; ++i) {
      const Pose pose = plan.initial_pose(i);
      bodies_.add(i, pose.x_mm, pose.y_mm, pose.heading_rad);
    }
    actuation = testing::motors(Tick{0}, std::vector<std::uint8_t>(6, 0), std::vector<std::uint8_t>(6, 0));
    actuation.life_cycle.assign(6, static_cast<std::uint8_t>(LifeCycle::kRunning));
  }
  /// These robots send a message with their number in octet 2.
  SwarmView& send(const std::vector<std::uint32_t>& senders) {
    actuation.offer_robot = senders;
    actuation.offer_message.clear();
    for (const std::uint32_t sender : senders)
      actuation.offer_message.push_back({0, 0, static_cast<std::uint8_t>(100 + sender)});
    const BodyFrame* body = &bodies_;
    const ActuationFrame* frame = &actuation;
    swarm.gather(Tick{0}, std::span(&body, 1));
    swarm.gather(std::span(&frame, 1));
    return swarm;
  }
  void place(std::uint32_t robot, double x_mm, double y_mm, double heading_rad) {
    bodies_.x_mm[robot] = x_mm;
    bodies_.y_mm[robot] = y_mm;
    bodies_.heading_rad[robot] = heading_rad;
  }

  RunPlan plan;
  SwarmView swarm;
  ActuationFrame actuation;

 private:
  BodyFrame bodies_;
};

TEST(SimulatedHearing, TheNearestSenderInRangeIsHeard) {
  Hall hall("type: 5 octet: 2");
  const SimulatedHearing hearing(hall.plan);
  ASSERT_TRUE(hearing.any());
  EXPECT_TRUE(hearing.heard(hall.send({})).empty());
  EXPECT_TRUE(hearing.heard(hall.send({3})).empty()) << "out of range";
  using Messages = std::vector<ArkMessage>;
  EXPECT_EQ(hearing.heard(hall.send({0})), (Messages{{4, 5, 100}}));
  EXPECT_EQ(hearing.heard(hall.send({0, 1, 2})), (Messages{{4, 5, 101}}));
  EXPECT_EQ(hearing.heard(hall.send({2, 1, 0})), (Messages{{4, 5, 101}})) << "in whatever order hosts send";
  EXPECT_TRUE(hearing.heard(hall.send({4, 5})).empty()) << "real robots hear each other by themselves";
  hall.place(4, 60, 0, 0);
  EXPECT_EQ(hearing.heard(hall.send({2, 1})), (Messages{{4, 5, 101}})) << "of two as near, the lower number";
  hall.actuation.life_cycle[4] = static_cast<std::uint8_t>(LifeCycle::kAbsent);
  EXPECT_TRUE(hearing.heard(hall.send({1})).empty());
}

TEST(SimulatedHearing, TheDataIsWhatTheExperimentAsksFor) {
  const auto data = [](const std::string& what) {
    Hall hall(what);
    hall.place(4, 40, 30, 1.5707963267948966);
    return SimulatedHearing(hall.plan).heard(hall.send({1})).at(0).payload;
  };
  EXPECT_EQ(data("data: SENDER"), 1);
  EXPECT_EQ(data("data: DISTANCE_MM"), 30);
  EXPECT_EQ(data("data: BEARING_DEG"), 180) << "behind a robot that looks up the y axis";
  EXPECT_EQ(data("octet: 1"), 0);
}

TEST(SimulatedHearing, WithoutABlockNobodyHears) {
  const RunPlan plan =
      testing::make_plan("robots { count: 1 } robots { count: 1 body: TRACKED }", {{0, 0, 0}, {40, 0, 0}});
  EXPECT_FALSE(SimulatedHearing(plan).any());
  EXPECT_FALSE(StationEngine(plan, {}).uses_queue());
}

/// The messages of a station over some ticks in which robot 1 sends all the time, by the time at which they leave.
std::map<double, ArkMessage> messages_to(StationEngine& station, Hall& hall, Tick& now, std::int64_t ticks) {
  std::map<double, ArkMessage> messages;
  for (const Tick end = now + ticks; now < end; ++now) {
    SwarmView& swarm = hall.send({1});
    swarm.tick = now;
    station.step(now, {swarm, {}});
    OverheadFrame frame;
    station.emit(frame);
    for (const OverheadPacket& packet : frame.packets) {
      if (packet.command != OverheadCommand::kRepeat || packet.message.back() != 0) continue;
      for (const ArkMessage& message : unpack(packet.message)) {
        if (message.id == kArkNobody) continue;
        messages[hall.plan.tick_length.seconds_at(now + 1) + packet.offset_cycles() / kNominalClockHz] = message;
      }
    }
  }
  return messages;
}

TEST(SimulatedHearing, MessagesKeepTheIntervalOfARobotAndSurviveACheckpoint) {
  Hall hall("type: 7 data: SENDER", "station { robot_interval_s: 0.4 }");
  StationEngine station(hall.plan, {});
  Tick now;
  const auto messages = messages_to(station, hall, now, 300);
  ASSERT_GT(messages.size(), 20u);
  double last_s = -1;
  for (const auto& [time_s, message] : messages) {
    EXPECT_EQ(message, (ArkMessage{4, 7, 1}));
    EXPECT_GE(time_s - last_s, 0.4 - 1e-9);
    last_s = time_s;
  }
  proto::StationState state;
  station.save(state);
  StationEngine resumed(hall.plan, {});
  const proto::StationState* part = &state;
  resumed.load(now, std::span(&part, 1));
  EXPECT_EQ(resumed.hash_part(), station.hash_part());
  Tick again = now;
  EXPECT_EQ(messages_to(resumed, hall, again, 100), messages_to(station, hall, now, 100));
  EXPECT_EQ(resumed.hash_part(), station.hash_part());
}

}  // namespace
}  // namespace kilotwin::ark
