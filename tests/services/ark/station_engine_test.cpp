#include "services/ark/station_engine.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <random>
#include <string>

#include "core/base/error.hpp"
#include "core/plan/station_settings.hpp"
#include "idl/checkpoint.pb.h"
#include "tests/services/ark/plugin_bench.hpp"
#include "tests/support/scenes.hpp"

namespace kilotwin::ark {
namespace {

constexpr std::uint8_t kRun = 0x88;
const std::string kHub = "station { environment { hub { radius_mm: 300 } } } ";

RunPlan plan_of(std::uint32_t robots, const std::string& experiment = "") {
  return testing::make_plan(experiment, testing::grid_crowd(robots, 40, testing::Facing::kRandom));
}

/// A station with robots at rest, divided into some frames.
class Scene {
 public:
  explicit Scene(const RunPlan& plan, std::uint32_t parts = 1)
      : station(plan),
        bodies_(parts),
        actuation_(parts),
        swarm_(plan.robots(), plan.movables(), plan.memory.size()) {
    for (std::uint32_t i = 0; i < plan.robots(); ++i) {
      const Pose pose = plan.initial_pose(i);
      bodies_[i % parts].add(i, pose.x_mm, pose.y_mm, pose.heading_rad);
    }
    for (std::uint32_t p = 0; p < parts; ++p) {
      const std::uint32_t first = plan.robots() * p / parts, last = plan.robots() * (p + 1) / parts;
      actuation_[p] = testing::motors(Tick{0}, std::vector<std::uint8_t>(last - first, 0),
                                      std::vector<std::uint8_t>(last - first, 0), first);
      body_frames_.push_back(&bodies_[p]);
      actuation_frames_.push_back(&actuation_[p]);
    }
    std::reverse(body_frames_.begin(), body_frames_.end());
    station.emit(frame);
  }
  void step(const std::vector<OverheadPacket>& external = {}) {
    swarm_.gather(now, body_frames_);
    swarm_.gather(actuation_frames_);
    station.step(now, {swarm_, external});
    station.emit(frame);
    ++now;
  }
  /// Of a scene with one part.
  void place(std::uint32_t robot, double x_mm, double y_mm) {
    bodies_[0].x_mm[robot] = x_mm;
    bodies_[0].y_mm[robot] = y_mm;
  }
  void set_led(std::uint32_t robot, std::uint8_t led) { actuation_[0].led[robot] = led; }
  void set_life(std::uint32_t robot, LifeCycle life) {
    actuation_[0].life_cycle[robot] = static_cast<std::uint8_t>(life);
  }
  /// Steps for some ticks; the messages to one robot.
  std::vector<ArkMessage> messages_to(std::uint16_t robot, int ticks) {
    std::vector<ArkMessage> messages;
    for (int k = 0; k < ticks; ++k) {
      step();
      for (const OverheadPacket& packet : frame.packets) {
        if (packet.command != OverheadCommand::kRepeat || packet.message.back() != 0) continue;
        for (const ArkMessage& message : unpack(packet.message)) {
          if (message.id == robot) messages.push_back(message);
        }
      }
    }
    return messages;
  }

  StationEngine station;
  OverheadFrame frame;
  Tick now;

 private:
  std::vector<BodyFrame> bodies_;
  std::vector<ActuationFrame> actuation_;
  std::vector<const BodyFrame*> body_frames_;
  std::vector<const ActuationFrame*> actuation_frames_;
  SwarmView swarm_;
};

void expect_equal(const SeenRobots& a, const SeenRobots& b) {
  EXPECT_EQ(a.x_mm, b.x_mm);
  EXPECT_EQ(a.y_mm, b.y_mm);
  EXPECT_EQ(a.heading_rad, b.heading_rad);
  EXPECT_EQ(a.vx_mm, b.vx_mm);
  EXPECT_EQ(a.vy_mm, b.vy_mm);
  EXPECT_EQ(a.led, b.led);
  EXPECT_EQ(a.seen, b.seen);
}

bool equal(const OverheadPacket& a, const OverheadPacket& b) {
  return a.command == b.command && a.message == b.message && a.offset == b.offset;
}

TEST(StationEngine, BroadcastsRunThenStops) {
  const RunPlan plan = plan_of(5, "station { start_broadcast_s: 0.25 }");
  Scene scene(plan);
  ASSERT_EQ(scene.frame.tick, Tick{0});
  ASSERT_EQ(scene.frame.packets.size(), 1u);
  EXPECT_EQ(scene.frame.packets[0].command, OverheadCommand::kRepeat);
  EXPECT_EQ(scene.frame.packets[0].message, (IrMessage{0, 0, 0, 0, 0, 0, 0, 0, 0, kRun}));
  for (int k = 1; k < 200; ++k) {
    scene.step();
    EXPECT_EQ(scene.frame.tick, Tick{k});
    ASSERT_EQ(scene.frame.packets.size(), k == 8 ? 1u : 0u);  // 0.25 s = 7.6 ticks
    if (k == 8) {
      EXPECT_EQ(scene.frame.packets[0].command, OverheadCommand::kStop);
    }
  }
}

/// Messages of a run, with the limits checked on the way: packets at least one interval apart, a robot at most once per
/// max(1 s, N * 0.05 s / 3), and never a robot before one that has waited longer.
constexpr double kRounding_s = 1e-9;
std::size_t messages_within_limits(std::uint32_t robots, double packet_interval_s, std::int64_t ticks) {
  const RunPlan plan = plan_of(robots, "station { packet_interval_s: " + std::to_string(packet_interval_s) +
                                           " environment { hub { radius_mm: 300 } } }");
  Scene scene(plan);
  std::map<std::uint16_t, double> last;
  double last_packet_s = -1;
  std::size_t messages = 0;
  const double least_s = std::max(1.0, robots * 0.05 / 3);
  while (scene.now.count() < ticks) {
    scene.step();
    for (const OverheadPacket& packet : scene.frame.packets) {
      EXPECT_LT(packet.offset_cycles(), plan.tick_length.cycles());
      const double at_s = plan.tick_length.seconds_at(scene.now) + packet.offset_cycles() / kNominalClockHz;
      if (scene.now > Tick{8} && last_packet_s > 0.3) {
        EXPECT_GE(at_s - last_packet_s, packet_interval_s - kRounding_s);
      }
      last_packet_s = at_s;
      if (packet.command != OverheadCommand::kRepeat) continue;
      EXPECT_EQ(packet.message[9], 0);
      double longest_left_s = -1;
      std::vector<std::uint16_t> addressed;
      for (const ArkMessage& message : unpack(packet.message)) {
        if (message.id == kArkNobody) continue;
        EXPECT_LT(message.id, robots);
        EXPECT_LE(message.type, 1);
        ++messages;
        if (last.contains(message.id)) {
          EXPECT_GE(at_s - last[message.id], least_s - kRounding_s);
          longest_left_s = std::max(longest_left_s, last[message.id]);
        }
        addressed.push_back(message.id);
      }
      for (std::uint16_t robot = 0; robot < robots; ++robot) {
        if (std::find(addressed.begin(), addressed.end(), robot) != addressed.end()) continue;
        EXPECT_TRUE(longest_left_s < 0 || (last.contains(robot) && last[robot] >= longest_left_s));
      }
      for (const std::uint16_t robot : addressed) last[robot] = at_s;
    }
  }
  EXPECT_EQ(last.size(), std::min<std::size_t>(robots, 3 * messages));
  return messages;
}

TEST(StationEngine, ServesRobotsInTurnWithinTheLimits) {
  const double seconds = 3000 * 0.032768;
  // Few robots: each once a second; many: three per packet, 20 packets per second, which is ARK's 60 messages per second.
  EXPECT_NEAR(static_cast<double>(messages_within_limits(5, 0.05, 3000)), 5 * seconds, 10);
  EXPECT_NEAR(static_cast<double>(messages_within_limits(1000, 0.05, 3000)), 60 * seconds, 30);
  EXPECT_NEAR(static_cast<double>(messages_within_limits(60, 0.05, 3000)), 60 * seconds, 80);
  EXPECT_NEAR(static_cast<double>(messages_within_limits(1000, 0.02, 3000)), 60 * seconds,
              120);  // the robots' own limit
  EXPECT_NEAR(static_cast<double>(messages_within_limits(100, 0.5, 3000)), 6 * seconds, 10);
  messages_within_limits(1, 0.05, 500);
  messages_within_limits(64, 0.09, 3000);
}

TEST(StationEngine, TellsWhatTheTrackerSaw) {
  const RunPlan plan = plan_of(9, "station { environment { hub { x_mm: 40 y_mm: 0 radius_mm: 30 } } }");
  Scene scene(plan);
  std::size_t inside = 0;
  PluginBench hub(plan.station_settings().environments[0].built_in,
                  plan.station_settings().environments[0].parameters, 9);
  for (int k = 0; k < 40; ++k) {
    scene.step();
    if (scene.frame.packets.empty() || scene.frame.packets[0].command != OverheadCommand::kRepeat) continue;
    for (const ArkMessage& message : unpack(scene.frame.packets[0].message)) {
      if (message.id == kArkNobody) continue;
      EXPECT_EQ(message, hub.sense({message.id, plan.initial_pose(message.id)}).value());
      inside += message.type;
    }
  }
  EXPECT_EQ(inside, 1u);  // the robot at (40, 0)
}

/// A camera that shows a frame every 100 s, and the first one at once.
const std::string kSlowCamera =
    "frame_rate_hz: 0.01 led_error: 0 dropped_frames: 0 losses_per_hour: 0 swaps_per_hour: 0 ";

TEST(StationEngine, PluginsSeeWhatTheCameraShowsAndNotTheTruth) {
  const RunPlan plan = plan_of(30, "station { camera { position_noise_mm: 60 " + kSlowCamera +
                                       "} environment { hub { x_mm: 40 y_mm: 0 radius_mm: 60 } } }");
  Scene scene(plan);
  PluginBench hub("hub", plan.station_settings().environments[0].parameters, 30);
  const SeenRobots seen = scene.station.seen();
  int from_truth = 0, messages = 0;
  for (int k = 0; k < 60; ++k) {
    scene.step();
    for (const OverheadPacket& packet : scene.frame.packets) {
      if (packet.command != OverheadCommand::kRepeat || packet.message.back() != 0) continue;
      for (const ArkMessage& message : unpack(packet.message)) {
        if (message.id == kArkNobody) continue;
        const Pose pose{seen.x_mm[message.id], seen.y_mm[message.id], seen.heading_rad[message.id]};
        EXPECT_EQ(message, hub.sense({message.id, pose}).value());
        from_truth += message == hub.sense({message.id, plan.initial_pose(message.id)}).value();
        ++messages;
      }
    }
  }
  EXPECT_GE(messages, 30);
  EXPECT_LE(from_truth, 3) << "of " << messages;
}

/// A tracked robot that joins late, is lost, and comes back elsewhere.
TEST(StationEngine, ARobotThatIsAbsentIsNotSeenAndGetsNoMessages) {
  for (const std::string camera : {"", "camera { led_error: 0 dropped_frames: 0 losses_per_hour: 0 } "}) {
    const RunPlan plan = testing::make_plan(
        "robots { count: 2 } robots { count: 1 body: TRACKED } tracking { start: WHEN_SEEN } station { " + camera +
            "environment { hub { radius_mm: 300 } } }",
        {{0, 0, 0}, {40, 0, 0}, {80, 0, 0}});
    Scene scene(plan);
    const auto is_seen = [&] { return scene.station.seen().seen[2] != 0; };
    EXPECT_FALSE(is_seen()) << "when plugins are set up";
    scene.set_life(2, LifeCycle::kAbsent);
    EXPECT_TRUE(scene.messages_to(2, 100).empty());
    EXPECT_FALSE(is_seen());
    EXPECT_NE(scene.station.seen().seen[1], 0);
    scene.place(2, 500, 100);
    scene.set_led(2, 3 << 4);
    scene.set_life(2, LifeCycle::kRunning);
    EXPECT_FALSE(scene.messages_to(2, 100).empty());
    EXPECT_TRUE(is_seen());
    EXPECT_NEAR(scene.station.seen().x_mm[2], 500, 10);
    scene.set_life(2, LifeCycle::kAbsent);
    static_cast<void>(scene.messages_to(2, 40));  // one may have waited
    EXPECT_FALSE(is_seen());
    EXPECT_TRUE(scene.messages_to(2, 100).empty());
    // Plugins may still ask what was seen of it last.
    EXPECT_EQ(scene.station.seen().led[2], LedClass::kBlue);
    // It is lifted to another place. That is no speed, also where the run is resumed in between.
    proto::StationState part;
    scene.station.save(part);
    const proto::StationState* const parts[] = {&part};
    Scene loaded(plan);
    loaded.station.load(scene.now, parts);
    loaded.now = scene.now;
    expect_equal(loaded.station.seen(), scene.station.seen());
    for (Scene* const one : {&scene, &loaded}) {
      one->place(2, -500, 100);
      one->set_led(2, 3 << 4);
      one->set_life(2, LifeCycle::kRunning);
      for (int k = 0; k < 8 && one->station.seen().seen[2] == 0; ++k) one->step();
      const SeenRobots& seen = one->station.seen();
      EXPECT_NE(seen.seen[2], 0);
      EXPECT_NEAR(seen.x_mm[2], -500, 10);
      EXPECT_LT(std::hypot(seen.vx_mm[2], seen.vy_mm[2]), 60);
    }
    EXPECT_EQ(loaded.station.hash_part(), scene.station.hash_part());
  }
}

TEST(StationEngine, FreesTheAirWhileNobodyIsDue) {
  const RunPlan plan = plan_of(3, kHub);
  Scene scene(plan);
  int repeats = 0, stops = 0;
  for (int k = 0; k < 310; ++k) {
    scene.step();
    for (const OverheadPacket& packet : scene.frame.packets) {
      repeats += packet.command == OverheadCommand::kRepeat;
      stops += packet.command == OverheadCommand::kStop;
    }
  }
  EXPECT_NEAR(repeats, 10, 1);
  EXPECT_NEAR(stops, repeats, 1);
}

TEST(StationEngine, ForwardsPacketsFromOutsideInOrder) {
  const RunPlan plan = plan_of(1000, kHub);
  Scene scene(plan);
  const std::vector<OverheadPacket> external{{OverheadCommand::kOnce, {1, 2, 3, 4, 5, 6, 7, 8, 9, 0x83}},
                                             {OverheadCommand::kRepeat, {9, 8, 7, 6, 5, 4, 3, 2, 1, 0x42}},
                                             {OverheadCommand::kStop, {}}};
  for (int k = 1; k < 100; ++k) {
    if (k % 7 != 0) {
      scene.step();
      continue;
    }
    scene.step(external);
    ASSERT_EQ(scene.frame.packets.size(), 3u);
    for (std::size_t i = 0; i < 3; ++i) EXPECT_TRUE(equal(scene.frame.packets[i], external[i]));
    scene.step();  // the overhead controller is ready for the next packet after 50 ms
    for (const OverheadPacket& packet : scene.frame.packets)
      EXPECT_GE(plan.tick_length.cycles() + packet.offset_cycles(), 400'000u);
  }
}

/// An external packet repeats until an external packet ends it, where the station has no packets of its own.
TEST(StationEngine, DoesNotStopWhatComesFromOutside) {
  for (int when : {3, 8, 20}) {
    const RunPlan plan = plan_of(5);
    Scene scene(plan);
    for (int k = 1; k < 60; ++k) {
      if (k == when) {
        scene.step({{OverheadCommand::kRepeat, {0, 0, 0, 0, 0, 0, 0, 0, 0, 0x42}}});
      } else {
        scene.step();
        EXPECT_TRUE(scene.frame.packets.empty() || k < when) << k;
      }
    }
  }
}

TEST(StationEngine, DivisionOfTheFramesChangesNothing) {
  const RunPlan plan = plan_of(100, kHub);
  Scene one(plan), many(plan, 7);
  for (int k = 0; k < 400; ++k) {
    one.step();
    many.step();
    ASSERT_EQ(one.station.hash_part(), many.station.hash_part());
    ASSERT_EQ(one.frame.packets.size(), many.frame.packets.size());
  }
}

TEST(StationEngine, LoadedEngineGoesOnAsTheSavedOne) {
  for (const std::uint32_t robots : {1u, 2u, 3u, 4u, 50u, 100u, 1022u}) {
    const RunPlan plan = plan_of(robots,
                                 "station { environment { hub { } } environment { hub { x_mm: 500 } } "
                                 "environment { foraging { food_x_mm: 0 food_y_mm: 0 } } } ");
    std::mt19937 random(robots);
    Scene scene(plan);
    std::unique_ptr<Scene> loaded;
    for (int k = 0; k < 1500; ++k) {
      std::vector<OverheadPacket> external;
      if (random() % 20 == 0) external.push_back({OverheadCommand::kRepeat, {static_cast<std::uint8_t>(random())}});
      scene.step(external);
      if (loaded) {
        loaded->step(external);
        ASSERT_EQ(loaded->station.hash_part(), scene.station.hash_part()) << robots << " " << k;
        ASSERT_EQ(loaded->frame.packets.size(), scene.frame.packets.size());
        for (std::size_t i = 0; i < scene.frame.packets.size(); ++i) {
          ASSERT_TRUE(equal(loaded->frame.packets[i], scene.frame.packets[i]));
        }
      }
      if (random() % 9 != 0) continue;
      proto::StationState part, read;
      scene.station.save(part);
      ASSERT_TRUE(read.ParseFromString(part.SerializeAsString()));
      const proto::StationState* const parts[] = {&read};
      loaded = std::make_unique<Scene>(plan);
      loaded->station.load(scene.now, parts);
      loaded->now = scene.now;
      OverheadFrame frame;
      loaded->station.emit(frame);
      ASSERT_EQ(frame.tick, scene.now);
      ASSERT_EQ(frame.packets.size(), scene.frame.packets.size());
      ASSERT_EQ(loaded->station.hash_part(), scene.station.hash_part());
    }
  }
}

TEST(StationEngine, RejectsAnotherExperimentsState) {
  const RunPlan plan = plan_of(5, kHub), other = plan_of(6, kHub);
  StationEngine engine(plan);
  proto::StationState part;
  StationEngine(other).save(part);
  const proto::StationState* const parts[] = {&part};
  EXPECT_THROW(engine.load(Tick{0}, parts), RunError);
  EXPECT_THROW(engine.load(Tick{0}, {}), RunError);
}

}  // namespace
}  // namespace kilotwin::ark
