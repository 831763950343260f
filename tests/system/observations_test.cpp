// Records of runs besides states: variables of programs, events, observables, failures.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/system/program.hpp"

namespace kilotwin::test {
namespace {

/// Every robot shows what it should: variables that are known functions of its id and of the number of its loops.
constexpr const char* kCountingProgram = R"(
#include <kilolib.h>
#ifndef RIGHT
#define RIGHT kilo_straight_right
#endif
uint16_t beats;
int16_t scores[3];
struct { uint8_t mode : 3; float level; } state;
message_t note;
message_t* tx(void) { return &note; }
void setup(void) { note.type = NORMAL; note.crc = message_crc(&note); state.mode = kilo_uid % 5;
  for (int i = 0; i < 3; ++i) scores[i] = kilo_uid * 10 + i - 5; }
void loop(void) { ++beats; state.level = kilo_uid * 0.5f + beats;
  set_color(beats % 32 < 16 ? RGB(1, 0, 0) : RGB(0, 0, 3));
  if (beats == 40) { spinup_motors(); set_motors(kilo_straight_left, RIGHT); }
  if (beats == 80) set_motors(kilo_turn_left, 0);
#ifdef FAULT
  if (beats == 50 && kilo_uid == 3) *(volatile int*)8 = 1;
#endif
}
int main(void) { kilo_init(); kilo_message_tx = tx; kilo_start(setup, loop); return 0; }
)";

constexpr const char* kCountingExperiment = R"(
name: "observed"
duration_s: 5
arena { width_mm: 600 height_mm: 600 }
robots { count: 9 behaviour: "observed.c" loop_rate: ONCE_PER_TICK layout { grid { pitch_mm: 50 } } }
)";

constexpr const char* kRecording = R"text(
recording {
  every_s: 1
  variable { name: "beats" every_s: 0.5 }
  variable { name: "scores" every_s: 1 }
  variable { name: "state" every_s: 1 }
  event: LED event: MOTION event: STATE event: SENT event: RECEIVED
}
observable { name: "reds" value: "share(led == red)" }
observable { name: "score" value: "mean(scores[2])" }
observable { name: "late" value: "quantile(beats, 0.5, robot > 3)" }
)text";

using Table = std::vector<std::map<std::string, std::string>>;

Table table_of(const std::string& csv) {
  std::istringstream in(csv);
  const auto cells = [](const std::string& line) {
    std::vector<std::string> row;
    std::istringstream parts(line);
    for (std::string cell; std::getline(parts, cell, ',');) row.push_back(cell);
    return row;
  };
  std::string line;
  std::getline(in, line);
  const std::vector<std::string> names = cells(line);
  Table table;
  while (std::getline(in, line)) {
    std::vector<std::string> row = cells(line);
    row.resize(names.size());
    table.emplace_back();
    for (std::size_t i = 0; i < names.size(); ++i) table.back()[names[i]] = row[i];
  }
  return table;
}

class Observations : public testing::Test {
 protected:
  Observations() {
    write(scratch_.path() / "observed.c", kCountingProgram);
    write(scratch_.path() / "plain.txtpb", kCountingExperiment);
    write(scratch_.path() / "observed.txtpb", std::string(kCountingExperiment) + kRecording);
  }
  std::string exported(const std::string& run, const std::string& what) {
    const Outcome outcome = kilotwin({"export", scratch_ / run, what, "-"}, scratch_);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    return outcome.out;
  }
  recorder::Summary run_observed(const std::string& name, Words more = {"--mode", "local"}) {
    more.insert(more.begin(), scratch_ / "observed.txtpb");
    return run(more, scratch_, name);
  }
  Scratch scratch_;
};

TEST_F(Observations, RecordingChangesNoResult) {
  const auto plain = run({scratch_ / "plain.txtpb", "--mode", "local"}, scratch_, "plain");
  const auto observed = run_observed("observed");
  EXPECT_EQ(plain.state_hash, observed.state_hash);
  EXPECT_EQ(kilotwin({"replay", scratch_ / "observed", "--verify"}, scratch_).status, 0);
}

TEST_F(Observations, VariablesHaveTheirValues) {
  run_observed("run");
  const Table table = table_of(exported("run", "--variables"));
  ASSERT_EQ(table.size(), 9u * 11) << "0, 0.5 ... 5 s, which is tick 153, the last one";
  for (const auto& row : table) {
    const int robot = std::stoi(row.at("robot")),
              tick = static_cast<int>(std::stod(row.at("time_s")) / 0.032768 + 0.5);
    // A robot starts its program in its first tick, and loops once in each one after.
    EXPECT_NEAR(std::stoi(row.at("beats")), std::max(0, tick), 2) << tick;
    if (row.at("scores[0]").empty() || tick == 0) continue;
    EXPECT_EQ(std::stoi(row.at("scores[0]")), robot * 10 - 5);
    EXPECT_EQ(std::stoi(row.at("scores[2]")), robot * 10 - 3);
    EXPECT_EQ(std::stoi(row.at("state.mode")), robot % 5);
    EXPECT_EQ(std::stod(row.at("state.level")), robot * 0.5 + std::stoi(row.at("beats")));
  }
}

TEST_F(Observations, EventsAgreeWithCountsAndLayout) {
  const auto summary = run_observed("run");
  const Table table = table_of(exported("run", "--events"));
  std::map<std::string, std::uint64_t> count;
  double last = -1;
  for (const auto& row : table) {
    ++count[row.at("event")];
    EXPECT_GE(std::stod(row.at("time_s")), last);
    last = std::stod(row.at("time_s"));
    if (row.at("event") != "received") continue;
    EXPECT_NE(row.at("robot"), row.at("sender"));
    // Until the robots drive they stand on their grid of three columns.
    const int robot = std::stoi(row.at("robot")), sender = std::stoi(row.at("sender"));
    const double apart_mm = 50 * std::hypot(robot % 3 - sender % 3, robot / 3 - sender / 3);
    if (last < 1.2) {
      EXPECT_NEAR(std::stod(row.at("distance_mm")), apart_mm, 0.01) << robot << " from " << sender;
    }
  }
  EXPECT_EQ(count["sent"], summary.messages.sent);
  EXPECT_EQ(count["received"], summary.messages.received);
  EXPECT_GT(count["received"], 0u);
  EXPECT_GE(count["led"], 9u * 9) << "153 ticks: a change each 16";
  const Table commands = table_of(exported("run", "--commands"));
  std::vector<std::string> motions;
  for (const auto& row : commands) {
    if (row.at("robot") == "4") motions.push_back(row.at("motion"));
  }
  EXPECT_EQ(motions, (std::vector<std::string>{"stop", "straight", "left"}));
  EXPECT_EQ(commands.at(0).at("run"), "observed-1");
}

TEST_F(Observations, TheStationsPacketsAndLogsAndLifeCyclesAreExported) {
  write(scratch_.path() / "hub.txtpb",
        "name: \"hub\" duration_s: 3 arena { width_mm: 600 height_mm: 600 } robots { count: 4 behaviour: \"" +
            source("behaviours/ark_hub.c") +
            "\" layout { grid { pitch_mm: 100 } } } station { environment { hub { } } } recording { event: STATION "
            "event: STATE }");
  run({scratch_ / "hub.txtpb", "--mode", "local"}, scratch_, "hub");
  int packets = 0;
  std::map<std::string, std::vector<std::string>> life;
  for (const auto& row : table_of(exported("hub", "--events"))) {
    if (row.at("event") == "state") life[row.at("robot")].push_back(row.at("state"));
    if (row.at("event") != "station") continue;
    EXPECT_EQ(row.at("text").size(), 22u) << "ten octets";
    EXPECT_TRUE(row.at("text").starts_with("0x"));
    packets += row.at("text") != "0x" + std::string(20, '0');
  }
  // Beside those for robots, one starts them.
  const auto station = nlohmann::json::parse(read(scratch_.path() / "hub/summary.json")).at("station");
  EXPECT_EQ(packets, station.at("packets").get<int>() + 1);
  EXPECT_EQ(life.size(), 4u);
  for (const auto& [robot, states] : life)
    EXPECT_EQ(states, (std::vector<std::string>{"idle", "running"})) << robot;

  // The hub's log has the robots at its begin.
  const Table logs = table_of(exported("hub", "--environment")),
              poses = table_of(exported("hub", "--trajectories"));
  ASSERT_GE(logs.size(), 4u);
  for (std::size_t robot = 0; robot < 4; ++robot) {
    EXPECT_EQ(logs[robot].at("name"), "hub");
    EXPECT_EQ(logs[robot].at("robot"), std::to_string(robot));
    EXPECT_NEAR(std::stod(logs[robot].at("x")), std::stod(poses[robot].at("x_mm")), 1e-3);
    EXPECT_NEAR(std::stod(logs[robot].at("y")), std::stod(poses[robot].at("y_mm")), 1e-3);
    EXPECT_NEAR(std::stod(logs[robot].at("orientation_deg")) * M_PI / 180,
                std::stod(poses[robot].at("heading_rad")), 1e-4);
  }
}

TEST_F(Observations, EventsOfAKindAreATableOfTheirOwn) {
  run_observed("run");
  const auto events = [&](const Words& kinds) {
    Words words{"export", scratch_ / "run", "--events", "-"};
    for (const std::string& kind : kinds) words.insert(words.end(), {"--kind", kind});
    return kilotwin(words, scratch_);
  };
  const Table all = table_of(events({}).out), motions = table_of(events({"motion"}).out),
              two = table_of(events({"motion", "sent"}).out);
  const auto count = [&](const char* kind) {
    return static_cast<std::size_t>(
        std::count_if(all.begin(), all.end(), [&](const auto& row) { return row.at("event") == kind; }));
  };
  ASSERT_FALSE(motions.empty());
  EXPECT_EQ(motions.size(), count("motion"));
  EXPECT_EQ(two.size(), count("motion") + count("sent"));
  EXPECT_EQ(motions[0].size(), 6u) << "time_s, event, robot, group, motor_left, motor_right";
  for (const auto& row : motions) EXPECT_FALSE(row.at("motor_right").empty());
  EXPECT_NE(events({"movement"}).err.find("there are led, motion, "), std::string::npos);
  EXPECT_NE(events({"station"}).err.find("event: STATION"), std::string::npos);
  EXPECT_EQ(events({"station"}).status, 2);
}

TEST_F(Observations, CommandsOfOtherDutiesThanTheCalibratedOnesAreNoted) {
  run_observed("run");
  const Words words{"export", scratch_ / "run", "--commands", scratch_ / "c.csv"};
  EXPECT_EQ(kilotwin(words, scratch_).err, "");
  run_observed("other", {"--mode", "local", "--define", "RIGHT=200"});
  const Outcome other = kilotwin({"export", scratch_ / "other", "--commands", scratch_ / "c.csv"}, scratch_);
  EXPECT_EQ(other.status, 0) << other.err;
  EXPECT_NE(other.err.find("9 changes of motion, of 9 robots, are to other duties"), std::string::npos)
      << other.err;
  EXPECT_NE(other.err.find("The first: robot 0 at "), std::string::npos) << other.err;
  EXPECT_NE(other.err.find(" and 200."), std::string::npos) << other.err;
}

TEST_F(Observations, PogosimsTablesComeBackAsTracksAndAsAnExperiment) {
  run_observed("run");
  std::string tracks;
  for (const std::string ending : {".csv", ".feather"}) {
    const std::string table = scratch_ / ("p" + ending), out = scratch_ / (ending.substr(1) + "/p.txtpb");
    ASSERT_EQ(kilotwin({"export", scratch_ / "run", "--pogosim", table}, scratch_).status, 0);
    const Outcome imported =
        kilotwin({"import", table, "--out", out, "--behaviour", scratch_ / "observed.c"}, scratch_);
    ASSERT_EQ(imported.status, 0) << imported.err;
    EXPECT_NE(imported.out.find("600 by 600 mm"), std::string::npos) << imported.out;
    EXPECT_NE(imported.out.find("not taken over"), std::string::npos) << imported.out;
    EXPECT_EQ(kilotwin({"check", out}, scratch_).status, 0);
    tracks = read(scratch_ / (ending.substr(1) + "/p-tracks/trajectories.csv"));
    const Table poses = table_of(exported("run", "--trajectories")), back = table_of(tracks);
    ASSERT_EQ(back.size(), poses.size());
    for (std::size_t i = 0; i < poses.size(); ++i) {
      EXPECT_EQ(back[i].at("robot"), poses[i].at("robot"));
      for (const char* column : {"time_s", "x_mm", "y_mm", "heading_rad"})
        EXPECT_NEAR(std::stod(back[i].at(column)), std::stod(poses[i].at(column)), 1e-4) << column;
    }
  }
}

TEST_F(Observations, AFederatedRunRecordsTheSame) {
  const auto local = run_observed("local");
  const auto federated = run_observed("federated", {"--partitions", "2x1", "--hosts", "2"});
  EXPECT_EQ(local.state_hash, federated.state_hash);
  for (const char* what : {"--variables", "--events", "--commands", "--observables"})
    EXPECT_EQ(exported("local", what), exported("federated", what)) << what;
  EXPECT_EQ(local.observables, federated.observables);
}

TEST_F(Observations, AResumedRunRecordsTheRest) {
  run_observed("whole", {"--mode", "local", "--checkpoint-every", "2"});
  run_observed("rest", {"--mode", "local", "--resume", scratch_ / "whole"});
  const Table whole = table_of(exported("whole", "--variables")), rest = table_of(exported("rest", "--variables"));
  ASSERT_FALSE(rest.empty());
  ASSERT_LT(rest.size(), whole.size());
  EXPECT_TRUE(std::equal(rest.rbegin(), rest.rend(), whole.rbegin()));
}

TEST_F(Observations, ObservablesAreInSummarySweepAndTable) {
  const auto summary = run_observed("run");
  ASSERT_EQ(summary.observables.size(), 3u);
  EXPECT_EQ(summary.observables[1].first, "score");
  EXPECT_EQ(summary.observables[1].second, 4 * 10 - 3) << "mean of uid 0..8";
  const Outcome sweep =
      kilotwin({"sweep", scratch_ / "observed.txtpb", "--seeds", "1..3", "--set",
                "robots.layout.grid.pitch_mm=50..60:5", "--plot", "score", "--out", scratch_ / "sweep"},
               scratch_);
  ASSERT_EQ(sweep.status, 0) << sweep.err;
  const Table runs = table_of(read(scratch_.path() / "sweep/runs.csv"));
  ASSERT_EQ(runs.size(), 9u);
  for (const auto& row : runs) {
    EXPECT_EQ(row.at("score"), "37");
    EXPECT_EQ(row.at("well"), "1");
    EXPECT_TRUE(std::filesystem::exists(row.at("directory") + "/summary.json"));
  }
  EXPECT_EQ(runs[8].at("robots.layout.grid.pitch_mm"), "60");
  const Table points = table_of(read(scratch_.path() / "sweep/sweep.csv"));
  EXPECT_EQ(points.at(1).at("score_se"), "0");
}

TEST_F(Observations, AnInterruptedSweepGoesOn) {
  const Words words{"sweep", scratch_ / "observed.txtpb", "--seeds", "1..2"};
  Words first = words, again = words;
  first.insert(first.end(), {"--out", scratch_ / "sweep"});
  ASSERT_EQ(kilotwin(first, scratch_).status, 0);
  const std::string csv = read(scratch_.path() / "sweep/runs.csv");
  // As an interruption leaves it: one run half written, one missing.
  std::filesystem::resize_file(scratch_.path() / "sweep/0000-1/recording.ktrec", 2000);
  again[3] = "1..3";
  again.insert(again.end(), {"--resume", scratch_ / "sweep"});
  const auto kept = std::filesystem::last_write_time(scratch_.path() / "sweep/0000-2/summary.json");
  const Outcome outcome = kilotwin(again, scratch_);
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("1 of 3 runs were done before"), std::string::npos) << outcome.err;
  EXPECT_EQ(kept, std::filesystem::last_write_time(scratch_.path() / "sweep/0000-2/summary.json"));
  const std::string more = read(scratch_.path() / "sweep/runs.csv");
  EXPECT_EQ(more.substr(0, csv.size()), csv) << "more seeds into the same table";
  again.insert(again.end(), {"--define", "X=1"});
  EXPECT_EQ(kilotwin(again, scratch_).status, 2) << "another sweep";
}

TEST_F(Observations, FailuresNameRobotTimeAndPlace) {
  for (const char* mode : {"local", "federated"}) {
    const Outcome outcome = kilotwin({"run", scratch_ / "plain.txtpb", "--mode", mode, "--define", "FAULT",
                                      "--strict", "--quiet", "--out", scratch_ / mode},
                                     scratch_);
    EXPECT_EQ(outcome.status, 1) << outcome.err;
    EXPECT_NE(outcome.err.find("1 of 9 robots failed"), std::string::npos) << outcome.err;
    const auto json = nlohmann::json::parse(read(scratch_.path() / mode / "summary.json"));
    ASSERT_EQ(json.at("failures").size(), 1u);
    const auto& failure = json.at("failures")[0];
    EXPECT_EQ(failure.at("robot"), 3);
    EXPECT_NEAR(failure.at("time_s").get<double>(), 50 * 0.032768, 0.1);
    EXPECT_NE(failure.at("what").get<std::string>().find("observed.c:"), std::string::npos) << failure.dump();
  }
}

TEST_F(Observations, MistakesAreNamedWithTheirPlace) {
  const std::pair<const char*, const char*> cases[] = {
      {"recording { variable { name: \"beat\" } }", "there are beats, note, scores"},
      {"recording { variable { name: \"beats[\" } }", "expected an index"},
      {"recording { variable { name: \"beats\" every_s: 0.001 } }", "shorter than a tick"},
      {"recording { variable { } }", "without a name"},
      {"observable { name: \"a\" value: \"mean(beats)\" }", "there is no \"beats\""},
      {"observable { name: \"msd\" value: \"1\" }", "taken"},
      {"observable { name: \"a b\" value: \"1\" }", "no name"},
  };
  for (const auto& [text, what] : cases) {
    write(scratch_.path() / "wrong.txtpb", std::string(kCountingExperiment) + text);
    const Outcome outcome = kilotwin({"check", scratch_ / "wrong.txtpb"}, scratch_);
    EXPECT_EQ(outcome.status, 2) << text;
    EXPECT_NE(outcome.err.find("wrong.txtpb:6:"), std::string::npos) << outcome.err;
    EXPECT_NE(outcome.err.find(what), std::string::npos) << outcome.err;
  }
}

TEST_F(Observations, CountersOfTheRadioAreVariables) {
  constexpr std::array kNames{"attempted", "sent", "received", "collided", "backed_off"};
  std::string experiment = std::string(kCountingExperiment) + "recording {\n";
  for (const char* name : kNames)
    experiment += std::string("  variable { name: \"radio_") + name + "\" every_s: 1 }\n";
  experiment += "}\nobservable { name: \"lost\" value: \"sum(radio_collided)\" }\n";
  write(scratch_.path() / "counted.txtpb", experiment);
  run({scratch_ / "counted.txtpb", "--mode", "local"}, scratch_, "local");
  run({scratch_ / "counted.txtpb"}, scratch_, "federated");
  const std::string csv = exported("local", "--variables");
  EXPECT_EQ(csv, exported("federated", "--variables"));
  const Table table = table_of(csv);
  ASSERT_EQ(table.size(), 9u * 6);
  // They ascend, and end at the counts of the whole run.
  const auto summary = nlohmann::json::parse(read(scratch_.path() / "local/summary.json"));
  std::map<std::string, std::map<std::string, std::uint64_t>> at;  // by counter and robot
  for (const auto& row : table) {
    for (const char* name : kNames) {
      std::uint64_t& before = at[name][row.at("robot")];
      const std::uint64_t now = std::stoull(row.at(std::string("radio_") + name));
      EXPECT_GE(now, before);
      before = now;
    }
  }
  for (const char* name : {"attempted", "sent", "received", "collided"}) {
    std::uint64_t sum = 0;
    for (const auto& [robot, count] : at[name]) sum += count;
    EXPECT_GT(sum + (name == std::string("collided") ? 1 : 0), 0u) << name;
    EXPECT_LE(sum, summary.at("messages").at(name).get<std::uint64_t>()) << name;
  }
  write(scratch_.path() / "taken.c", std::string("int radio_sent;\n") + kCountingProgram);
  std::string taken = experiment;
  taken.replace(taken.find("observed.c"), 10, "taken.c");
  write(scratch_.path() / "taken.txtpb", taken);
  const Outcome outcome = kilotwin({"check", scratch_ / "taken.txtpb"}, scratch_);
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.err.find("radio_sent is a counter of the radio"), std::string::npos) << outcome.err;
}

TEST_F(Observations, FirmwareRobotsHaveVariablesToo) {
  write(scratch_.path() / "avr.txtpb",
        std::string(kCountingExperiment) +
            "robots { count: 2 avr: true behaviour: \"observed.c\" first_uid: 20 layout { x_mm: 200 "
            "y_mm: 200 grid { pitch_mm: 50 } } }" +
            kRecording);
  run({scratch_ / "avr.txtpb", "--mode", "local"}, scratch_, "avr");
  int seen = 0;
  for (const auto& row : table_of(exported("avr", "--variables"))) {
    if (row.at("group") != "1" || std::stod(row.at("time_s")) < 3 || row.at("scores[1]").empty()) continue;
    EXPECT_EQ(std::stoi(row.at("scores[1]")), (std::stoi(row.at("robot")) - 9 + 20) * 10 - 4);
    EXPECT_GT(std::stoi(row.at("beats")), 0);
    ++seen;
  }
  EXPECT_GT(seen, 0);
}

}  // namespace
}  // namespace kilotwin::test
