// report.html of a run: what it says of runs that succeed, of robots and runs that fail, and when it is written.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>

#include "clients/recorder/reader.hpp"
#include "core/base/error.hpp"
#include "tests/system/program.hpp"

namespace kilotwin::test {
namespace {

namespace fs = std::filesystem;

class RunReport : public testing::Test {
 protected:
  void SetUp() override {
    write(scratch / "p.c",
          "#include <kilolib.h>\nstatic void setup(void) {}\n"
          "static void loop(void) {\n  if (kilo_uid == 3) *(volatile char*)1 = 0;\n  set_motors(255, 255);\n}\n"
          "int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }\n");
    write(scratch / "e.txtpb",
          "name: \"driven\" duration_s: 3\nrobots { count: 9 behaviour: \"p.c\" }\n"
          "observable { name: \"left\" value: \"share(x_mm < 0)\" }\n");
  }
  Outcome run(Words more) const {
    more.insert(more.begin(), {"run", scratch / "e.txtpb", "--out", scratch / "run"});
    return kilotwin(more, scratch);
  }
  [[nodiscard]] std::string page() const { return read(scratch / "run/report.html"); }
  static void expect_texts(const std::string& page, const std::vector<std::string>& texts) {
    for (const std::string& text : texts) EXPECT_NE(page.find(text), std::string::npos) << text;
  }
  /// Whether a run that goes on has recorded a state.
  [[nodiscard]] bool has_state() const {
    try {
      return recorder::Reader(scratch.path() / "run/recording.ktrec").next_state() != nullptr;
    } catch (const UserError&) {
      return false;
    }
  }
  Scratch scratch;
};

TEST_F(RunReport, DescribesTheRunAndNamesFailedRobots) {
  const Outcome outcome = run({"--mode", "local", "--seed", "7"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("report.html"), std::string::npos);
  const recorder::Summary summary = recorder::read_summary(scratch.path() / "run/summary.json");
  const std::string hash = fmt::format("{:016x}", summary.state_hash);
  expect_texts(page(),
               {"<h1>driven</h1>", "share(x_mm &lt; 0)", "1 robot of 9 failed", hash, "9 simulated with p.c",
                "<td>3</td>", "p.c:4", "left, an observable of the experiment", "Mean square displacement",
                "alt=\"start, paths and end of all robots\"", "--seed 7", "kilotwin debug", "kilotwin replay"});
  // One file: nothing is loaded from elsewhere, and nothing is executed.
  for (const char* text : {"<script", "src=\"http", "@import", "url("})
    EXPECT_EQ(page().find(text), std::string::npos) << text;
}

TEST_F(RunReport, NamesTheFederateForWhichOthersWaited) {
  ASSERT_EQ(run({"--partitions", "2x1"}).status, 0);
  expect_texts(page(), {"2x1 partitions, 1 behaviours host", "<td>physics 1,0</td>", "held up the"});
}

TEST_F(RunReport, IsWrittenLaterForQuietRuns) {
  ASSERT_EQ(run({"--mode", "local", "--quiet"}).status, 0);
  EXPECT_FALSE(fs::exists(scratch / "run/report.html"));
  ASSERT_EQ(kilotwin({"export", scratch / "run", "--report", scratch / "run/report.html"}, scratch).status, 0);
  expect_texts(page(), {"1 robot of 9 failed", "data:image/svg+xml;base64,"});
}

TEST_F(RunReport, HasNoCurvesWithoutGnuplotAndSaysSo) {
  ASSERT_EQ(run({"--mode", "local", "--quiet"}).status, 0);
  Process without({"/usr/bin/env", "PATH=" + scratch.path().string(), program(), "export", scratch / "run",
                   "--report", scratch / "run/report.html"},
                  scratch.path());
  EXPECT_EQ(without.wait().status, 0);
  expect_texts(page(), {"gnuplot is not installed", "1 robot of 9 failed"});
  EXPECT_EQ(page().find("class=\"plot\""), std::string::npos);
}

TEST_F(RunReport, HasTheTotalsOfStationAndTrackers) {
  ASSERT_EQ(run({"--mode", "local", "--quiet"}).status, 0);
  recorder::Summary summary = recorder::read_summary(scratch.path() / "run/summary.json");
  summary.station.plugins = {{"fields", "slower than <real> time"}};
  summary.station.packets = 1234;
  summary.tracked = true;
  summary.tracking.joined = 8;
  summary.tracking.trackers.push_back({.source = "ceiling", .frames = 4321, .dropped = 17});
  summary.monitor = R"({"alarms": [{}, {}]})";
  recorder::write_summary(summary, scratch.path() / "run/summary.json");
  ASSERT_EQ(kilotwin({"export", scratch / "run", "--report", scratch / "run/report.html"}, scratch).status, 0);
  expect_texts(page(), {"plugin fields", "slower than &lt;real&gt; time", "1234", "8 joined",
                        "<td>ceiling</td><td>4321</td><td>17</td>", "2 alarms, in alarms.txt"});
}

TEST_F(RunReport, SaysWhyARunFailed) {
  for (const char* mode : {"local", "federated"}) {
    Process paced({program(), "run", scratch / "e.txtpb", "--mode", mode, "--duration", "600", "--pace", "1",
                   "--force", "--out", scratch / "run"},
                  scratch.path());
    ASSERT_TRUE(eventually([&] { return has_state(); }));
    paced.signal(SIGINT);
    EXPECT_NE(paced.wait().status, 0);
    expect_texts(page(), {"<b>Failed at ", "of 600 s:", "interrupted"});
    fs::remove_all(scratch.path() / "run");
  }
}

}  // namespace
}  // namespace kilotwin::test
