// `kilotwin view` beside live runs, as processes: a gateway that stands still changes nothing, and a run without a pace shows a bounded
// number of states.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <cstring>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <regex>

#include "clients/recorder/summary.hpp"
#include "tests/clients/view/recordings.hpp"
#include "tests/clients/view/websocket_client.hpp"
#include "tests/system/own_domain.hpp"
#include "tests/system/program.hpp"

namespace kilotwin::view {
namespace {

using test::Process;
using test::Scratch;
using test::WebSocketClient;

constexpr const char* kExperiment = R"(
name: "watched"
duration_s: 100
arena { width_mm: 700 height_mm: 500 }
robots { count: 12 behaviour: "disperse.c" layout { grid { pitch_mm: 40 } } }
)";

/// A gateway of its own for the runs on a domain.
class Gateway {
 public:
  Gateway(const test::Words& more, const Scratch& scratch) : scratch_(scratch) {
    std::filesystem::create_directories(scratch_ / "gateway");
    test::Words words{KILOTWIN_VIEW_PROGRAM, "view", "--domain", domain.name};
    words.insert(words.end(), more.begin(), more.end());
    process = std::make_unique<Process>(words, scratch_ / "gateway");
    EXPECT_TRUE(process->says("kilotwin: open", 60));
  }
  [[nodiscard]] std::uint16_t port() const {
    std::smatch found;
    std::string text;
    for (const auto& file : std::filesystem::directory_iterator(scratch_ / "gateway"))
      text += test::read(file.path());
    EXPECT_TRUE(std::regex_search(text, found, std::regex("127\\.0\\.0\\.1:(\\d+)"))) << text;
    return static_cast<std::uint16_t>(std::stoi(found[1]));
  }
  const test::OwnDomain domain;
  std::unique_ptr<Process> process;

 private:
  const Scratch& scratch_;
};

test::Words run_of(const std::string& experiment, const test::OwnDomain& domain, const std::string& out) {
  return {test::program(), "run", experiment, "--quiet", "--domain", domain.name, "--out", out};
}

class LiveGateway : public testing::Test {
 protected:
  void SetUp() override {
    test::write(scratch / "disperse.c", test::read(test::source("behaviours/disperse.c")));
    test::write(scratch / "watched.txtpb", kExperiment);
  }
  [[nodiscard]] std::uint64_t hash_of(const std::string& out) const {
    return recorder::read_summary(scratch / (out + "/summary.json")).state_hash;
  }
  Scratch scratch;
};

TEST_F(LiveGateway, ThatStandsStillChangesNothing) {
  Gateway gateway({}, scratch);
  const std::string experiment = scratch / "watched.txtpb";
  WebSocketClient viewer(gateway.port());
  Process run(run_of(experiment, gateway.domain, scratch / "watched"), scratch.path());
  ASSERT_TRUE(viewer.await("run"));
  gateway.process->signal(SIGSTOP);
  // 100 simulated seconds are 3050 ticks: far more than any buffer holds, if anything waited for the gateway.
  EXPECT_EQ(run.wait().status, 0) << "a run that waits for a stopped gateway does not end";
  gateway.process->signal(SIGCONT);
  ASSERT_EQ(Process(run_of(experiment, gateway.domain, scratch / "alone"), scratch.path()).wait().status, 0);
  EXPECT_EQ(hash_of("watched"), hash_of("alone"));
}

TEST_F(LiveGateway, ShowsFewStatesOfARunWithoutAPace) {
  Gateway gateway({}, scratch);
  WebSocketClient viewer(gateway.port());
  Process run(run_of(scratch / "watched.txtpb", gateway.domain, scratch / "fast"), scratch.path());
  ASSERT_TRUE(viewer.await("run"));
  const double began = test::now_s();
  double last_tick = -1;
  int frames = 0;
  for (;; ++frames) {
    viewer.send_text(R"({"do":"next"})");
    const auto frame = viewer.await("frame", run.running() ? 5 : 1);
    if (!frame) break;
    std::memcpy(&last_tick, frame->payload.data() + 8, sizeof last_tick);
  }
  EXPECT_GT(frames, 0);
  // 20 per second, and the first and the last ones.
  EXPECT_LE(frames, 20 * (test::now_s() - began) + 5);
  EXPECT_EQ(last_tick, static_cast<double>(recorder::read_summary(scratch / "fast/summary.json").ticks))
      << "the last state is shown";
}

TEST_F(LiveGateway, ShowsFloorsOfARunWhoseDirectoryItKnows) {
  Gateway gateway({scratch / "meadow"}, scratch);
  WebSocketClient viewer(gateway.port());
  test::Words words = run_of(test::source("experiments/ark-meadow.txtpb"), gateway.domain, scratch / "meadow");
  words.insert(words.end(), {"--pace", "1", "--robots", "5", "--set", "station.floor_every_s=0.5"});
  Process run(words, scratch.path());
  ASSERT_TRUE(viewer.await("run"));
  ASSERT_TRUE(test::eventually(
      [&] {
        viewer.send_text(R"({"do":"floors","tick":1000000})");
        viewer.send_text(R"({"do":"work"})");  // its answer follows, with or without floors
        for (auto message = viewer.read(); message && !message->is("work"); message = viewer.read())
          if (message->is("floors")) return !nlohmann::json::parse(message->payload)["floors"].empty();
        return false;
      },
      60));
  run.signal(SIGINT);
  static_cast<void>(run.wait());
}

TEST(Gateway, OfARecordingGivesWayToTheRunThatMayStillGoOn) {
  Scratch scratch;
  test::write_circling(scratch / "r.ktrec", {});
  const Process process({KILOTWIN_VIEW_PROGRAM, "view", scratch / "r.ktrec"}, scratch.path());
  ASSERT_TRUE(process.says("kilotwin: open", 60));
  EXPECT_EQ(getpriority(PRIO_PROCESS, static_cast<id_t>(process.id())), 10);
}

}  // namespace
}  // namespace kilotwin::view
