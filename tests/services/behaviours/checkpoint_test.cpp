#include <gtest/gtest.h>

#include "core/base/error.hpp"
#include "idl/checkpoint.pb.h"
#include "tests/services/behaviours/swarm.hpp"

namespace kilotwin::behaviours::test {
namespace {

/// The state that all hosts save, serialised and parsed again.
std::vector<proto::BehavioursState> saved(const Swarm& swarm) {
  std::vector<proto::BehavioursState> parts;
  for (const auto& host : swarm.hosts) {
    proto::BehavioursState state;
    host->save(state);
    parts.emplace_back().ParseFromString(state.SerializeAsString());
  }
  return parts;
}

void load(Swarm& swarm, Tick tick, const std::vector<proto::BehavioursState>& parts) {
  std::vector<const proto::BehavioursState*> pointers;
  for (const proto::BehavioursState& part : parts) pointers.push_back(&part);
  for (const auto& host : swarm.hosts) host->load(tick, pointers);
  swarm.tick = tick;
}

Air next(const Swarm& swarm) {
  Air air = echo(swarm.frame());
  if (swarm.tick.count() < 3) {
    air.receptions.clear();
    for (std::uint32_t robot = 0; robot < swarm.plan->robots(); ++robot)
      air.receptions.push_back({robot, message(kRun)});
  }
  return air;
}

TEST(Checkpoint, ContinuesOnOtherHostsAsIfNothingHadHappened) {
  // Random walks, waits in the middle of functions, and robots that fault on the way.
  const std::vector<std::string> texts{
      std::string(KILOTWIN_BEHAVIOURS) + "/disperse.c", std::string(KILOTWIN_BEHAVIOURS) + "/delay_walk.c",
      program("static int depth(int n) { volatile int here = n; delay(7 + n); return n == 0 ? 0 : depth(n - 1) + "
              "here; }\n"
              "static message_t m; static message_t* tx(void) { return &m; }\n"
              "static void loop(void) { m.data[1] = depth(rand_soft() & 15); set_motors(m.data[1], rand());\n"
              "  if (kilo_uid % 8 == 3 && kilo_ticks > 60) *(volatile int*)0 = 1; }")};
  for (const int at : {0, 1, 2, 37, 100}) {
    Swarm first(texts, 20, 3), second(texts, 20, 4);
    for (int k = 0; k < at; ++k) first.step(next(first));
    load(second, first.tick, saved(first));
    ASSERT_TRUE(equal(first.frame(), second.frame())) << "saved at " << at;
    ASSERT_EQ(first.hash(), second.hash());
    for (int k = 0; k < 80; ++k) {
      const Air air = next(first);
      first.step(air);
      second.step(air);
      ASSERT_TRUE(equal(first.frame(), second.frame())) << "saved at " << at << ", " << k << " ticks later";
      ASSERT_EQ(first.hash(), second.hash());
    }
    std::uint32_t failed_first = 0, failed_second = 0;
    for (const auto& host : first.hosts) failed_first += host->robots_failed();
    for (const auto& host : second.hosts) failed_second += host->robots_failed();
    EXPECT_EQ(failed_first, failed_second);
    if (at == 100) {
      EXPECT_GT(failed_first, 0u);
    }
  }
}

TEST(Checkpoint, DoesNotDependOnTheHostsKnowledgeOfBusyWaits) {
  // A host that has seen a robot in a busy wait looks for it at once; a host that has just loaded the robot looks later. Both
  // must find an endless loop in the same tick, and loops with several tests or a counter must reach the same state.
  const std::vector<std::string> texts{
      program(
          "static volatile uint8_t go; uint32_t sum;\n"
          "static void rx(message_t* m, distance_measurement_t* d) { if (m->type == 9) go = 1; }\n"
          "static void loop(void) { while (!go); for (volatile int i = 0; i < 60; ++i) sum += i; for (;;) {} }"),
      program("static volatile uint8_t go; static uint16_t n; static uint32_t rounds;\n"
              "static void rx(message_t* m, distance_measurement_t* d) { if (m->type == 9) ++go; }\n"
              "static uint8_t odd(uint32_t x) { return rand_soft() != 1 && (x & 1); }\n"
              "static void loop(void) { uint8_t before = go; while (go == before) { ++n; if (kilo_uid & 1) rounds "
              "+= 3; }\n"
              "  while (go == before + 1) { if (odd(kilo_ticks)) ++rounds; }\n"
              "  set_motors(n, n >> 8); set_color(rounds); }")};
  for (const int at : {10, 19, 20, 21, 22}) {
    Swarm seen(texts, 9, 2), loaded(texts, 9, 1);
    seen.start();
    const auto air = [](const Swarm& swarm) {
      Air result;
      for (std::uint32_t robot = 0; swarm.tick.count() % 7 == 0 && robot < swarm.plan->robots(); ++robot) {
        result.receptions.push_back({robot, message(swarm.tick.count() < 20 ? 1 : 9)});
      }
      return result;
    };
    while (seen.tick.count() < at) seen.step(air(seen));
    load(loaded, seen.tick, saved(seen));
    for (int k = 0; k < 60; ++k) {
      seen.step(air(seen));
      loaded.step(air(loaded));
      ASSERT_TRUE(equal(seen.frame(), loaded.frame())) << "loaded at " << at << ", " << k << " ticks later";
    }
    EXPECT_EQ(loaded.life_cycle(3), LifeCycle::kFailed);
    EXPECT_EQ(loaded.life_cycle(12), LifeCycle::kRunning);
  }
}

TEST(Checkpoint, HeapsGrowAsTheyAreUsed) {
  // Robots with lists of different lengths share a slot. All blocks keep their content, and a robot's memory has the size that it
  // has allocated.
  const std::vector<std::string> texts{program(
      "#include <stdlib.h>\n#include <string.h>\n"
      "typedef struct block { struct block* next; uint32_t check; uint8_t filling[240]; } block;\n"
      "static block* list; static uint16_t count; static uint8_t wrong;\n"
      "static void loop(void) {\n"
      "  block* b = count < kilo_uid * 12 ? malloc(sizeof *b) : NULL;\n"
      "  if (b) { for (int i = 0; i < 240; ++i) wrong |= b->filling[i];\n"
      "    b->next = list; b->check = ++count * 77; memset(b->filling, kilo_uid, 240); list = b; }\n"
      "  uint16_t n = count;\n"
      "  for (b = list; b; b = b->next, --n) wrong |= b->check != n * 77 || b->filling[n % 240] != kilo_uid;\n"
      "  wrong |= n != 0; set_motors(count, count >> 8); set_color(wrong ? RGB(3, 0, 0) : RGB(0, 3, 0)); }")};
  Swarm first(texts, 26), second(texts, 26, 3);
  first.start();
  const std::uint64_t at_first = first.hosts[0]->memory_octets();
  EXPECT_LT(at_first, 26u * 2000);
  for (int k = 0; k < 200; ++k) {
    if (k == 100) load(second, first.tick, saved(first));
    first.step();
    if (k < 100) continue;
    second.step();
    ASSERT_TRUE(equal(first.frame(), second.frame())) << k;
  }
  const ActuationFrame frame = first.frame();
  for (std::uint32_t robot = 0; robot < 26; ++robot) {
    EXPECT_EQ(frame.led[robot], 3 << 2) << robot;
    // 64 KiB hold 250 blocks of 264 octets with their headers.
    const unsigned wanted = std::min(robot * 12, 201u),
                   blocks = frame.motor_left[robot] | frame.motor_right[robot] << 8;
    EXPECT_EQ(blocks, wanted);
  }
  const std::uint64_t taken = first.hosts[0]->memory_octets() - at_first;
  EXPECT_GT(taken, 26u * 100 * 256);
  EXPECT_LT(taken, 26u * 201 * 280);
}

TEST(Checkpoint, TheSlackBehindTheLastArrayIsPrivate) {
  // On a robot the memory behind the last array is usually unused.
  const std::vector<std::string> texts{program(
      "uint8_t last[8];\n"
      "static void loop(void) { volatile uint8_t* beyond = last + sizeof last; set_color(beyond[20] & 63);\n"
      "  beyond[20] = kilo_uid + 1; }")};
  Swarm swarm(texts, 20);
  swarm.start();
  swarm.steps(5);
  for (std::uint32_t robot = 0; robot < 20; ++robot) EXPECT_EQ(swarm.led(robot), robot + 1);
}

TEST(Checkpoint, SavesWhatItHasLoaded) {
  Swarm first({program("static void loop(void) { delay(rand_hard()); set_color(rand_soft()); }")}, 5),
      second({program("static void loop(void) { delay(rand_hard()); set_color(rand_soft()); }")}, 5);
  for (int k = 0; k < 20; ++k) first.step(next(first));
  const auto parts = saved(first);
  load(second, first.tick, parts);
  EXPECT_EQ(saved(second)[0].SerializeAsString(), parts[0].SerializeAsString());
}

TEST(Checkpoint, RejectsACheckpointThatDoesNotFit) {
  Swarm swarm({program("")}, 2),
      other({program("static uint8_t big[1000]; static void loop(void) { big[rand()%1000]++; }")}, 2);
  swarm.start();
  other.start();
  EXPECT_THROW(load(swarm, swarm.tick, saved(other)), RunError);
  EXPECT_THROW(load(swarm, swarm.tick, {}), RunError);
}

}  // namespace
}  // namespace kilotwin::behaviours::test
