// The overhead controller leads a swarm through the life cycle by radio: whole runs with stamped packets.
#include <gtest/gtest.h>

#include <algorithm>

#include "clients/local/local_run.hpp"
#include "idl/manifest.pb.h"
#include "tests/services/behaviours/swarm.hpp"

namespace kilotwin::local {
namespace {

using behaviours::test::message;
using behaviours::test::program;
using behaviours::test::Swarm;

/// Records each tick's life cycles, motors and LEDs.
class Watcher : public RunObserver {
 public:
  void state(Tick, const SwarmView& swarm, bool) override {
    ActuationFrame all;
    all.life_cycle = swarm.life_cycle;
    all.motor_left = swarm.motor_left;
    all.led = swarm.led;
    ticks.push_back(all);
  }
  void hash(Tick, std::uint64_t) override {}
  void input(const Directive&) override {}
  std::vector<ActuationFrame> ticks;
};

/// The overhead controller repeats `what` from tick `from` until its next packet.
Directive repeat(std::int64_t from, const IrMessage& what) {
  Directive directive;
  directive.tick = Tick{from};
  directive.kind = DirectiveKind::kOverheadInput;
  directive.packet = {OverheadCommand::kRepeat, what};
  return directive;
}

Directive silence(std::int64_t from) {
  Directive directive = repeat(from, {});
  directive.packet.command = OverheadCommand::kStop;
  return directive;
}

/// Swarm's text with a duration.
void last_for(proto::Manifest& manifest, double seconds) { manifest.mutable_experiment()->set_duration_s(seconds); }

std::vector<ActuationFrame> watch(const Swarm& swarm, std::vector<Directive> inputs) {
  LocalOptions options;
  for (std::size_t i = 0; i < inputs.size(); ++i) inputs[i].sequence_number = i;
  options.inputs = std::move(inputs);
  options.save_checkpoints = false;
  Watcher watcher;
  EXPECT_EQ(run(*swarm.plan, swarm.programs, options, watcher).failure, "");
  return watcher.ticks;
}

bool all_are(const ActuationFrame& frame, LifeCycle state) {
  return std::all_of(frame.life_cycle.begin(), frame.life_cycle.end(),
                     [&](std::uint8_t value) { return LifeCycle{value} == state; });
}

TEST(LifeCycleByRadio, ASwarmIsPausedResumedCheckedAndReset) {
  const Swarm swarm(
      {program("static uint8_t setups, loops; static message_t m; static message_t* tx(void) { return &m; }\n"
               "static void setup(void) { ++setups; }\n"
               "static void loop(void) { ++loops; set_motors(100 + setups, 0); set_color(loops > 60 ? 1 : 0); }")},
      12, 2, "", [](proto::Manifest& manifest) { last_for(manifest, 12); });
  const auto ticks = watch(swarm, {repeat(60, message(0x85)), silence(80), repeat(120, message(0x88)), silence(130),
                                   repeat(180, message(0x87)), silence(200), repeat(240, message(0x83)),
                                   silence(250), repeat(300, message(0x88)), silence(310)});
  ASSERT_GT(ticks.size(), 350u);
  const auto& running = ticks[50];
  EXPECT_TRUE(all_are(running, LifeCycle::kRunning));
  EXPECT_EQ(running.motor_left, std::vector<std::uint8_t>(12, 101));
  EXPECT_TRUE(all_are(ticks[100], LifeCycle::kIdle)) << "paused";
  EXPECT_EQ(ticks[100].motor_left, std::vector<std::uint8_t>(12, 0));
  EXPECT_TRUE(all_are(ticks[170], LifeCycle::kRunning)) << "resumed";
  EXPECT_EQ(ticks[170].motor_left, std::vector<std::uint8_t>(12, 101)) << "without another setup()";
  EXPECT_EQ(ticks[170].led, std::vector<std::uint8_t>(12, 1)) << "its counter went on";
  EXPECT_TRUE(all_are(ticks[220], LifeCycle::kBattery));
  EXPECT_EQ(ticks[220].led, std::vector<std::uint8_t>(12, 0x0C));
  EXPECT_TRUE(all_are(ticks[290], LifeCycle::kIdle)) << "reset";
  EXPECT_TRUE(all_are(ticks[330], LifeCycle::kRunning));
  EXPECT_EQ(ticks[330].motor_left, std::vector<std::uint8_t>(12, 101)) << "setup() again, on memory made anew";
  EXPECT_EQ(ticks[330].led, std::vector<std::uint8_t>(12, 0));
}

TEST(LifeCycleByRadio, ASleepingSwarmWakesWhenItListens) {
  const Swarm swarm({program("static void loop(void) { set_color(3); }")}, 6, 1, "",
                    [](proto::Manifest& manifest) { last_for(manifest, 24); });
  const auto ticks = watch(swarm, {repeat(40, message(0x84)), silence(60), repeat(250, message(0x85))});
  EXPECT_TRUE(all_are(ticks[100], LifeCycle::kSleeping));
  EXPECT_EQ(ticks[100].led, std::vector<std::uint8_t>(6, 0));
  // The robots sleep from about tick 45, first listen 8 s later, at about tick 290, and receive the packet.
  EXPECT_TRUE(all_are(ticks[280], LifeCycle::kSleeping));
  EXPECT_TRUE(all_are(ticks[310], LifeCycle::kIdle));
}

TEST(LifeCycleByRadio, CalibrationReachesTheEeprom) {
  const Swarm swarm({program("static void loop(void) { set_motors(kilo_straight_left, 0); }")}, 4, 1, "",
                    [](proto::Manifest& manifest) { last_for(manifest, 10); });
  IrMessage straight = message(0x8A, 4);
  straight[5] = 77;
  straight[6] = 78;
  const auto ticks =
      watch(swarm, {repeat(40, straight), silence(60), repeat(80, message(0x8A, 0)), silence(90),
                    repeat(120, message(0x83)), silence(130), repeat(160, message(0x88)), silence(170)});
  EXPECT_TRUE(all_are(ticks[70], LifeCycle::kMoving));
  EXPECT_EQ(ticks[70].motor_left, std::vector<std::uint8_t>(4, 77)) << "tried";
  EXPECT_TRUE(all_are(ticks[110], LifeCycle::kIdle)) << "saved";
  EXPECT_EQ(ticks[200].motor_left, std::vector<std::uint8_t>(4, 77)) << "and kept over a reset";
}

}  // namespace
}  // namespace kilotwin::local
