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

const std::string kBegin =
    "#include <kilotwin_station.hpp>\n#include <cmath>\n#include <cstdio>\n#include <cstdlib>\n#include "
    "<stdexcept>\n"
    "struct Environment : KilobotEnvironment {\n"
    "  double level = 0;\n"
    "  void update() override { level += 1; }\n"
    "  void updateVirtualSensor(Kilobot k) override { if (k.isSeen()) transmitKiloState(make_message(k.getID(), 1, "
    "level)); }\n"
    "};\n"
    "struct Experiment : KilobotExperiment {\n"
    "  Environment environment;\n"
    "  void initialise(bool) override { addEnvironment(&environment); }\n";
const std::string kEnd = "};\nextern \"C\" KilobotExperiment* createExpt() { return new Experiment; }\n";
const std::string kSerialize = "  void serialize(Archive& archive) override { archive & environment.level; }\n";

class StationPlugin : public testing::Test {
 protected:
  std::filesystem::path compiled(const std::string& source) {
    const std::filesystem::path file = scratch_ / "plugin.cpp";
    std::ofstream(file) << source;
    return behaviours::compile_station_plugin({file}).file;
  }
  PluginBench bench(const std::string& members, PluginPatience patience = {}, std::uint64_t seed = 1) {
    static const std::filesystem::path host = behaviours::compile_plugin_host().file;
    return {start_plugin_process(host, compiled(kBegin + members + kEnd), patience), {}, 5, seed};
  }
  /// The failure of the first step; a further step fails, too.
  std::string failure_of(const std::string& members, PluginPatience patience = {}) {
    PluginBench it = bench(members, patience);
    EXPECT_EQ(it.set_up.failure, "");
    const station::Reply reply = it.step({3, {}});
    EXPECT_TRUE(reply.sent.empty());
    if (reply.crashed) EXPECT_NE(it.step({3, {}}).failure, "");
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
  PluginBench it = bench(kSerialize);
  ASSERT_EQ(it.set_up.failure, "");
  EXPECT_EQ(it.sense({3, {}}), (ArkMessage{3, 1, 1}));
  EXPECT_EQ(it.sense({2, {}}), (ArkMessage{2, 1, 2}));
  const std::string state = it.save();
  EXPECT_EQ(it.sense({2, {}}), (ArkMessage{2, 1, 3}));
  EXPECT_EQ(it.load(state).failure, "");
  EXPECT_EQ(it.sense({2, {}}), (ArkMessage{2, 1, 3}));
}

TEST_F(StationPlugin, ACrashNamesTheFunctionAndTheRobot) {
  EXPECT_NE(
      failure_of("  void updateKilobotState(Kilobot k) override { if (k.getID() == 3) *(volatile int*)8 = 1; }\n")
          .find("updateKilobotState of robot 3: signal 11"),
      std::string::npos);
  EXPECT_NE(failure_of("  void updateKilobotState(Kilobot k) override { if (k.getID() == 2) abort(); }\n")
                .find("updateKilobotState of robot 2: signal 6"),
            std::string::npos);
  EXPECT_NE(failure_of("  void run() override { exit(0); }\n").find("run: it ended its process"),
            std::string::npos);
  EXPECT_NE(failure_of("  void run() override { volatile int deep[1000]; deep[0] = 1; run(); deep[1] = 2; }\n")
                .find("run: signal 11"),
            std::string::npos);
  EXPECT_NE(failure_of("  void run() override { for (int i = 3; i < 200; ++i) ::fclose(fdopen(i, \"r\")); }\n"),
            "");
}

TEST_F(StationPlugin, AnExceptionNamesTheFunctionAndTheRobot) {
  EXPECT_EQ(failure_of(
                "  void updateKilobotState(Kilobot k) override { if (k.getID() == 4) throw std::runtime_error(\"no "
                "nest\"); }\n"),
            "updateKilobotState of robot 4: no nest");
  EXPECT_EQ(failure_of("  void run() override { throw 3; }\n"), "run: an exception that is no std::exception");
  EXPECT_NE(failure_of("  void run() override { signalKilobot(make_message(7, 1, 1)); }\n").find("does not exist"),
            std::string::npos);
}

TEST_F(StationPlugin, ALoopForEverNamesTheFunction) {
  const PluginPatience short_patience{0.2, 60};
  EXPECT_EQ(failure_of("  void updateKilobotState(Kilobot) override { for (volatile int i = 0;; i = i + 1) {} }\n",
                       short_patience),
            "updateKilobotState of robot 0: it did not return");
  // One that waits uses no processor time.
  EXPECT_EQ(failure_of("  void run() override { FILE* p = popen(\"sleep 100\", \"r\"); fgetc(p); }\n", {60, 0.3}),
            "run: it did not return");
}

TEST_F(StationPlugin, WhatItPrintsHarmsNothing) {
  PluginBench it = bench("  void run() override { KilobotExperiment::run(); }\n" + kSerialize);
  EXPECT_EQ(it.sense({1, {}}), (ArkMessage{1, 1, 1}));
}

TEST_F(StationPlugin, RandomNumbersAreThoseOfTheSeed) {
  const std::string draws =
      "  void run() override { for (unsigned i = 0; i < 5; ++i) signalKilobot(make_message(i, rand() % 16, "
      "randomInteger(1024))); }\n";
  std::set<std::vector<int>> seen;
  for (const std::uint64_t seed : {1u, 1u, 2u}) {
    PluginBench it = bench(draws, {}, seed);
    std::vector<int> values;
    for (const station::Sent& sent : it.step({0, {}}).sent) values.insert(values.end(), {sent.type, sent.data});
    EXPECT_EQ(values.size(), 10u);
    seen.insert(values);
  }
  EXPECT_EQ(seen.size(), 2u);
}

TEST_F(StationPlugin, TheMathematicsIsThatOfTheSimulation) {
  PluginBench it = bench(
      "  void run() override {\n"
      "    for (volatile double x = -3; x < 3; x = x + 0.37)\n"
      "      if (std::sin(x) != kt_sin(x) || std::atan2(x, 2.0) != kt_atan2(x, 2)) throw "
      "std::runtime_error(\"differs\");\n"
      "  }\n");
  EXPECT_EQ(it.step({0, {}}).failure, "");
}

TEST_F(StationPlugin, WithoutSerializeItIsNotResumable) {
  PluginBench it = bench("");
  EXPECT_EQ(it.sense({3, {}}), (ArkMessage{3, 1, 1}));
  station::Request request;
  request.call = station::Call::kSave;
  EXPECT_FALSE(it.host->ask(request).resumable);
}

TEST_F(StationPlugin, ArksPictureFrameHasItsOriginAtTheTopLeft) {
  PluginBench it = bench(
      "  void updateKilobotState(Kilobot k) override {\n"
      "    if (k.getID() != 3) return;\n"
      "    useArkPictureFrame();\n"
      "    drawCircle(k.getPosition(), 5, {1, 2, 3}, \"here\");\n"
      "  }\n");
  EXPECT_EQ(it.step({3, {}}).failure, "");
  const station::Reply reply = it.step({3, {100, 200, 0}});
  // Arena 2000 x 2000: (100, 200) is the pixel (1100, 800), and is painted where it is.
  EXPECT_EQ(reply.floor.circles.at(1).centre, station::Point(100, 200));
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
  const std::string source = kBegin + kEnd;
  const std::filesystem::path file = scratch_ / "plugin.cpp";
  std::ofstream(file) << source;
  behaviours::CompileOptions other;
  other.cache_directory = scratch_ / "cache";
  EXPECT_EQ(behaviours::compile_station_plugin({file}).sha256,
            behaviours::compile_station_plugin({file}, other).sha256);
}

}  // namespace
}  // namespace kilotwin::ark
