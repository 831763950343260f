// Other programs control a run and observe it over the public topics.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>

#include "clients/recorder/reader.hpp"
#include "core/federation/checkpoint.hpp"
#include "core/federation/topics.hpp"
#include "tests/system/own_domain.hpp"
#include "tests/system/program.hpp"

namespace kilotwin::test {
namespace {

class Control : public testing::Test {
 protected:
  Control()
      : control_(domain_.participant, topics::run_control()),
        overhead_(domain_.participant, topics::overhead_packets()),
        status_(domain_.participant, topics::run_status(),
                [this](const PublicRunStatus& sample, dds::SampleState state) {
                  if (!state.valid) return;
                  const std::lock_guard lock(mutex_);
                  latest_ = sample;
                }) {}

  void start(const Words& more = {}) {
    Words words{program(),      "run",    source("experiments/disperse.txtpb"),
                "--robots",     "20",     "--duration",
                "600",          "--pace", "1",
                "--partitions", "2x1",    "--domain",
                domain_.name,   "--out",  scratch_ / "run"};
    words.insert(words.end(), more.begin(), more.end());
    process_ = std::make_unique<Process>(words, scratch_.path());
    ASSERT_TRUE(eventually([this] {
      return control_.readers() > 0 && overhead_.readers() > 0 && latest().phase == kilotwin_open_RUNNING;
    }));
  }

  PublicRunStatus latest() {
    const std::lock_guard lock(mutex_);
    return latest_;
  }

  void ask(kilotwin_open_RunCommand command, std::uint32_t steps = 0) {
    PublicRunControl sample{};
    std::string("test").copy(sample.client, sizeof sample.client - 1);
    sample.request = ++request_;
    sample.command = command;
    sample.steps = steps;
    control_.write(sample);
    control_.write(sample);  // a repeated sample is one request
  }

  bool paused_at(std::int64_t tick) {
    return eventually([&] { return latest().phase == kilotwin_open_PAUSED && latest().tick == tick; });
  }

  Scratch scratch_;
  const OwnDomain domain_;
  dds::Writer<PublicRunControl> control_;
  dds::Writer<PublicOverheadPacket> overhead_;
  std::mutex mutex_;
  PublicRunStatus latest_{};
  std::uint32_t request_ = 0;
  std::unique_ptr<Process> process_;
  dds::Reader<PublicRunStatus> status_;
};

TEST_F(Control, PausesStepsContinuesAndStops) {
  start();
  ask(kilotwin_open_PAUSE_RUN);
  ASSERT_TRUE(eventually([this] { return latest().phase == kilotwin_open_PAUSED; }));
  const std::int64_t at = latest().tick;
  ask(kilotwin_open_STEP_RUN, 5);
  ASSERT_TRUE(paused_at(at + 5));
  ask(kilotwin_open_STEP_RUN, 1);
  ASSERT_TRUE(paused_at(at + 6));
  ask(kilotwin_open_CHECKPOINT_RUN);
  ask(kilotwin_open_CONTINUE_RUN);
  ASSERT_TRUE(eventually([&] { return latest().tick > at + 20; }));
  ask(kilotwin_open_STOP_RUN);
  const Outcome outcome = process_->wait(30);
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  // The recording holds all requests, and its replay gives the same hashes.
  EXPECT_EQ(kilotwin({"replay", scratch_ / "run", "--verify"}, scratch_).status, 0);
  const auto summary = recorder::read_summary(scratch_.path() / "run/summary.json");
  const auto resumed = run({source("experiments/disperse.txtpb"), "--robots", "20", "--mode", "local", "--resume",
                            scratch_ / "run", "--duration", std::to_string(summary.simulated_s - 1e-6)},
                           scratch_, "resumed");
  EXPECT_EQ(resumed.state_hash, summary.state_hash);
  EXPECT_EQ(resumed.resumed_from_tick, at + 6);
}

TEST_F(Control, APausedRunWithSeveralDisksIsSavedOnceItGoesOn) {
  const std::string domain = domain_.name;
  ASSERT_EQ(kilotwin({"run", source("experiments/disperse.txtpb"), "--robots", "4", "--duration", "600", "--pace",
                      "1", "--partitions", "1x1", "--prepare", "--out", scratch_ / "run"},
                     scratch_)
                .status,
            0);
  std::filesystem::copy(scratch_.path() / "run", scratch_.path() / "other",
                        std::filesystem::copy_options::recursive);
  // Physics has a disk of its own.
  std::vector<std::unique_ptr<Process>> services;
  for (const auto& [service, directory, more] :
       {std::tuple<std::string, std::string, Words>{"physics", "other", {"--partition", "0,0"}},
        {"comm", "run", {}},
        {"behaviours", "run", {"--share", "1/1"}},
        {"station", "run", {}}}) {
    Words words{program(), "service", service, "--run", scratch_ / directory, "--domain", domain};
    words.insert(words.end(), more.begin(), more.end());
    std::filesystem::create_directories(scratch_.path() / ("of-" + service));
    services.push_back(std::make_unique<Process>(words, scratch_.path() / ("of-" + service)));
  }
  ASSERT_TRUE(eventually([this] { return control_.readers() > 0 && latest().phase == kilotwin_open_RUNNING; }));
  ASSERT_EQ(kilotwin({"control", "pause", "--domain", domain}, scratch_).status, 0);
  const Outcome unsure = kilotwin({"control", "checkpoint", "--domain", domain}, scratch_);
  EXPECT_EQ(unsure.status, 1);
  EXPECT_NE(unsure.err.find("did not save its state within 10 s"), std::string::npos) << unsure.err;
  EXPECT_NE(unsure.err.find("counts as saved once it goes on: kilotwin control step 1"), std::string::npos)
      << unsure.err;
  const std::int64_t tick = latest().tick;
  ASSERT_EQ(kilotwin({"control", "step", "1", "--domain", domain}, scratch_).status, 0);
  EXPECT_TRUE(eventually([&] { return latest().saved_tick == tick; }));
  ASSERT_EQ(kilotwin({"control", "stop", "--domain", domain}, scratch_).status, 0);
  for (const auto& service : services) EXPECT_EQ(service->wait(30).status, 0);
}

TEST_F(Control, TheCommandSteersARun) {
  start();
  const std::string domain = domain_.name;
  const auto control = [&](Words words) {
    words.insert(words.begin(), "control");
    words.insert(words.end(), {"--domain", domain, "--json"});
    Outcome outcome = kilotwin(words, scratch_);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    return nlohmann::json::parse(outcome.out);
  };
  const auto paused = control({"pause"});
  EXPECT_EQ(paused.at("phase"), "paused");
  const auto stepped = control({"step", "7"});
  EXPECT_EQ(stepped.at("tick").get<int>(), paused.at("tick").get<int>() + 7);
  EXPECT_EQ(stepped.at("phase"), "paused");
  // Each command returns when its effect is there: a paused run saves where it stands.
  const auto saved_at = [&](const nlohmann::json& status) {
    const Tick tick{status.at("saved_tick").get<std::int64_t>()};
    EXPECT_TRUE(is_complete(checkpoint_directory(scratch_.path() / "run", tick))) << tick.count();
    return tick.count();
  };
  EXPECT_EQ(saved_at(control({"checkpoint"})), stepped.at("tick").get<std::int64_t>());
  const auto running = control({"continue"});
  EXPECT_EQ(running.at("phase"), "running");
  EXPECT_GT(saved_at(control({"checkpoint"})), running.at("tick").get<std::int64_t>());
  EXPECT_EQ(control({"status"}).at("robots"), 20);
  EXPECT_EQ(control({"stop"}).at("phase"), "ended");
  const Outcome outcome = process_->wait(30);
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("kilotwin control status --domain " + domain), std::string::npos) << outcome.err;
  const Outcome none = kilotwin({"control", "pause", "--domain", domain, "--patience", "0.3"}, scratch_);
  EXPECT_EQ(none.status, 1);
  EXPECT_NE(none.err.find("no run on domain " + domain), std::string::npos) << none.err;
  EXPECT_EQ(kilotwin({"control", "step", "--domain", domain}, scratch_).status, 2);
}

TEST_F(Control, ARobotIsPlacedElsewhereAndTheReplayDoesTheSame) {
  start();
  const Words domain{"--domain", domain_.name};
  const auto place = [&](Words words) {
    words.insert(words.begin(), {"control", "place"});
    words.insert(words.end(), domain.begin(), domain.end());
    return kilotwin(words, scratch_);
  };
  const Outcome placed = place({"--robot", "3", "--at", "-600", "580", "--heading", "90"});
  EXPECT_EQ(placed.status, 0) << placed.err;
  const Outcome outside = place({"--robot", "4", "--at", "5000", "0", "--patience", "0.5"});
  EXPECT_EQ(outside.status, 1);
  EXPECT_NE(outside.err.find("robot 4 did not come to stand there"), std::string::npos) << outside.err;
  EXPECT_EQ(place({"--robot", "4"}).status, 2);
  ask(kilotwin_open_STOP_RUN);
  EXPECT_EQ(process_->wait(30).status, 0);
  recorder::Reader reader(scratch_ / "run/recording.ktrec");
  std::vector<proto::InputRecord> inputs;
  bool was_there = false;
  while (const proto::Record* record = reader.next()) {
    if (record->has_input() && record->input().kind() == proto::InputRecord::RELOCATION)
      inputs.push_back(record->input());
    if (record->has_state() && !inputs.empty())
      was_there = was_there || std::hypot(record->state().x_mm(3) + 600, record->state().y_mm(3) - 580) < 30;
  }
  ASSERT_EQ(inputs.size(), 1u);
  EXPECT_EQ(inputs[0].robot(), 3u);
  EXPECT_TRUE(was_there);
  EXPECT_EQ(kilotwin({"replay", scratch_ / "run", "--verify"}, scratch_).status, 0);
}

TEST_F(Control, ExternalOverheadPacketsAreStampedRecordedAndReplayed) {
  start();
  PublicOverheadPacket packet{};
  std::string("test").copy(packet.client, sizeof packet.client - 1);
  packet.request = 1;
  packet.command = 2;
  packet.message[9] = 0x85;  // WAKEUP: every robot goes idle
  overhead_.write(packet);
  const std::int64_t asked_at = latest().tick;
  ASSERT_TRUE(eventually([&] { return latest().tick > asked_at + 60; }));
  ask(kilotwin_open_STOP_RUN);
  EXPECT_EQ(process_->wait(30).status, 0);
  recorder::Reader reader(scratch_ / "run/recording.ktrec");
  int inputs = 0;
  std::string life_cycles;
  while (const proto::Record* record = reader.next()) {
    if (record->has_input() && record->input().kind() == proto::InputRecord::OVERHEAD_INPUT) ++inputs;
    if (record->has_state()) life_cycles = record->state().life_cycle();
  }
  EXPECT_EQ(inputs, 1);
  EXPECT_EQ(life_cycles, std::string(20, '\x01')) << "all idle";
  EXPECT_EQ(kilotwin({"replay", scratch_ / "run", "--verify"}, scratch_).status, 0);
}

TEST_F(Control, MetricsOfAnotherRunEndTheRunInOneLine) {
  dds::Writer<WireMetrics> writer(domain_.participant, topics::metrics());
  start({"--quiet"});
  ASSERT_TRUE(eventually([&] { return writer.readers() > 0; }));
  std::uint64_t part = 1;
  WireMetrics metrics{};
  metrics.run = latest().run;
  metrics.first_tick = 1'000'000'000'000;
  metrics.hash_parts._length = metrics.hash_parts._maximum = 1;
  metrics.hash_parts._buffer = &part;
  writer.write(metrics);
  const Outcome outcome = process_->wait(30);
  EXPECT_EQ(outcome.status, 1);
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  EXPECT_NE(outcome.err.find("a metrics sample does not fit the run"), std::string::npos) << outcome.err;
}

TEST_F(Control, RobotStatesArePublished) {
  std::array<std::atomic<int>, 20> seen{};
  const dds::Reader<PublicRobotState> robots(domain_.participant, topics::robots(),
                                             [&](const PublicRobotState& sample, dds::SampleState state) {
                                               if (state.valid && sample.robot < seen.size()) ++seen[sample.robot];
                                             });
  start();
  EXPECT_TRUE(eventually(
      [&] { return std::all_of(seen.begin(), seen.end(), [](const auto& count) { return count >= 3; }); }));
  ask(kilotwin_open_STOP_RUN);
  EXPECT_EQ(process_->wait(30).status, 0);
}

}  // namespace
}  // namespace kilotwin::test
