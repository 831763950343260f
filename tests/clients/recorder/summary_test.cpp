#include "clients/recorder/summary.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/base/error.hpp"
#include "tests/clients/recorder/synthetic.hpp"

namespace kilotwin::recorder {
namespace {

Summary example() {
  Summary s;
  s.name = "disperse";
  s.seed = 18'446'744'073'709'551'615u;
  s.mode = "federated";
  s.partition_columns = 2;
  s.partition_rows = 3;
  s.hosts = 4;
  s.robots = 1000;
  s.ticks = 2000;
  s.resumed_from_tick = 500;
  s.recovered_from_tick = 400;
  s.simulated_s = 65.536;
  s.start_s = 0.25;
  s.wall_s = 4.9152;
  s.cpu_s = 9.5;
  s.peak_memory_mib = 120.5;
  s.state_hash = 0x00ab'cdef'0123'4567u;
  s.messages = {40, 30, 200, 10};
  s.robots_failed = 1;
  s.recoveries = 2;
  s.moved_mm = {12.5, 99};
  s.cost_ns_per_robot_tick = {300, 200, 500, 1, 100, 10};
  s.federates = {{"physics 0,0", 3, 0.5, 1}, {"radio", 1, 0.25, 3.25}};
  s.provenance = {"0.1.0", "0.1.0-0123", "2026-11-22T21:25:00Z", {"kilotwin", "run", "a b.txtpb"}, "lab", 2};
  return s;
}

TEST(Summary, HasTheFieldsOfTheContract) {
  const Scratch scratch;
  write_summary(example(), scratch / "summary.json");
  const auto json = nlohmann::json::parse(content(scratch / "summary.json"));
  EXPECT_EQ(json["name"], "disperse");
  EXPECT_EQ(json["seed"].get<std::uint64_t>(), 18'446'744'073'709'551'615u);
  EXPECT_EQ(json["mode"], "federated");
  EXPECT_EQ(json["partitions"], "2x3");
  EXPECT_EQ(json["robots"], 1000);
  EXPECT_EQ(json["ticks"], 2000);
  EXPECT_EQ(json["simulated_s"], 65.536);
  EXPECT_EQ(json["start_s"], 0.25);
  EXPECT_EQ(json["wall_s"], 4.9152);
  EXPECT_DOUBLE_EQ(json["realtime_factor"].get<double>(), 10);  // 1500 of 2000 ticks
  EXPECT_EQ(json["state_hash"], "00abcdef01234567");
  EXPECT_EQ(json["messages"],
            (nlohmann::json{{"attempted", 40}, {"sent", 30}, {"received", 200}, {"collided", 10}}));
  EXPECT_EQ(json["robots_failed"], 1);
  EXPECT_EQ(json["recoveries"], 2);
  EXPECT_EQ(json["cost_ns_per_robot_tick"], (nlohmann::json{{"behaviours", 300.0},
                                                            {"physics", 200.0},
                                                            {"radio", 500.0},
                                                            {"station", 1.0},
                                                            {"exchange", 100.0},
                                                            {"recording", 10.0}}));
  EXPECT_EQ(json["cpu_s"], 9.5);
  EXPECT_EQ(json["peak_memory_mib"], 120.5);
  EXPECT_EQ(json["hosts"], 4);
  EXPECT_EQ(json["resumed_from_tick"], 500);
  EXPECT_EQ(json["moved_mm"], (nlohmann::json{{"mean", 12.5}, {"max", 99.0}}));
  EXPECT_EQ(json["recovered_from_tick"], 400);
  EXPECT_EQ(json["version"], "0.1.0");
  EXPECT_EQ(json["command_line"], (std::vector<std::string>{"kilotwin", "run", "a b.txtpb"}));
  EXPECT_EQ(json["cores"], 2);
  EXPECT_TRUE(json.contains("failures"));
  EXPECT_EQ(json["federates"][1],
            (nlohmann::json{{"name", "radio"}, {"step_s", 1.0}, {"exchange_s", 0.25}, {"wait_s", 3.25}}));
  EXPECT_FALSE(json.contains("messages_per_robot"));  // without counts of robots
  EXPECT_EQ(json.size(), 29u);
}

/// A failed run with trackers, a virtual environment, a pace, a monitor and observables.
Summary rich_example() {
  Summary s = example();
  s.failure = "physics 0,0: killed";
  s.failures = {{7, 1.5, "stack overflow at a.c:3"}};
  s.robots = 2;
  s.per_robot.add({.attempted = 5, .sent = 4, .received = 3, .collided = 2, .backed_off = 1});
  s.per_robot.add({.attempted = 8, .sent = 8, .received = 8, .collided = 0, .backed_off = 0});
  s.observables = {{"lit", 0.5}, {"heard", std::nan("")}};
  s.paced = true;
  s.lateness = {12, 0.25};
  s.station = {100, 80, 20, 3, 1, 40, 0.5, 1, 2, {{"walk", ""}, {"fields", "slow"}}};
  s.tracked = true;
  s.tracking.joined = 2;
  s.tracking.lost = 1;
  s.tracking.effect_p50_s = 0.0625;
  s.tracking.trackers = {{"camera", 50, 2, 1, 1, 0.5, 3, 0.125, 0.25, 0.5, 1}};
  s.monitor = R"({"alarms":1})";
  return s;
}

TEST(Summary, ReadsBackItsFields) {
  const Scratch scratch;
  write_summary(rich_example(), scratch / "a.json");
  write_summary(read_summary(scratch / "a.json"), scratch / "b.json");
  EXPECT_EQ(content(scratch / "a.json"), content(scratch / "b.json"));
  EXPECT_EQ(read_summary(scratch / "a.json").state_hash, 0x00ab'cdef'0123'4567u);
  // No other file remains.
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(scratch.path()), {}), 2);
}

TEST(Summary, RefusesOtherFiles) {
  const Scratch scratch;
  const auto refused = [&](const std::string& text) {
    put_content(scratch / "s.json", text);
    try {
      (void)read_summary(scratch / "s.json");
    } catch (const UserError& error) {
      const std::string line = error.what();
      return line.rfind((scratch / "s.json").string() + ": not a summary; ", 0) == 0 &&
             line.find('\n') == std::string::npos;
    }
    return false;
  };
  EXPECT_TRUE(refused(""));
  EXPECT_TRUE(refused("[1, 2]"));
  EXPECT_TRUE(refused("{\"name\": 3}"));
  write_summary(example(), scratch / "a.json");
  const std::string text = content(scratch / "a.json");
  for (const std::string field : {"name", "seed", "partitions", "state_hash", "recoveries", "collided", "wall_s"}) {
    std::string wrong = text;
    wrong.replace(wrong.find('"' + field + '"'), field.size() + 2, "\"other\"");
    EXPECT_TRUE(refused(wrong)) << field;
  }
  std::string wrong = text;
  wrong.replace(wrong.find("00abcdef"), 8, "00abcdeg");
  EXPECT_TRUE(refused(wrong));
  EXPECT_THROW((void)read_summary(scratch / "none.json"), UserError);
}

TEST(Summary, RunsWithoutTimeHaveNoInfinities) {
  const Scratch scratch;
  const Summary empty;
  write_summary(empty, scratch / "s.json");
  EXPECT_EQ(nlohmann::json::parse(content(scratch / "s.json"))["realtime_factor"], 0.0);
}

TEST(Summary, TextSummarisesTheRunInFewLines) {
  Summary s = example();
  for (const bool local : {false, true}) {
    if (local) s.mode = "local";
    const std::string text = summary_text(s, "runs/disperse-1");
    const auto lines = std::count(text.begin(), text.end(), '\n');
    EXPECT_GE(lines, 8);
    EXPECT_LE(lines, 12);
    for (const char* const fact :
         {"disperse", "1000 robots", "65.5 simulated s", "10.0 times real time", "12.5 mm", "99.0 mm",
          "30 sent of 40", "10 (4.76 %)", "1 robot\n", "1111 ns", "radio 500, behaviours 300", "00abcdef01234567",
          "runs/disperse-1", "resumed from tick 500"}) {
      EXPECT_NE(text.find(fact), std::string::npos) << fact << " in\n" << text;
    }
    EXPECT_EQ(text.find("2x3 partitions") != std::string::npos, !local);
  }
}

}  // namespace
}  // namespace kilotwin::recorder
