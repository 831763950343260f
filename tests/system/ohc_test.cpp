// `kilotwin ohc` among a run, a station program on its port, and a physical controller played by a pseudo-terminal.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <termios.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <filesystem>
#include <memory>
#include <optional>
#include <random>
#include <thread>

#include "clients/ohc/line_clock.hpp"
#include "clients/ohc/pseudo_terminal.hpp"
#include "clients/ohc/serial_packet.hpp"
#include "clients/ohc/serial_port.hpp"
#include "clients/recorder/reader.hpp"
#include "core/federation/topics.hpp"
#include "tests/system/own_domain.hpp"
#include "tests/system/program.hpp"

namespace kilotwin::test {
namespace {

namespace fs = std::filesystem;

class Ohc : public testing::Test {
 protected:
  std::unique_ptr<Process> start_ohc(const Words& where) {
    Words words{program(), "ohc", "--domain", domain_.name};
    words.insert(words.end(), where.begin(), where.end());
    return std::make_unique<Process>(words, ohc_scratch_.path());
  }
  std::unique_ptr<Process> start_run(const Words& more = {}) {
    Words words{program(),
                "run",
                source("experiments/disperse.txtpb"),
                "--robots",
                "20",
                "--duration",
                "600",
                "--pace",
                "1",
                "--quiet",
                "--domain",
                domain_.name,
                "--out",
                scratch_ / "run"};
    words.insert(words.end(), more.begin(), more.end());
    return std::make_unique<Process>(words, scratch_.path());
  }
  [[nodiscard]] bool life_cycles_become(char state) const {
    const std::string wanted(20, state);
    std::string last;
    try {
      recorder::Reader reader(scratch_ / "run/recording.ktrec");
      while (const proto::StateRecord* record = reader.next_state()) last = record->life_cycle();
    } catch (const std::exception&) {
      return false;  // not written yet
    }
    return last == wanted;
  }

  Scratch scratch_, ohc_scratch_;
  const OwnDomain domain_;
};

constexpr std::uint8_t kWakeup = 0x85, kReadUid = 0x89;
const OverheadPacket kRunPacket{OverheadCommand::kRepeat, {0, 0, 0, 0, 0, 0, 0, 0, 0, 0x88}};
const OverheadPacket kStopPacket{};
constexpr char kIdle = 1, kRunning = 4;  // kilolib's states

TEST_F(Ohc, AStationProgramCommandsTheRobotsOfARun) {
  const fs::path link = scratch_.path() / "ttyUSB0";
  auto ohc = start_ohc({"--pty", link.string()});
  ASSERT_TRUE(ohc->says("waiting for a run", 30));
  ASSERT_TRUE(fs::is_symlink(link));
  const auto run = start_run();
  ASSERT_TRUE(ohc->says("run disperse", 60));
  ASSERT_TRUE(eventually([&] { return life_cycles_become(kRunning); }, 60));

  // Noise, a cut packet, a packet with a wrong checksum, then WAKEUP again and again, each time by a program that opens the
  // port anew.
  const int port = open(link.c_str(), O_RDWR | O_NOCTTY);
  ASSERT_GE(port, 0);
  std::mt19937 random(1);
  std::vector<std::uint8_t> noise(500);
  for (std::uint8_t& octet : noise) octet = static_cast<std::uint8_t>(random());
  ohc::SerialPacket wrong = ohc::encode({OverheadCommand::kRepeat, {0, 0, 0, 0, 0, 0, 0, 0, 0, 0x83}});
  noise.insert(noise.end(), wrong.begin(), wrong.begin() + 60);
  wrong[7] ^= 4;
  noise.insert(noise.end(), wrong.begin(), wrong.end());
  ASSERT_EQ(::write(port, noise.data(), noise.size()), static_cast<ssize_t>(noise.size()));
  close(port);
  const OverheadPacket wakeup{OverheadCommand::kRepeat, {0, 0, 0, 0, 0, 0, 0, 0, 0, kWakeup}};
  EXPECT_TRUE(eventually(
      [&] {
        ohc::SerialPort serial(link);
        EXPECT_EQ(serial.open(), "");
        EXPECT_TRUE(serial.send(wakeup));
        return life_cycles_become(kIdle);
      },
      90));
  // While it sends a page, it is deaf.
  std::atomic<bool> hears_again{false};
  const dds::Participant& participant = domain_.participant;
  const dds::Reader<PublicOverheadPacket> packets(participant, topics::overhead_packets(),
                                                  [&](const PublicOverheadPacket& packet, dds::SampleState state) {
                                                    if (state.valid && packet.message[9] == kReadUid)
                                                      hears_again = true;
                                                  });
  ohc::SerialPort serial(link);
  ASSERT_EQ(serial.open(), "");
  OverheadPacket page;
  page.command = OverheadCommand::kBootPage;
  EXPECT_TRUE(serial.send(page) && serial.send(kStopPacket));
  EXPECT_TRUE(eventually([&] {
    std::this_thread::sleep_for(std::chrono::duration<double>(ohc::kPage_s));
    return serial.send({OverheadCommand::kOnce, {0, 0, 0, 0, 0, 0, 0, 0, 0, kReadUid}}) && hears_again;
  }));
  ohc->signal(SIGTERM);
  const Outcome outcome = ohc->wait(30);
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_FALSE(fs::is_symlink(link)) << "the link goes with it";
  EXPECT_NE(outcome.out.find("WAKEUP, repeated"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("pages of a program"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.err.find("1 page"), std::string::npos) << outcome.err;
  EXPECT_EQ(outcome.err.find(" stop"), std::string::npos) << outcome.err;
  EXPECT_EQ(outcome.out.find("RESET"), std::string::npos) << "wrong and cut packets count for nothing";
  EXPECT_NE(outcome.err.find(" wrong checksums"), std::string::npos) << outcome.err;
  run->signal(SIGINT);
  run->wait(60);
  EXPECT_EQ(kilotwin({"replay", scratch_ / "run", "--verify"}, scratch_).status, 0);
}

TEST_F(Ohc, TheLinkGoesWithAKilledController) {
  const fs::path link = scratch_.path() / "port";
  auto ohc = start_ohc({"--pty", link.string()});
  ASSERT_TRUE(ohc->says("virtual overhead controller", 30));
  EXPECT_TRUE(fs::is_symlink(link));
  const Outcome second = kilotwin({"ohc", "--pty", link.string(), "--domain", domain_.name}, scratch_);
  EXPECT_EQ(second.status, 2);
  EXPECT_NE(second.err.find("exists"), std::string::npos) << second.err;
  EXPECT_TRUE(fs::is_symlink(link));
  ohc->signal(SIGKILL);
  ohc->wait(30);
  EXPECT_TRUE(eventually([&] { return !fs::is_symlink(link); }));
}

TEST_F(Ohc, BadArgumentsAreRefused) {
  EXPECT_EQ(kilotwin({"ohc"}, scratch_).status, 2);
  EXPECT_EQ(kilotwin({"ohc", "--pty", "a", "--serial", "b"}, scratch_).status, 2);
  const Outcome missing = kilotwin({"ohc", "--serial", "/nonexistent", "--domain", "3"}, scratch_);
  EXPECT_EQ(missing.status, 2);
  EXPECT_NE(missing.err.find("/nonexistent: cannot be opened"), std::string::npos) << missing.err;
}

/// Packets as the physical controller would take them, at the speed of its line.
class Controller {
 public:
  [[nodiscard]] const std::string& port() const { return terminal_.path(); }
  /// Whether such a packet arrives within a bound against hanging.
  [[nodiscard]] bool gets(const OverheadPacket& wanted) {
    return eventually([&] { return next() == wanted; }, 60);
  }
  /// Reads until nothing comes for a second; the last packet of all.
  [[nodiscard]] OverheadPacket last() {
    for (double quiet_s = now_s(); now_s() < quiet_s + 1;) {
      if (next()) quiet_s = now_s();
    }
    return last_;
  }
  /// The next packet, if one comes within a moment.
  std::optional<OverheadPacket> next() {
    constexpr double kMoment_s = 0.005;
    terminal_.hold_back(!line_.idle());
    take(kMoment_s);
    terminal_.hold_back(true);
    while (const auto octet = line_.take(now_s())) {
      if (const auto packet = decoder_.take(octet->value)) return last_ = *packet;
    }
    return std::nullopt;
  }
  /// Packets that the port has taken and the line has not carried yet. An adapter has none: tcdrain() waits for it, but not for a
  /// pseudo-terminal.
  [[nodiscard]] std::uint64_t backlog() {
    constexpr double kMoment_s = 0.05;
    terminal_.hold_back(true);
    while (take(kMoment_s)) {}
    return (taken_ - counters().octets + ohc::kSerialPacket - 1) / ohc::kSerialPacket;
  }
  [[nodiscard]] const ohc::PacketDecoder::Counters& counters() const { return decoder_.counters(); }

 private:
  bool take(double wait_s) {
    const std::vector<std::uint8_t> octets = terminal_.read(wait_s);
    line_.put(octets, now_s());
    taken_ += octets.size();
    return !octets.empty();
  }

  ohc::PseudoTerminal terminal_;
  ohc::LineClock line_;
  ohc::PacketDecoder decoder_;
  OverheadPacket last_{OverheadCommand::kOnce, {}};
  std::uint64_t taken_ = 0;  ///< octets
};

TEST_F(Ohc, APhysicalControllerDoesAsTheStationDoesAndStopsAtEveryEnding) {
  Controller controller;
  for (const int signal : {SIGTERM, SIGKILL}) {
    auto ohc = start_ohc({"--serial", controller.port()});
    ASSERT_TRUE(ohc->says("waiting for a run", 30));
    const auto run = start_run({"--force"});
    EXPECT_TRUE(controller.gets(kRunPacket)) << "the station starts the robots";
    EXPECT_TRUE(controller.gets(kStopPacket)) << "and frees the air";
    const dds::Participant& participant = domain_.participant;
    dds::Writer<PublicOverheadPacket> packets(participant, topics::overhead_packets());
    ASSERT_TRUE(eventually([&] { return packets.readers() > 0; }));
    PublicOverheadPacket page{};
    std::string("test").copy(page.client, sizeof page.client - 1);
    page.request = static_cast<std::uint32_t>(signal);
    page.command = 4;
    page.message[0] = 12;
    page.rest[118] = 99;
    packets.write(page);
    OverheadPacket expected;
    expected.command = OverheadCommand::kBootPage;
    expected.message[0] = 12;
    expected.rest[118] = 99;
    EXPECT_TRUE(controller.gets(expected)) << "external input too";
    ++page.request;
    page.command = 2;
    page.message[9] = kWakeup;
    page.rest[118] = 0;
    packets.write(page);
    EXPECT_TRUE(controller.gets({OverheadCommand::kRepeat, {12, 0, 0, 0, 0, 0, 0, 0, 0, kWakeup}}));
    ohc->signal(signal);
    EXPECT_TRUE(controller.gets(kStopPacket)) << signal;
    EXPECT_EQ(controller.last(), kStopPacket);
    EXPECT_EQ(ohc->wait(30).status, signal == SIGTERM ? 0 : 128 + SIGKILL);
    run->signal(SIGINT);
    run->wait(60);
  }
  EXPECT_EQ(controller.counters().bad_checksums, 0u);
}

/// DDS gives a process up after its lease of 30 s only; robots would follow their last command for so long. That STOP is on the
/// line within 2 s is held by the test StopRule, on a clock of its own.
TEST_F(Ohc, APhysicalControllerStopsWhenTheStationIsKilled) {
  Controller controller;
  auto ohc = start_ohc({"--serial", controller.port()});
  ASSERT_TRUE(ohc->says("waiting for a run", 30));
  const auto run = start_run();
  ASSERT_TRUE(controller.gets(kStopPacket)) << "after RUN";
  ASSERT_TRUE(ohc->says("run disperse", 30));
  const dds::Participant& participant = domain_.participant;
  dds::Writer<PublicOverheadPacket> packets(participant, topics::overhead_packets());
  ASSERT_TRUE(eventually([&] { return packets.readers() > 0; }));
  PublicOverheadPacket wakeup{};
  std::string("test").copy(wakeup.client, sizeof wakeup.client - 1);
  wakeup.request = 1;
  wakeup.command = 2;
  wakeup.message[9] = kWakeup;
  packets.write(wakeup);
  ASSERT_TRUE(controller.gets({OverheadCommand::kRepeat, {0, 0, 0, 0, 0, 0, 0, 0, 0, kWakeup}}));
  // The launcher first, so that nobody ends the run in order or starts a new station.
  std::vector<pid_t> processes = processes_with(scratch_ / "run");
  ASSERT_GT(processes.size(), 1u);
  for (const pid_t process : processes) kill(process, SIGSTOP);
  for (const pid_t process : processes) kill(process, SIGKILL);
  const std::uint64_t before = controller.counters().packets;
  EXPECT_TRUE(controller.gets(kStopPacket));
  // A controller that has just been plugged in gets the last packet twice.
  EXPECT_LE(controller.counters().packets - before, 2u) << "nothing else comes before it";
  EXPECT_TRUE(ohc->says("no status of the run for 1 s", 60));
  EXPECT_EQ(controller.last(), kStopPacket);
}

/// The plugin computes until the test lets it go; the controller meanwhile has to see that the station lives.
TEST_F(Ohc, AStationShowsThatItLivesWhileAPluginComputes) {
  write(scratch_ / "slow.cpp",
        "#include <kilotwin_station.hpp>\n#include <unistd.h>\n"
        "struct Slow : KilobotExperiment {\n  void initialise(bool) override {}\n"
        "  void run() override { if (time > 1) while (access(\"" +
            (scratch_ / "go") +
            "\", F_OK) != 0) usleep(10000); }\n};\nextern \"C\" KilobotExperiment* createExpt() { return new Slow; "
            "}\n");
  write(scratch_ / "slow.txtpb", "duration_s: 3 robots { count: 4 behaviour: \"" + source("behaviours/disperse.c") +
                                     "\" layout { grid { } } } station { environment { plugin { source: "
                                     "\"slow.cpp\" } } }");
  std::atomic<int> statuses{0};
  const dds::Participant& participant = domain_.participant;
  const dds::Reader<PublicRunStatus> reader(participant, topics::run_status(),
                                            [&](const PublicRunStatus& status, dds::SampleState state) {
                                              const std::string_view note = status.note;
                                              if (state.valid && note.find("plugin slow.cpp") != note.npos)
                                                ++statuses;
                                            });
  Process run(
      {program(), "run", scratch_ / "slow.txtpb", "--quiet", "--domain", domain_.name, "--out", scratch_ / "run"},
      scratch_.path());
  ASSERT_TRUE(eventually([&] { return statuses >= 1; }, 120));
  EXPECT_TRUE(eventually([&] { return statuses >= 5; }, 30)) << "the plugin is given up after 60 s";
  write(scratch_ / "go", "go");
  const Outcome outcome = run.wait(60);
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(outcome.err.find("did not return"), std::string::npos) << outcome.err;
}

/// Without a least interval the station sends 96 packets per second, and the line takes 29.
TEST_F(Ohc, AStopIsPromptOnALineThatTheStationOverloads) {
  write(scratch_ / "busy.txtpb", "duration_s: 600 robots { count: 100 behaviour: \"" +
                                     source("behaviours/disperse.c") +
                                     "\" layout { grid { pitch_mm: 40 } } } station { packet_interval_s: 0 "
                                     "robot_interval_s: 0.1 environment { hub { } } }");
  Controller controller;
  auto ohc = start_ohc({"--serial", controller.port()});
  ASSERT_TRUE(ohc->says("waiting for a run", 30));
  Process run({program(), "run", scratch_ / "busy.txtpb", "--pace", "1", "--quiet", "--domain", domain_.name,
               "--out", scratch_ / "run"},
              scratch_.path());
  const auto packets = [&] { return controller.counters().packets; };
  ASSERT_TRUE(eventually([&] { return controller.next() && packets() > 100; }, 60));
  const std::uint64_t before = packets() + controller.backlog();
  ohc->signal(SIGTERM);
  ASSERT_TRUE(controller.gets(kStopPacket));
  constexpr std::uint64_t kPerSecond = 29;
  EXPECT_LE(packets(), before + kPerSecond / 2) << "more than half a second of the line";
  const Outcome outcome = ohc->wait(30);
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(outcome.err.find(", 0 dropped"), std::string::npos) << outcome.err;
  EXPECT_EQ(controller.last(), kStopPacket);
}

}  // namespace
}  // namespace kilotwin::test
