// The base station in whole runs: plugins, their failures, house-keeping.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/system/program.hpp"

namespace kilotwin::test {
namespace {

Words with(Words words, const Words& more) {
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

Words meadow(const Words& more) {
  return with({source("experiments/ark-meadow.txtpb"), "--set", "station.camera.frame_rate_hz=10"}, more);
}

nlohmann::json json_of(const std::filesystem::path& file) { return nlohmann::json::parse(read(file)); }

TEST(Station, PluginsGiveOneHashHoweverARunIsDivided) {
  const Scratch scratch;
  const auto whole =
      run(meadow({"--mode", "local", "--duration", "12", "--checkpoint-every", "5"}), scratch, "whole");
  EXPECT_EQ(
      run(meadow({"--mode", "local", "--partitions", "2x2", "--hosts", "3", "--threads", "2", "--duration", "12"}),
          scratch, "divided")
          .state_hash,
      whole.state_hash);
  EXPECT_EQ(run(meadow({"--partitions", "2x1", "--duration", "12"}), scratch, "federated").state_hash,
            whole.state_hash);
  const auto resumed =
      run(meadow({"--mode", "local", "--duration", "12", "--resume", scratch / "whole"}), scratch, "resumed");
  EXPECT_EQ(resumed.state_hash, whole.state_hash);
  EXPECT_GT(resumed.resumed_from_tick, 0);
  EXPECT_EQ(kilotwin({"replay", scratch / "whole", "--verify"}, scratch).status, 0);
  EXPECT_NE(run(meadow({"--mode", "local", "--duration", "12", "--seed", "2"}), scratch, "other").state_hash,
            whole.state_hash);
  // The bits of both environments travelled, and nothing was too wide for its own.
  const auto station = json_of(scratch.path() / "whole" / "summary.json").at("station");
  EXPECT_GT(station.at("robot_messages").get<int>(), 100);
  EXPECT_EQ(station.at("too_wide").get<int>(), 0);
  EXPECT_NE(read(scratch.path() / "whole" / "station-0.tsv"), "");
}

/// An experiment whose plugin does `what` in its run() after two seconds.
std::string with_plugin(const Scratch& scratch, const std::string& what, const std::string& more = "") {
  write(scratch.path() / "bad.cpp",
        "#include <kilotwin_station.hpp>\n#include <cstdlib>\n#include <stdexcept>\n#include <unistd.h>\n"
        "struct Bad : KilobotExperiment {\n  void initialise(bool) override {}\n"
        "  void run() override { if (time > 2) { " +
            what + " } }\n};\nextern \"C\" KilobotExperiment* createExpt() { return new Bad; }\n");
  write(scratch.path() / "bad.txtpb",
        "duration_s: 5 robots { count: 4 behaviour: \"" + source("behaviours/ark_hub.c") +
            "\" layout { grid { } } } station { environment { plugin { source: \"bad.cpp\" " + more +
            "} } environment { hub { } } }");
  return scratch / "bad.txtpb";
}

TEST(Station, APluginThatFailsCostsThePluginAlone) {
  struct {
    const char *what, *says;
  } const faults[] = {{"*(volatile int*)nullptr = 1;", "run: signal 11"},
                      {"for (volatile int i = 0;; i = i + 1) {}", "run: it did not return"},
                      {"throw std::runtime_error(\"no nest\");", "run: no nest"}};
  for (const auto& fault : faults) {
    const Scratch scratch;
    const std::string experiment = with_plugin(scratch, fault.what);
    for (const char* mode : {"local", "federated"}) {
      const std::string out = scratch / mode;
      const Outcome outcome = kilotwin({"run", experiment, "--mode", mode, "--out", out}, scratch);
      EXPECT_EQ(outcome.status, 0) << outcome.err;
      const auto station = json_of(out + "/summary.json").at("station");
      EXPECT_NE(station.at("plugins").at(0).at("failure").get<std::string>().find(fault.says), std::string::npos)
          << station.dump();
      EXPECT_EQ(station.at("plugins").at(1).at("failure"), "");
      EXPECT_GT(station.at("robot_messages").get<int>(), 10);  // of the hub, which goes on
      if (std::string(mode) == "local") {
        EXPECT_NE(outcome.err.find(fault.says), std::string::npos) << outcome.err;
      }
    }
    EXPECT_EQ(json_of(scratch / "local/summary.json").at("state_hash"),
              json_of(scratch / "federated/summary.json").at("state_hash"));
  }
}

/// A run at a pace cannot wait for a plugin that sleeps for as long as one that runs as fast as it can.
TEST(Station, APluginThatSleepsDoesNotHoldUpAPacedRun) {
  const Scratch scratch;
  const Outcome outcome = kilotwin({"run", with_plugin(scratch, "sleep(1000);"), "--mode", "local", "--pace", "1",
                                    "--duration", "3", "--out", scratch / "run"},
                                   scratch);
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("run: it did not return"), std::string::npos) << outcome.err;
  EXPECT_LT(json_of(scratch / "run/summary.json").at("wall_s").get<double>(), 30) << "of 60 s without a pace";
}

TEST(Station, AFailureEndsTheRunWhereTheExperimentSaysSo) {
  const Scratch scratch;
  const std::string experiment = with_plugin(scratch, "abort();", "on_failure: END_RUN ");
  for (const char* mode : {"local", "federated"}) {
    const Outcome outcome = kilotwin({"run", experiment, "--mode", mode, "--out", scratch / mode}, scratch);
    EXPECT_EQ(outcome.status, 1);
    EXPECT_NE(outcome.err.find("plugin bad.cpp failed"), std::string::npos) << outcome.err;
  }
}

TEST(Station, APluginWithoutSerializeCannotBeResumed) {
  const Scratch scratch;
  const std::string experiment = with_plugin(scratch, "");
  EXPECT_EQ(
      kilotwin({"run", experiment, "--mode", "local", "--checkpoint-every", "2", "--out", scratch / "run"}, scratch)
          .status,
      0);
  const Outcome outcome = kilotwin({"run", experiment, "--mode", "local", "--duration", "6", "--resume",
                                    scratch / "run", "--out", scratch / "on"},
                                   scratch);
  EXPECT_EQ(outcome.status, 1);
  EXPECT_NE(outcome.err.find("has no serialize()"), std::string::npos) << outcome.err;
}

Words procedure(const std::string& name, const Words& more) {
  return with({source("experiments/ark-housekeeping.txtpb"), "--mode", "local", "--set",
               "station.environment.plugin.built_in=" + name},
              more);
}

TEST(Station, IdentifiesRobotsWhoseNumbersItDoesNotKnow) {
  const Scratch scratch;
  for (const char* camera : {"station.log_every_s=10", "station.camera.frame_rate_hz=10"}) {
    const std::string name = camera;
    run(procedure("identify", {"--robots", "12", "--duration", "25", "--set", camera}), scratch, name);
    const auto report = json_of(scratch.path() / name / "station-0.json");
    EXPECT_EQ(report.at("identified"), 12) << report.dump();
    for (int i = 0; i < 12; ++i) EXPECT_EQ(report.at("id_of_track").at(static_cast<std::size_t>(i)), i);
  }
}

/// The robots begin with numbers that the station does not know.
TEST(Station, AssignsUniqueNumbers) {
  for (const auto& [base, camera] : {std::pair{"2", "station.log_every_s=10"},
                                     {"3", "station.log_every_s=10"},
                                     {"3", "station.camera.frame_rate_hz=10"}}) {
    SCOPED_TRACE(std::string(base) + " " + camera);
    const Scratch scratch;
    run(procedure("assign_ids", {"--robots", "12", "--duration", "120", "--set",
                                 "station.environment.plugin.parameter[0].name=base", "--set",
                                 "station.environment.plugin.parameter[0].value=" + std::string(base), "--set",
                                 "robots.first_uid=100", "--set", camera}),
        scratch, "run");
    const auto report = json_of(scratch.path() / "run" / "station-0.json");
    EXPECT_EQ(report.at("assigned"), 12) << report.dump();
    EXPECT_EQ(report.at("verified"), 12) << report.dump();
  }
}

TEST(Station, CalibrationBringsCurvatureDown) {
  const Scratch scratch;
  for (const char* camera : {"station.log_every_s=10", "station.camera.frame_rate_hz=10"}) {
    const std::string name = camera;
    run(procedure("calibrate", {"--set", camera}), scratch, name);
    const auto report = json_of(scratch.path() / name / "station-0.json");
    const double before = report.at("before").at("mean_abs_curvature_per_m"),
                 after = report.at("after").at("mean_abs_curvature_per_m"),
                 error = report.at("after").at("standard_error");
    EXPECT_GE(report.at("driven"), 20) << report.dump();
    EXPECT_LT(after + 3 * error, before / 2) << report.dump();
  }
}

}  // namespace
}  // namespace kilotwin::test
