// A program that crashes its behaviours host fails its own robot alone: the run continues from its last checkpoint with that
// robot failed, and gives the same result in both modes.
#include <gtest/gtest.h>

#include <csignal>
#include <fstream>

#include "clients/recorder/reader.hpp"
#include "core/federation/topics.hpp"
#include "tests/system/own_domain.hpp"
#include "tests/system/program.hpp"

namespace kilotwin::test {
namespace {

class Recoveries : public testing::Test {
 protected:
  /// A program whose robots `who` do `action` when their clocks show 60; all robots wait in delays and in loops.
  std::string behaviour(const std::string& name, const std::string& action,
                        const std::string& who = "kilo_uid == 3") const {
    std::ofstream(scratch / (name + ".c"))
        << "#include <kilolib.h>\n"
           "static uint8_t heard; static message_t m;\n"
           "static void rx(message_t* r, distance_measurement_t* d) { ++heard; }\n"
           "static message_t* tx(void) { return &m; }\n"
           "static void setup(void) { m.crc = message_crc(&m); }\n"
           "static void loop(void) { uint8_t h = heard; if (kilo_uid % 2) while (heard == h); else delay(70);\n"
           "  set_color(heard); set_motors(heard, 70); }\n"
           "static void act(void) { "
        << action
        << " }\n"
           "static void wait(void) { if ("
        << who
        << ") { if (kilo_ticks >= 60) act(); } else loop(); }\n"
           "int main(void) { kilo_init(); kilo_message_rx = rx; kilo_message_tx = tx; kilo_start(setup, wait); }\n";
    return scratch / (name + ".c");
  }
  recorder::Summary outcome(const std::string& name, const std::string& program, const Words& more) const {
    Words words{source("experiments/disperse.txtpb"), "--duration", "4", "--robots", "16", "--behaviour", program};
    words.insert(words.end(), more.begin(), more.end());
    return run(words, scratch, name);
  }
  std::string trajectories(const std::string& name) const {
    const Outcome exported =
        kilotwin({"export", scratch / name, "--trajectories", scratch / "t.csv", "--every", "1"}, scratch);
    EXPECT_EQ(exported.status, 0) << exported.err;
    return read(scratch / "t.csv");
  }
  Scratch scratch;
};

/// It overwrites the address to which the robot's code returns in the host: a wild pointer does not hit the host for certain. Nor
/// does the loss of %gs, which some kernels restore when they switch to another process.
constexpr const char* kKillHost = "void** host; __asm__ volatile(\"mov %%gs:0, %0\" : \"=r\"(host)); host[6] = 0;";

TEST_F(Recoveries, ACrashedHostFailsTheRobotThatCausedItAlone) {
  const std::string kills = behaviour("kills", kKillHost), faults = behaviour("faults", "*(volatile int*)8 = 1;");
  const auto failed = outcome("failed", faults, {"--mode", "local"});
  EXPECT_EQ(failed.robots_failed, 1u);
  EXPECT_EQ(failed.recoveries, 0u);
  const struct {
    const char* name;
    Words words;
    bool from_checkpoint;
  } cases[] = {
      {"federated", {"--partitions", "2x1", "--hosts", "2"}, false},
      {"federated-saving", {"--partitions", "2x1", "--hosts", "2", "--checkpoint-every", "0.5"}, true},
      {"local", {"--mode", "local"}, false},
      {"local-saving",
       {"--mode", "local", "--checkpoint-every", "0.5", "--partitions", "2x2", "--hosts", "2"},
       true},
  };
  for (const auto& [name, words, from_checkpoint] : cases) {
    SCOPED_TRACE(name);
    const auto recovered = outcome(name, kills, words);
    EXPECT_EQ(recovered.robots_failed, 1u);
    EXPECT_EQ(recovered.recoveries, 1u);
    EXPECT_EQ(recovered.state_hash, failed.state_hash);
    EXPECT_EQ(recovered.ticks, failed.ticks);
    EXPECT_EQ(recovered.messages.sent, failed.messages.sent);
    EXPECT_EQ(recovered.moved_mm.mean, failed.moved_mm.mean);
    // The robot's clock shows 60 at about 2 s.
    EXPECT_EQ(recovered.recovered_from_tick, from_checkpoint ? 48 : 0);
    EXPECT_FALSE(std::filesystem::exists(scratch / name + std::string("/recovered")));
    // One recording, from beginning to end.
    const Outcome replayed = kilotwin({"replay", scratch / name, "--verify"}, scratch);
    EXPECT_EQ(replayed.status, 0) << replayed.err;
    EXPECT_NE(replayed.out.find(std::to_string(failed.ticks + 1) + " ticks"), std::string::npos) << replayed.out;
    EXPECT_EQ(trajectories(name), trajectories("failed"));
  }
}

TEST_F(Recoveries, SeveralFaultyRobotsFailOneAfterAnother) {
  const std::string when = "static uint8_t n; if (++n < kilo_uid * 8) return; ";
  const auto failed =
      outcome("failed", behaviour("faults", when + "*(volatile int*)8 = 1;", "kilo_uid < 4"), {"--mode", "local"});
  EXPECT_EQ(failed.robots_failed, 4u);
  const std::string kills = behaviour("kills", when + kKillHost, "kilo_uid < 4");
  for (const Words& words : {Words{"--mode", "local", "--checkpoint-every", "0.5"},
                             Words{"--mode", "local", "--hosts", "8", "--threads", "2"},
                             Words{"--hosts", "2", "--partitions", "1x1", "--checkpoint-every", "0.25"}}) {
    const std::string name = "recovered" + words[1] + words[3];
    SCOPED_TRACE(name);
    const auto recovered = outcome(name, kills, words);
    EXPECT_EQ(recovered.recoveries, 4u);
    EXPECT_EQ(recovered.robots_failed, 4u);
    EXPECT_EQ(recovered.state_hash, failed.state_hash);
    EXPECT_EQ(kilotwin({"replay", scratch / name, "--verify"}, scratch).status, 0);
  }
}

TEST_F(Recoveries, AResumedRunContinuesFromItsNewestCheckpoint) {
  const auto failed = outcome("failed", behaviour("faults", "*(volatile int*)8 = 1;"), {"--mode", "local"});
  const std::string kills = behaviour("kills", kKillHost);
  Words words{"run",
              source("experiments/disperse.txtpb"),
              "--duration",
              "1",
              "--robots",
              "16",
              "--behaviour",
              kills,
              "--mode",
              "local",
              "--checkpoint-every",
              "0.5",
              "--out",
              scratch / "saved",
              "--quiet"};
  ASSERT_EQ(kilotwin(words, scratch).status, 0);
  const auto again = outcome("again", kills, {"--mode", "local", "--resume", scratch / "saved"});
  EXPECT_EQ(again.state_hash, failed.state_hash);
  EXPECT_EQ(again.resumed_from_tick, 16);
  EXPECT_EQ(again.recovered_from_tick, 16);
  const auto later = outcome("later", kills, {"--resume", scratch / "saved", "--checkpoint-every", "0.5"});
  EXPECT_EQ(later.state_hash, failed.state_hash);
  EXPECT_EQ(later.resumed_from_tick, 16);
  EXPECT_EQ(later.recovered_from_tick, 48);
  EXPECT_EQ(kilotwin({"replay", scratch / "later", "--verify"}, scratch).status, 0);
}

TEST_F(Recoveries, ExternalInputIsRepeated) {
  // The packet makes the faulty robot act. It is stamped for an earlier tick, and the test sends it once.
  std::ofstream(scratch / "told.c")
      << "#include <kilolib.h>\nstatic uint32_t told; static uint8_t heard;\n"
         "static void rx(message_t* r, distance_measurement_t* d) { ++heard; if (r->type == 7) told = kilo_ticks; "
         "}\n"
         "static void setup(void) {}\n"
         "static void loop(void) { set_color(heard); set_motors(heard, told);\n"
         "  if (kilo_uid == 3 && told && kilo_ticks > told + 20) { "
      << kKillHost << " } }\n"
      << "int main(void) { kilo_init(); kilo_message_rx = rx; kilo_start(setup, loop); }\n";
  for (const char* every : {"1000", "0.1"}) {
    const OwnDomain domain;
    const std::string name = "told-" + std::string(every);
    dds::Writer<PublicOverheadPacket> overhead(domain.participant, topics::overhead_packets());
    Process process({program(), "run", source("experiments/disperse.txtpb"), "--robots", "8", "--duration", "8",
                     "--pace", "6", "--partitions", "1x1", "--domain", domain.name, "--behaviour",
                     scratch / "told.c", "--checkpoint-every", every, "--out", scratch / name},
                    scratch.path());
    ASSERT_TRUE(eventually([&] { return overhead.readers() > 0; }));
    PublicOverheadPacket packet{};
    std::string("test").copy(packet.client, sizeof packet.client - 1);
    packet.request = 1;
    packet.command = 6;
    packet.message[9] = 7;
    overhead.write(packet);
    const Outcome outcome = process.wait();
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    const auto summary = recorder::read_summary(scratch / name + std::string("/summary.json"));
    EXPECT_EQ(summary.recoveries, 1u) << outcome.err;
    EXPECT_EQ(summary.robots_failed, 1u);
    recorder::Reader reader(scratch / name + std::string("/recording.ktrec"));
    int inputs = 0;
    while (const proto::Record* record = reader.next()) {
      if (record->has_input() && record->input().kind() == proto::InputRecord::OVERHEAD_INPUT) ++inputs;
    }
    EXPECT_EQ(inputs, 1);
    const Outcome replayed = kilotwin({"replay", scratch / name, "--verify"}, scratch);
    EXPECT_EQ(replayed.status, 0) << replayed.err;
  }
}

TEST_F(Recoveries, FirmwareRobotsLogsAreThoseOfOneRun) {
  // Robot 3, native, brings down its host at about 1.9 s. The others are firmware, and print from the first second on.
  std::ofstream(scratch / "talk.c")
      << "#define DEBUG\n#include <kilolib.h>\n#include <debug.h>\n"
         "static void setup(void) { printf(\"robot %u\\n\", kilo_uid); }\n"
         "static void loop(void) { static uint32_t next = 0;\n"
         "  if (kilo_ticks >= next) { printf(\"at %lu\\n\", (unsigned long)next); next += 15; } }\n"
         "int main(void) { kilo_init(); debug_init(); kilo_start(setup, loop); return 0; }\n";
  const auto logs_of = [&](const std::string& action, const std::string& name, const Words& more) {
    std::ofstream(scratch / (name + ".txtpb"))
        << "duration_s: 5 robots { count: 3 behaviour: \"talk.c\" avr: true layout { grid { pitch_mm: 50 } } }\n"
           "robots { count: 1 behaviour: \""
        << behaviour(name, action) << "\" layout { x_mm: 250 } }\n";
    Words words{scratch / (name + ".txtpb")};
    words.insert(words.end(), more.begin(), more.end());
    const auto summary = run(words, scratch, name);
    EXPECT_EQ(summary.robots_failed, 1u);
    std::vector<std::string> logs{std::to_string(summary.recoveries)};
    for (int robot = 0; robot < 3; ++robot)
      logs.push_back(read(scratch.path() / name / "logs" / ("robot-0000" + std::to_string(robot) + ".txt")));
    return logs;
  };
  auto whole = logs_of("*(volatile int*)8 = 1;", "whole", {"--mode", "local"});
  EXPECT_NE(whole[1].find("at 0\n"), std::string::npos) << whole[1];
  EXPECT_NE(whole[1].find("at 120\n"), std::string::npos) << whole[1];
  whole[0] = "1";
  EXPECT_EQ(logs_of(kKillHost, "saving", {"--mode", "local", "--checkpoint-every", "0.5"}), whole);
  EXPECT_EQ(logs_of(kKillHost, "federated", {"--partitions", "1x1", "--checkpoint-every", "0.5"}), whole);
}

TEST_F(Recoveries, SystemCallsFailTheirRobotAlone) {
  // exit_group(0), by which a program would end the whole run with status 0.
  const std::string ends =
      behaviour("ends", "__asm__ volatile(\"syscall\" : : \"a\"(231), \"D\"(0) : \"rcx\", \"r11\", \"memory\");");
  const auto failed = outcome("failed", behaviour("faults", "*(volatile int*)8 = 1;"), {"--mode", "local"});
  for (const Words& words : {Words{"--mode", "local"}, Words{"--partitions", "1x1"}}) {
    const auto ended = outcome("ended" + words[0], ends, words);
    EXPECT_EQ(ended.robots_failed, 1u);
    EXPECT_EQ(ended.recoveries, 0u);
    EXPECT_EQ(ended.state_hash, failed.state_hash);
  }
}

TEST_F(Recoveries, AKilledWorkerFailsNoRobot) {
  // Four hosts on four threads: when the first signal arrives at one thread, the others run programs until the process ends.
  for (const std::vector<int>& signals : {std::vector{SIGKILL}, std::vector{SIGABRT, SIGABRT}}) {
    const std::string run = scratch / ("run" + std::to_string(signals.size()));
    Process process({program(), "run", source("experiments/disperse.txtpb"), "--mode", "local", "--duration",
                     "100000", "--pace", "max", "--hosts", "4", "--threads", "4", "--out", run},
                    scratch.path());
    const auto worker = [&]() -> pid_t {
      for (const pid_t id : processes_with(run)) {
        if (id != process.id()) return id;
      }
      return -1;
    };
    ASSERT_TRUE(eventually([&] { return worker() > 0 && std::filesystem::exists(run + "/recording.ktrec"); }));
    const pid_t id = worker();
    ASSERT_GT(id, 0) << "the worker has ended";
    for (const int signal : signals) kill(id, signal);
    const Outcome outcome = process.wait(60);
    EXPECT_EQ(outcome.status, 1);
    EXPECT_NE(outcome.err.find("signal " + std::to_string(signals[0])), std::string::npos) << outcome.err;
    EXPECT_EQ(outcome.err.find("crashed"), std::string::npos) << outcome.err;
  }
}

}  // namespace
}  // namespace kilotwin::test
