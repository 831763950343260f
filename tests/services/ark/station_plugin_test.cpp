// Plugins with sources: compiled, run in a process of their own, crashed and hung.
#include <gtest/gtest.h>

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <set>

#include "core/base/error.hpp"
#include "services/behaviours/compiler.hpp"
#include "tests/services/ark/plugin_bench.hpp"

namespace kilotwin::ark {
namespace {

/// One plugin whose parameter `do` says what it does in its calls, so that it is compiled once.
const std::string kSource = R"(
#include <kilotwin_station.hpp>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <unistd.h>

struct Environment : KilobotEnvironment {
  double level = 0;
  void update() override { level += 1; }
  void updateVirtualSensor(Kilobot k) override {
    if (k.isSeen()) transmitKiloState(make_message(k.getID(), 1, static_cast<unsigned>(level)));
  }
};

struct Experiment : KilobotExperiment {
  Environment environment;
  std::string what;
  int deep(int n) { volatile int room[1000]; room[n % 1000] = n; return deep(n + 1) + room[0]; }
  void initialise(bool) override {
    addEnvironment(&environment);
    what = textParameter("do", "");
    if (what == "picture frame") useArkPictureFrame();
  }
  void run() override {
    if (what == "exit") exit(0);
    if (what == "overflow") deep(0);
    if (what == "close") for (int i = 3; i < 200; ++i) close(i);
    if (what == "throw 3") throw 3;
    if (what.rfind("until ", 0) == 0) while (access(what.c_str() + 6, F_OK) != 0) usleep(10000);
    if (what == "stranger") signalKilobot(make_message(7, 1, 1));
    if (what == "wait") { FILE* p = popen("sleep 100", "r"); fgetc(p); }
    if (what == "print") { std::printf("%0300d\n", 7); std::fflush(stdout); }
    if (what == "draw") for (unsigned i = 0; i < 5; ++i) signalKilobot(make_message(i, rand() % 16, randomInteger(1024)));
    if (what == "mathematics")
      for (volatile double x = -3; x < 3; x = x + 0.37)
        if (std::sin(x) != kt_sin(x) || std::atan2(x, 2.0) != kt_atan2(x, 2)) throw std::runtime_error("differs");
    KilobotExperiment::run();
  }
  void updateKilobotState(Kilobot k) override {
    if (what == "null" && k.getID() == 3) *(volatile int*)8 = 1;
    if (what == "abort" && k.getID() == 2) abort();
    if (what == "throw" && k.getID() == 4) throw std::runtime_error("no nest");
    if (what == "loop") for (volatile int i = 0;; i = i + 1) {}
    if (what == "picture frame" && k.getID() == 3) drawCircle(k.getPosition(), 5, {1, 2, 3}, "here");
  }
  void serialize(Archive& archive) override {
    if (what == "no hook") return KilobotExperiment::serialize(archive);
    archive & environment.level;
  }
};
extern "C" KilobotExperiment* createExpt() { return new Experiment; }
)";

class StationPlugin : public testing::Test {
 protected:
  std::filesystem::path compiled(const std::string& source) {
    const std::filesystem::path file = scratch_ / "plugin.cpp";
    std::ofstream(file) << source;
    return behaviours::compile_station_plugin({file}).file;
  }
  PluginBench bench(const std::string& what, PluginPatience patience = {}, std::uint64_t seed = 1) {
    static const std::filesystem::path host = behaviours::compile_plugin_host().file;
    return {start_plugin_process(host, compiled(kSource), patience), {{"do", what}}, 5, seed};
  }
  /// The failure of the first step; after a crash a further step fails, too.
  std::string failure_of(const std::string& what, PluginPatience patience = {}) {
    PluginBench it = bench(what, patience);
    EXPECT_EQ(it.set_up.failure, "");
    const station::Reply reply = it.step({3, {}});
    EXPECT_TRUE(reply.sent.empty());
    if (reply.crashed) {
      EXPECT_NE(it.step({3, {}}).failure, "");
    }
    return reply.failure;
  }
  void SetUp() override {
    scratch_ = std::filesystem::path(testing::TempDir()) / ("station-plugin-" + std::to_string(getpid()));
    std::filesystem::create_directories(scratch_);
  }
  void TearDown() override { std::filesystem::remove_all(scratch_); }
  std::filesystem::path scratch_;
};

TEST_F(StationPlugin, RunsInAProcessOfItsOwn) {
  PluginBench it = bench("");
  ASSERT_EQ(it.set_up.failure, "");
  EXPECT_EQ(it.sense({3, {}}), (ArkMessage{3, 1, 1}));
  EXPECT_EQ(it.sense({2, {}}), (ArkMessage{2, 1, 2}));
  const std::string state = it.save();
  EXPECT_EQ(it.sense({2, {}}), (ArkMessage{2, 1, 3}));
  EXPECT_EQ(it.load(state).failure, "");
  EXPECT_EQ(it.sense({2, {}}), (ArkMessage{2, 1, 3}));
}

/// The station shows meanwhile that it lives.
TEST_F(StationPlugin, TheStationIsCalledWhileAPluginComputes) {
  int calls = 0;
  PluginPatience patience;
  patience.while_waiting = [&] {
    // The plugin waits for this file.
    if (++calls == 3) std::ofstream(scratch_ / "go") << "go";
  };
  PluginBench it = bench("until " + (scratch_ / "go").string(), patience);
  EXPECT_EQ(it.step({3, {}}).failure, "");
  EXPECT_GE(calls, 3);
}

TEST_F(StationPlugin, ACrashNamesTheFunctionAndTheRobot) {
  EXPECT_EQ(failure_of("null"), "updateKilobotState of robot 3: signal 11 (Segmentation fault)");
  EXPECT_EQ(failure_of("abort"), "updateKilobotState of robot 2: signal 6 (Aborted)");
  EXPECT_EQ(failure_of("exit"), "run: it ended its process");
  EXPECT_EQ(failure_of("overflow"), "run: signal 11 (Segmentation fault)");
  EXPECT_NE(failure_of("close"), "");
}

TEST_F(StationPlugin, AnExceptionNamesTheFunctionAndTheRobot) {
  EXPECT_EQ(failure_of("throw"), "updateKilobotState of robot 4: no nest");
  EXPECT_EQ(failure_of("throw 3"), "run: an exception that is no std::exception");
  EXPECT_NE(failure_of("stranger").find("does not exist"), std::string::npos);
}

TEST_F(StationPlugin, ALoopForEverNamesTheFunction) {
  EXPECT_EQ(failure_of("loop", {0.2, 60}), "updateKilobotState of robot 0: it did not return");
  // One that waits uses no processor time.
  EXPECT_EQ(failure_of("wait", {60, 0.3}), "run: it did not return");
}

TEST_F(StationPlugin, WhatItPrintsHarmsNothing) { EXPECT_EQ(bench("print").sense({1, {}}), (ArkMessage{1, 1, 1})); }

TEST_F(StationPlugin, RandomNumbersAreThoseOfTheSeed) {
  std::set<std::vector<int>> seen;
  for (const std::uint64_t seed : {1u, 1u, 2u}) {
    PluginBench it = bench("draw", {}, seed);
    std::vector<int> values;
    for (const station::Sent& sent : it.step({0, {}}).sent) values.insert(values.end(), {sent.type, sent.data});
    EXPECT_GE(values.size(), 10u);
    seen.insert(values);
  }
  EXPECT_EQ(seen.size(), 2u);
}

TEST_F(StationPlugin, TheMathematicsIsThatOfTheSimulation) {
  EXPECT_EQ(bench("mathematics").step({0, {}}).failure, "");
}

TEST_F(StationPlugin, WithoutSerializeItIsNotResumable) {
  PluginBench it = bench("no hook");
  EXPECT_EQ(it.sense({3, {}}), (ArkMessage{3, 1, 1}));
  station::Request request;
  request.call = station::Call::kSave;
  EXPECT_FALSE(it.host->ask(request).resumable);
}

TEST_F(StationPlugin, ArksPictureFrameHasItsOriginAtTheTopLeft) {
  PluginBench it = bench("picture frame");
  const station::Reply reply = it.step({3, {100, 200, 0}});
  ASSERT_EQ(reply.failure, "");
  // Arena 2000 x 2000: (100, 200) is the pixel (1100, 800), and is painted where it is.
  ASSERT_EQ(reply.floor.circles.size(), 1u);
  EXPECT_EQ(reply.floor.circles[0].centre, station::Point(100, 200));
  EXPECT_NE(reply.rows.at(3).find("1100.000\t800.000"), std::string::npos) << reply.rows.at(3);
}

TEST_F(StationPlugin, ErrorsOfTheCompilerNameThePlace) {
  try {
    static_cast<void>(compiled("#include <kilotwin_station.hpp>\nint f() { return nothing; }\n"));
    FAIL();
  } catch (const UserError& error) {
    EXPECT_NE(std::string(error.what()).find("plugin.cpp:2:"), std::string::npos) << error.what();
  }
}

TEST_F(StationPlugin, TheSameSourceGivesTheSameObject) {
  const std::string& source = kSource;
  const std::filesystem::path file = scratch_ / "plugin.cpp";
  std::ofstream(file) << source;
  behaviours::CompileOptions other;
  other.cache_directory = scratch_ / "cache";
  EXPECT_EQ(behaviours::compile_station_plugin({file}).sha256,
            behaviours::compile_station_plugin({file}, other).sha256);
}

}  // namespace
}  // namespace kilotwin::ark
