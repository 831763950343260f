// However a run ends, no process stays behind, and its recording is usable.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <regex>

#include "clients/recorder/reader.hpp"
#include "core/federation/topics.hpp"
#include "tests/system/own_domain.hpp"
#include "tests/system/program.hpp"

namespace kilotwin::test {
namespace {

namespace fs = std::filesystem;

/// A run at real-time pace, which lasts until the test ends it.
class Endings : public testing::Test {
 protected:
  Words long_run(const Words& more = {}) const {
    Words words{program(),
                "run",
                source("experiments/disperse.txtpb"),
                "--duration",
                "600",
                "--pace",
                "1",
                "--partitions",
                "2x1",
                "--set",
                "recording.every_s=0.1",
                "--out",
                scratch / "run"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
  /// Waits until the run has recorded at least `states` states.
  bool recorded(std::uint64_t states) const {
    return eventually([&] {
      try {
        recorder::Reader reader(scratch / "run/recording.ktrec");
        std::uint64_t count = 0;
        while (reader.next_state() != nullptr) ++count;
        return count >= states;
      } catch (const std::exception&) {
        return false;
      }
    });
  }
  void expect_nothing_left() const {
    EXPECT_TRUE(eventually([&] { return processes_with(scratch / "run").empty(); }, 20));
  }
  void expect_usable_recording() {
    const Outcome exported =
        kilotwin({"export", scratch / "run", "--trajectories", scratch / "t.csv", "--every", "0.1"}, scratch);
    EXPECT_EQ(exported.status, 0) << exported.err;
    EXPECT_GT(read(scratch / "t.csv").size(), 10'000u);
    const Outcome replayed = kilotwin({"replay", scratch / "run", "--verify"}, scratch);
    EXPECT_EQ(replayed.status, 0) << replayed.err;
  }
  /// The process of the service whose command line has `word`.
  pid_t service(const std::string& word) const {
    for (const pid_t id : processes_with(scratch / "run")) {
      const std::string line = read("/proc/" + std::to_string(id) + "/cmdline");
      if (line.find(std::string("service") + '\0' + word) != std::string::npos) return id;
    }
    return -1;
  }
  static std::size_t shared_memory_files() {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator("/dev/shm"), fs::directory_iterator()));
  }
  Scratch scratch;
};

TEST_F(Endings, InterruptsEndARunInOrder) {
  for (const int signal : {SIGINT, SIGTERM}) {
    fs::remove_all(scratch / "run");
    const std::size_t shared_before = shared_memory_files();
    Process process(long_run(), scratch.path());
    ASSERT_TRUE(recorded(5));
    process.signal(signal);
    const Outcome outcome = process.wait();
    EXPECT_EQ(outcome.status, 1);
    EXPECT_NE(outcome.err.find("interrupted"), std::string::npos) << outcome.err;
    expect_nothing_left();
    EXPECT_LE(shared_memory_files(), shared_before);
    EXPECT_TRUE(fs::exists(scratch / "run/summary.json"));
    expect_usable_recording();
  }
}

TEST_F(Endings, InterruptsDoNotWaitForASlowPace) {
  Words words = long_run();
  words[6] = "0.0001";  // over 300 s a tick, longer than this test waits for an end
  Process process(words, scratch.path());
  ASSERT_TRUE(recorded(1));
  process.signal(SIGINT);
  const Outcome outcome = process.wait();
  EXPECT_EQ(outcome.status, 1);
  EXPECT_EQ(outcome.err.find("killed"), std::string::npos) << outcome.err;
  EXPECT_TRUE(fs::exists(scratch / "run/summary.json"));
}

TEST_F(Endings, AnEndlessLoopFailsItsRobotAlone) {
  write(scratch / "hangs.c",
        "#include <kilolib.h>\nvoid setup(void) {}\nvoid loop(void) { if (kilo_uid == 3 && kilo_ticks > 30) for "
        "(;;) {} }\n"
        "int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }\n");
  for (const std::string mode : {"local", "federated"}) {
    fs::remove_all(scratch / "run");
    Words words = long_run({"--mode", mode, "--behaviour", scratch / "hangs.c"});
    words[4] = "3";
    words[6] = "max";
    EXPECT_EQ(Process(words, scratch.path()).wait(60).status, 0);
    EXPECT_EQ(recorder::read_summary(scratch / "run/summary.json").robots_failed, 1u);
    expect_nothing_left();
  }
}

TEST_F(Endings, AServiceStartedTwiceLeavesTheRunAlone) {
  const OwnDomain domain;
  Process process(long_run({"--domain", domain.name}), scratch.path());
  ASSERT_TRUE(recorded(5));
  const Outcome second = kilotwin({"service", "comm", "--run", scratch / "run", "--domain", domain.name}, scratch);
  EXPECT_EQ(second.status, 2);
  EXPECT_NE(second.err.find("was started already"), std::string::npos) << second.err;
  EXPECT_TRUE(process.running());
  process.signal(SIGINT);
  EXPECT_NE(process.wait().err.find("interrupted"), std::string::npos);
  expect_usable_recording();
}

TEST_F(Endings, TheFirstSampleOfASecondProcessIsNotCounted) {
  const OwnDomain domain;
  const dds::Participant& participant = domain.participant;
  Process process(long_run({"--domain", domain.name}), scratch.path());
  std::atomic<std::uint64_t> run{0};
  std::atomic<std::int64_t> tick{0};
  const dds::Reader<PublicRunStatus> status(participant, topics::run_status(),
                                            [&](const PublicRunStatus& sample, dds::SampleState state) {
                                              if (!state.valid) return;
                                              run = sample.run;
                                              tick = sample.tick;
                                            });
  ASSERT_TRUE(eventually([&] { return tick > 40; })) << "beyond a first sample of the radio's metrics";
  // A process that begins as the radio writes this before it hears that the radio is there.
  dds::Writer<WireMetrics> metrics(participant, topics::metrics());
  ASSERT_TRUE(eventually([&] { return metrics.readers() > 0; }));
  WireMetrics first{};
  first.publisher = 2;
  first.run = run;
  metrics.write(first);
  ASSERT_TRUE(metrics.flush(10));
  const std::int64_t written = tick;
  ASSERT_TRUE(eventually([&] { return tick > written + 64; }));
  process.signal(SIGINT);
  EXPECT_NE(process.wait().err.find("interrupted"), std::string::npos);
  expect_usable_recording();
}

TEST_F(Endings, AFullDiskIsReportedInOneLine) {
  // A limit on file sizes makes writing fail as a full disk does. The program is compiled before the limit applies.
  ASSERT_EQ(kilotwin({"build", source("behaviours/disperse.c"), "-o", scratch / "warm.so"}, scratch).status, 0);
  Words words = long_run({"--quiet", "--set", "recording.every_s=0.04"});
  words[6] = "max";
  words.insert(words.begin(), {"/bin/sh", "-c", "trap '' XFSZ; ulimit -f 8192; exec \"$@\"", "sh"});
  const Outcome outcome = Process(words, scratch.path()).wait(60);
  EXPECT_EQ(outcome.status, 1);
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  EXPECT_NE(outcome.err.find("recording.ktrec: cannot be written: File too large"), std::string::npos)
      << outcome.err;
  expect_nothing_left();
}

TEST_F(Endings, AnInterruptEndsALocalRunInOrder) {
  Process process(long_run({"--mode", "local"}), scratch.path());
  ASSERT_TRUE(recorded(5));
  process.signal(SIGINT);
  EXPECT_EQ(process.wait().status, 1);
  EXPECT_TRUE(fs::exists(scratch / "run/summary.json"));
  expect_usable_recording();
}

TEST_F(Endings, AKilledLauncherEndsItsServices) {
  Process process(long_run(), scratch.path());
  ASSERT_TRUE(recorded(5));
  process.signal(SIGKILL);
  process.wait();
  expect_nothing_left();
  expect_usable_recording();
}

TEST_F(Endings, AKilledServiceIsReportedInOneLine) {
  for (const std::string victim : {"physics", "comm", "behaviours", "station"}) {
    fs::remove_all(scratch / "run");
    Process process(long_run(), scratch.path());
    ASSERT_TRUE(recorded(5));
    const pid_t id = service(victim);
    ASSERT_GT(id, 0) << victim;
    kill(id, SIGKILL);
    EXPECT_TRUE(process.says("killed", 30));
    const Outcome outcome = process.wait();
    EXPECT_EQ(outcome.status, 1);
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 2)
        << "the domain, then the end: " << outcome.err;
    EXPECT_NE(outcome.err.find(victim == "comm" ? "radio" : victim), std::string::npos) << outcome.err;
    EXPECT_NE(outcome.err.find("killed"), std::string::npos) << outcome.err;
    expect_nothing_left();
    expect_usable_recording();
  }
}

TEST_F(Endings, AStoppedServiceIsReported) {
  Process process(long_run(), scratch.path());
  ASSERT_TRUE(recorded(5));
  const pid_t id = service("comm");
  ASSERT_GT(id, 0);
  kill(id, SIGSTOP);
  EXPECT_TRUE(process.says("radio was lost", 30));
  const Outcome outcome = process.wait(30);
  EXPECT_EQ(outcome.status, 1);
  EXPECT_NE(outcome.err.find("radio was lost"), std::string::npos) << outcome.err;
  expect_nothing_left();
  expect_usable_recording();
}

TEST_F(Endings, ServiceLogsHaveTimeStampsFederatesAndLevels) {
  write(
      scratch / "faults.c",
      "#include <kilolib.h>\nvoid setup(void) {}\nvoid loop(void) { if (kilo_uid == 3) *(volatile int *)0 = 1; }\n"
      "int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }\n");
  run({source("experiments/disperse.txtpb"), "--robots", "4", "--duration", "1", "--partitions", "1x1", "--hosts",
       "1", "--behaviour", scratch / "faults.c"},
      scratch, "run");
  const std::string log = read(scratch / "run/logs/behaviours-1-1.log");
  EXPECT_TRUE(std::regex_search(
      log, std::regex(
               R"(^\[\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z\] \[behaviours 1/1\] \[info\] starts: run disperse)")))
      << log;
  EXPECT_NE(log.find("Z] [behaviours 1/1] [info] robot 3 failed"), std::string::npos) << log;
}

TEST_F(Endings, TooFewOpenFilesAreNamedBeforeTheRunStarts) {
  Words words = long_run();
  words.insert(words.begin(), {"/bin/sh", "-c", "ulimit -n 16; exec \"$@\"", "sh"});
  const Outcome outcome = Process(words, scratch.path()).wait(60);
  EXPECT_EQ(outcome.status, 1);
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  EXPECT_NE(outcome.err.find("open files at a time, and the limit is 16; raise it with: ulimit -n"),
            std::string::npos)
      << outcome.err;
  EXPECT_FALSE(fs::exists(scratch / "run"));
}

TEST_F(Endings, ALowLimitOfOpenFilesIsRaisedWhereTheSystemAllows) {
  Words words = long_run({"--quiet"});
  words[4] = "1";
  words[6] = "max";
  words.insert(words.begin(), {"/bin/sh", "-c", "ulimit -S -n 16; exec \"$@\"", "sh"});
  const Outcome outcome = Process(words, scratch.path()).wait(60);
  EXPECT_EQ(outcome.status, 0) << outcome.err;
}

TEST_F(Endings, AServiceThatMeetsNobodyGivesUpWhereItIsTold) {
  ASSERT_EQ(kilotwin({"run", source("experiments/disperse.txtpb"), "--prepare", "--out", scratch / "run"}, scratch)
                .status,
            0);
  const OwnDomain domain;
  const Outcome outcome = kilotwin(
      {"service", "comm", "--run", scratch / "run", "--domain", domain.name, "--give-up-after", "1"}, scratch);
  EXPECT_EQ(outcome.status, 1);
  EXPECT_NE(outcome.err.find("radio gave up after it had waited"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("services were heard on DDS domain " + domain.name), std::string::npos) << outcome.err;
}

}  // namespace
}  // namespace kilotwin::test
