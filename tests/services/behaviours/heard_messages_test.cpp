// Real robots that say what listeners heard of them: once each, when the channel is free.
#include <gtest/gtest.h>

#include "idl/checkpoint.pb.h"
#include "idl/manifest.pb.h"
#include "services/behaviours/engine.hpp"
#include "tests/support/scenes.hpp"

namespace kilotwin::behaviours {
namespace {

/// Robots 0 and 1 say what was heard of them, robot 2 says nothing. Nobody has a program.
RunPlan make_plan() {
  proto::Manifest manifest =
      testing::make_plan("robots { count: 2 body: TRACKED says { heard: true } } robots { count: 1 body: TRACKED }",
                         {{0, 0, 0}, {60, 0, 0}, {120, 0, 0}})
          .manifest();
  manifest.clear_program();
  return RunPlan(std::move(manifest));
}

class Host {
 public:
  Host()
      : plan(make_plan()),
        engine(std::make_unique<BehavioursEngine>(plan, HostId{0}, std::make_shared<ProgramSet>())) {}

  struct Given {
    std::vector<std::uint32_t> ask{}, sent{}, said{};
    std::vector<MembershipChange> memberships{};
    std::uint8_t octet = 0;
  };
  ActuationFrame step(const Given& given) {
    RadioFrame radio;
    radio.tick = now;
    radio.kilo_ticks.assign(3, 1);
    radio.ask = given.ask;
    radio.sent = given.sent;
    TrackingFrame tracking;
    tracking.tick = now;
    tracking.said_robot = given.said;
    tracking.said_message.assign(given.said.size(), IrMessage{given.octet});
    engine->step(now, radio, nullptr, {&tracking, given.memberships});
    ++now;
    ActuationFrame frame;
    engine->emit(frame);
    return frame;
  }
  void reload() {
    proto::BehavioursState state;
    engine->save(state);
    auto loaded = std::make_unique<BehavioursEngine>(plan, HostId{0}, std::make_shared<ProgramSet>());
    const proto::BehavioursState* part = &state;
    loaded->load(now, std::span(&part, 1));
    EXPECT_EQ(loaded->hash_part(), engine->hash_part());
    engine = std::move(loaded);
  }

  RunPlan plan;
  std::unique_ptr<BehavioursEngine> engine;
  Tick now;
};

using Ids = std::vector<std::uint32_t>;

TEST(HeardMessages, AMessageIsOfferedOnceWhenTheRadioAsks) {
  Host host;
  ActuationFrame frame = host.step({.ask = {0, 1, 2}});
  EXPECT_EQ(frame.offer_robot, Ids{}) << "nothing was heard yet";
  EXPECT_EQ(frame.life_cycle[0], static_cast<std::uint8_t>(LifeCycle::kRunning));
  EXPECT_EQ(frame.life_cycle[2], static_cast<std::uint8_t>(LifeCycle::kIdle));
  const std::uint64_t before = host.engine->hash_part();
  frame = host.step({.said = {1, 2}, .octet = 5});
  EXPECT_EQ(frame.offer_robot, Ids{}) << "the radio did not ask";
  EXPECT_NE(host.engine->hash_part(), before) << "what waits is state";
  host.reload();
  frame = host.step({.ask = {0, 1, 2}});
  EXPECT_EQ(frame.offer_robot, Ids{1}) << "robot 2 has not declared that it says what was heard";
  EXPECT_EQ(frame.offer_message.at(0), IrMessage{5});
  host.reload();
  EXPECT_EQ(host.step({.ask = {0}}).offer_robot, Ids{});
  EXPECT_EQ(host.step({.ask = {1}, .sent = {1}}).offer_robot, Ids{}) << "once";
}

TEST(HeardMessages, ANewerMessageTakesThePlaceOfOneThatWaits) {
  Host host;
  host.step({.said = {0}, .octet = 1});
  host.step({.said = {0}, .octet = 2});
  EXPECT_EQ(host.step({.ask = {0}}).offer_message.at(0), IrMessage{2});
  host.step({.said = {0}, .octet = 3});
  EXPECT_EQ(host.step({.ask = {0}}).offer_robot, Ids{}) << "it still holds one";
  EXPECT_EQ(host.step({.ask = {0}, .sent = {0}}).offer_message.at(0), IrMessage{3});
}

TEST(HeardMessages, AnAbsentRobotSaysNothing) {
  Host host;
  host.step({.said = {0}, .octet = 1});
  host.step({.memberships = {{0, Membership::kLost}}});
  EXPECT_EQ(host.step({.ask = {0}, .said = {0}, .octet = 1}).offer_robot, Ids{});
  host.step({.memberships = {{0, Membership::kJoined}}});
  EXPECT_EQ(host.step({.ask = {0}}).offer_robot, Ids{}) << "what was heard meanwhile is forgotten";
}

}  // namespace
}  // namespace kilotwin::behaviours
