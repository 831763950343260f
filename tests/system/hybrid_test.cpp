// Hybrid runs: simulated robots among tracked ones, which a synthetic tracker plays over the public topic.
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <csignal>
#include <fstream>
#include <mutex>
#include <nlohmann/json.hpp>
#include <set>
#include <thread>

#include "clients/recorder/reader.hpp"
#include "core/federation/topics.hpp"
#include "tests/system/own_domain.hpp"
#include "tests/system/program.hpp"
#include "tests/system/synthetic_tracker.hpp"

namespace kilotwin::test {
namespace {

using Json = nlohmann::json;

constexpr std::uint32_t kFirst = 6;  // ids 0..5 are simulated

/// Three robots on one circle. Robot 8 is seen from the second second on, robot 7 no more after the fourth.
std::vector<CirclingRobot> three_robots(double radius_mm) {
  std::vector<CirclingRobot> robots;
  for (std::uint32_t n = 0; n < 3; ++n) {
    CirclingRobot& robot = robots.emplace_back();
    robot.robot = kFirst + n;
    robot.radius_mm = radius_mm;
    robot.phase_rad = 2.1 * n;
    robot.led = static_cast<std::uint8_t>(n + 1);
  }
  robots[1].until_s = 4;
  robots[2].from_s = 2;
  return robots;
}

class Hybrid : public testing::Test {
 protected:
  /// Runs `experiment` in real time with a tracker that sees from the start; returns its summary.
  Json run(const std::string& experiment, const Words& more) {
    SyntheticTracker tracker(domain_.participant, {}, three_robots(radius_mm_));
    return run(experiment, more, {&tracker});
  }
  Json run(const std::string& experiment, const Words& more, const std::vector<SyntheticTracker*>& trackers) {
    write(scratch_ / "hybrid.txtpb", experiment);
    Words words{program(),    "run",   scratch_ / "hybrid.txtpb", "--pace", "1", "--domain",
                domain_.name, "--out", scratch_ / "run",          "--quiet"};
    words.insert(words.end(), more.begin(), more.end());
    Process process(words, scratch_.path());
    for (SyntheticTracker* const tracker : trackers) {
      EXPECT_TRUE(eventually([&] { return tracker->is_heard(); }));
    }
    for (SyntheticTracker* const tracker : trackers) tracker->start();
    const Outcome outcome = process.wait(60);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    for (SyntheticTracker* const tracker : trackers) tracker->stop();
    return Json::parse(read(scratch_ / "run/summary.json"));
  }

  void verify(const Words& more = {}) {
    Words words{"replay", scratch_ / "run", "--verify"};
    words.insert(words.end(), more.begin(), more.end());
    const Outcome outcome = kilotwin(words, scratch_);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
  }

  Scratch scratch_;
  const OwnDomain domain_;
  double radius_mm_ = 100;
};

std::string experiment(const std::string& more = {}) {
  return "arena { width_mm: 600 height_mm: 600 } recording { every_s: 0.2 }\n"
         "tracker { source: \"ceiling\" }\n"
         "robots { count: 6 behaviour: \"" +
         source("behaviours/disperse.c") +
         "\" layout { grid { pitch_mm: 50 } } }\n"
         "robots { count: 3 body: TRACKED layout { x_mm: 230 y_mm: 230 grid { pitch_mm: 40 } } }\n" +
         more;
}

TEST_F(Hybrid, SamplesAreFollowedRecordedAndReplayedOnAnyGrid) {
  const Json summary =
      run(experiment("tracking { start: WHEN_SEEN }"), {"--duration", "6", "--partitions", "2x1", "--hosts", "2"});
  const Json& tracking = summary.at("tracking");
  EXPECT_EQ(tracking.at("joined"), 3);
  EXPECT_EQ(tracking.at("lost"), 1);
  EXPECT_EQ(tracking.at("left"), 0);
  const Json& tracker = tracking.at("trackers").at(0);
  EXPECT_EQ(tracker.at("source"), "ceiling");
  EXPECT_GT(tracker.at("frames"), 150);
  EXPECT_EQ(tracker.at("restarts"), 0);
  EXPECT_NEAR(tracker.at("exposure_to_sent_ms").at("p50").get<double>(), SyntheticTracker::kExposureToSent_s * 1e3,
              0.5);
  const Json& effect = tracking.at("arrival_to_effect_ms");
  EXPECT_GT(effect.at("p99").get<double>(), 0);
  for (const std::string part :
       {"exposure_to_effect_ms", "arrival_to_effect_ms", "arrival_to_publication_ms", "publication_to_effect_ms"}) {
    const double p50_ms = tracking.at(part).at("p50"), p99_ms = tracking.at(part).at("p99");
    EXPECT_LE(p50_ms, p99_ms);
    RecordProperty(part + "_p50", std::to_string(p50_ms));
    RecordProperty(part + "_p99", std::to_string(p99_ms));
    std::printf("[ measured ] %s: p50 %.1f, p99 %.1f\n", part.c_str(), p50_ms, p99_ms);
  }
  EXPECT_GE(tracking.at("exposure_to_effect_ms").at("p50").get<double>(),
            effect.at("p50").get<double>() + SyntheticTracker::kExposureToSent_s * 1e3 / 2)
      << "the tracker's own delay comes on top";
  EXPECT_TRUE(summary.contains("late_ticks"));
  EXPECT_EQ(summary.at("messages_per_robot").at("sent").at("least"), 0)
      << "nothing is declared: real robots are silent";

  // Robots are where the circles are, the one that is lost is absent, LEDs are those that were seen.
  recorder::Reader reader(scratch_ / "run/recording.ktrec");
  double radius_mm = 0;
  int states = 0;
  std::string life_cycles, leds;
  std::set<char> first_life_cycles;
  while (const proto::StateRecord* state = reader.next_state()) {
    life_cycles = state->life_cycle();
    leds = state->led();
    if (states++ == 0) first_life_cycles = {life_cycles[kFirst], life_cycles[kFirst + 1], life_cycles[kFirst + 2]};
    radius_mm = std::hypot(state->x_mm(kFirst), state->y_mm(kFirst));
  }
  constexpr char kAbsent = '\xfd';
  EXPECT_EQ(first_life_cycles, std::set{kAbsent});
  EXPECT_NEAR(radius_mm, 100, 2);
  EXPECT_NE(life_cycles[kFirst], kAbsent);
  EXPECT_EQ(life_cycles[kFirst + 1], kAbsent);
  EXPECT_NE(life_cycles[kFirst + 2], kAbsent);
  EXPECT_EQ(leds[kFirst], 1);
  EXPECT_EQ(leds[kFirst + 1], 0);
  EXPECT_EQ(leds[kFirst + 2], 3);

  verify({"--partitions", "2x2"});
  verify({"--partitions", "1x1"});
}

/// Two cameras with clocks and coordinates of their own. One sees robot 6 as the other does, and takes robot 7 over from it.
TEST_F(Hybrid, TwoTrackersShareTheRobots) {
  std::vector<CirclingRobot> of_ceiling = three_robots(100), of_wall = of_ceiling;
  of_ceiling.pop_back();
  of_ceiling[1].until_s = 3;
  of_wall[1].from_s = 2.7;
  of_wall[1].until_s = of_wall[0].until_s;
  of_wall[2].from_s = 0;
  const TrackerKind wall{"wall", -5, 50, -20, 1.5707963267948966};
  SyntheticTracker first(domain_.participant, {}, of_ceiling), second(domain_.participant, wall, of_wall);
  const Json summary = run(
      experiment("tracker { source: \"wall\" x_mm: 50 y_mm: -20 heading_deg: 90 } tracking { start: WHEN_SEEN }"),
      {"--duration", "6"}, {&first, &second});
  const Json& tracking = summary.at("tracking");
  EXPECT_EQ(tracking.at("joined"), 3);
  EXPECT_EQ(tracking.at("lost"), 0) << "robot 7 was handed over";
  EXPECT_EQ(tracking.at("jumps"), 0);
  ASSERT_EQ(tracking.at("trackers").size(), 2u);
  for (const Json& tracker : tracking.at("trackers")) {
    EXPECT_GT(tracker.at("frames"), 150) << tracker.dump();
    EXPECT_EQ(tracker.at("restarts"), 0) << tracker.dump();
  }
  recorder::Reader reader(scratch_ / "run/recording.ktrec");
  std::array<double, 3> radius_mm{};
  while (const proto::StateRecord* state = reader.next_state()) {
    for (std::size_t n = 0; n < radius_mm.size(); ++n) {
      const auto robot = static_cast<int>(kFirst + n);
      radius_mm[n] = std::hypot(state->x_mm(robot), state->y_mm(robot));
    }
  }
  for (const double radius : radius_mm) EXPECT_NEAR(radius, 100, 2);
  verify();
}

/// Messages that `receiver` got from `sender`, of a run that counted them.
int messages_between(const Scratch& scratch, std::uint32_t receiver, std::uint32_t sender) {
  const Outcome outcome = kilotwin({"export", scratch / "run", "--messages", "-"}, scratch);
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  const std::string row = "\n" + std::to_string(receiver) + "," + std::to_string(sender) + ",";
  const std::size_t at = outcome.out.find(row);
  return at == std::string::npos ? 0 : std::stoi(outcome.out.substr(at + row.size()));
}

TEST_F(Hybrid, RealAndSimulatedRobotsHearEachOther) {
  // Robot 6 says what a listener hears of it, robot 7 what a rule has for it, robot 8 what its shadow says. The three are within
  // range of each other. Robot 7 hears simulated robots through the station.
  radius_mm_ = 45;
  const std::string disperse = source("behaviours/disperse.c");
  const std::string text =
      "arena { width_mm: 600 height_mm: 600 } recording { every_s: 0.2 messages: true } tracker { source: "
      "\"ceiling\" }\n"
      "robots { count: 6 behaviour: \"" +
      disperse +
      "\" layout { y_mm: 115 grid { pitch_mm: 40 } } }\n"
      "robots { count: 1 body: TRACKED layout { x_mm: 200 y_mm: -200 grid {} } says { heard: true } }\n"
      "robots { count: 1 body: TRACKED layout { x_mm: 150 y_mm: -200 grid {} } says { rule { data: [1] } }\n"
      "  hears_simulated { range_mm: 250 type: 9 data: SENDER } }\n"
      "robots { count: 1 body: TRACKED layout { x_mm: 100 y_mm: -200 grid {} } says { shadow: true } behaviour: "
      "\"" +
      disperse +
      "\" }\n"
      "door { name: \"ears\" robots { first_number: 6 } listener { line: \"rx {type} {data}\" id_octet: 0 } }\n"
      "station { robot_interval_s: 0.3 }\n";
  write(scratch_ / "hybrid.txtpb", text);
  write(scratch_ / "line.txt", "Kilobot 25 listens\n");
  std::mutex mutex;
  std::vector<double> told_s;
  const dds::Reader<PublicStationPacket> packets(
      domain_.participant, topics::station_packets(),
      [&](const PublicStationPacket& packet, dds::SampleState state) {
        if (!state.valid || packet.command != 2 || packet.message[9] != 0) return;
        // The first of the three slots: 10 bits of id, 4 of type, 10 of data.
        const int id = packet.message[0] << 2 | packet.message[1] >> 6, type = packet.message[1] >> 2 & 15;
        const std::lock_guard lock(mutex);
        if (id == 7 && type == 9 && packet.message[2] < 6) told_s.push_back(packet.time_s);
      });
  const Scratch of_listener;
  Process listener(
      {program(), "listen", scratch_ / "hybrid.txtpb", scratch_ / "line.txt", "--domain", domain_.name},
      of_listener.path());
  EXPECT_TRUE(listener.says("listens to", 30));
  std::jthread talker([this](const std::stop_token& stop) {
    std::mutex mutex_of_sleep;
    std::condition_variable_any wake;
    for (int n = 0; !stop.stop_requested(); ++n) {
      std::ofstream(scratch_ / "line.txt", std::ios::app) << "rx 0 6 " << n % 256 << "\n";
      std::unique_lock lock(mutex_of_sleep);
      wake.wait_for(lock, stop, std::chrono::milliseconds(250), [] { return false; });
    }
  });
  const Json summary = run(text, {"--duration", "4", "--partitions", "2x1", "--hosts", "2"});
  talker.request_stop();
  listener.signal(SIGINT);
  const Outcome outcome = listener.wait(30);
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("1 other lines (the first: \"Kilobot 25 listens\")"), std::string::npos)
      << outcome.err;

  EXPECT_GE(summary.at("tracking").at("heard_messages").get<int>(), 5);
  for (const std::uint32_t robot : {6u, 7u, 8u}) EXPECT_GE(messages_between(scratch_, robot, robot), 3) << "sent";
  EXPECT_EQ(summary.at("robots_failed"), 0);
  EXPECT_GT(messages_between(scratch_, 8, 6), 0) << "a shadow hears what a listener heard of another robot";
  EXPECT_GT(messages_between(scratch_, 8, 7), 0) << "and what a rule has for another robot";
  EXPECT_EQ(messages_between(scratch_, 7, 8), 0) << "without a shadow nobody listens here";
  {
    const std::lock_guard lock(mutex);
    ASSERT_GE(told_s.size(), 2u);
    for (std::size_t n = 1; n < told_s.size(); ++n) EXPECT_GE(told_s[n] - told_s[n - 1], 0.3 - 1e-6);
  }
  verify({"--partitions", "2x2"});
  verify({"--partitions", "1x1"});
}

TEST_F(Hybrid, ARunThatFallsBehindItsPaceEndsWithStatus1) {
  write(scratch_ / "late.txtpb", experiment());
  Process process({program(), "run", scratch_ / "late.txtpb", "--pace", "1", "--max-lateness", "300", "--domain",
                   domain_.name, "--out", scratch_ / "run"},
                  scratch_.path());
  std::atomic<std::int64_t> tick{0};
  const dds::Reader<PublicRunStatus> status(domain_.participant, topics::run_status(),
                                            [&](const PublicRunStatus& sample, dds::SampleState state) {
                                              if (state.valid) tick = sample.tick;
                                            });
  ASSERT_TRUE(eventually([&] { return tick > 10; }));
  std::vector<pid_t> hosts = processes_with(scratch_ / "run");
  std::erase_if(hosts, [](pid_t id) {
    return read("/proc/" + std::to_string(id) + "/cmdline").find("behaviours") == std::string::npos;
  });
  ASSERT_EQ(hosts.size(), 1u);
  for (const pid_t host : hosts) kill(host, SIGSTOP);
  std::this_thread::sleep_for(std::chrono::milliseconds(800));
  for (const pid_t host : hosts) kill(host, SIGCONT);
  const Outcome outcome = process.wait(60);
  EXPECT_EQ(outcome.status, 1);
  EXPECT_NE(outcome.err.find("behind the pace"), std::string::npos) << outcome.err;
}

}  // namespace
}  // namespace kilotwin::test
