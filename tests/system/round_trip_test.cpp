// `identify` reads the exports of runs, and further runs take the model that `identify` writes.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/system/program.hpp"

namespace kilotwin::test {
namespace {

namespace fs = std::filesystem;

constexpr double kTick_s = 0.032768;

/// `sets` counts up in the tick in which the motors are set.
constexpr const char* kProgram = R"(
#include <kilolib.h>
uint16_t sets;
static void drive(uint8_t left, uint8_t right) { ++sets; set_motors(left, right); }
static void setup(void) {}
static void loop(void) {
  switch (kilo_ticks % 192) {
    case 32: drive(kilo_straight_left, kilo_straight_right); break;
    case 96: drive(kilo_turn_left, 0); break;
    case 128: drive(0, kilo_turn_right); break;
    case 160: drive(0, 0); break;
  }
}
int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }
)";

/// Cells of CSV rows after the header.
std::vector<std::vector<std::string>> rows_of(const fs::path& file) {
  std::istringstream in(read(file));
  std::vector<std::vector<std::string>> rows;
  std::string line;
  std::getline(in, line);
  while (std::getline(in, line)) {
    std::istringstream cells(line);
    rows.emplace_back();
    for (std::string cell; std::getline(cells, cell, ',');) rows.back().push_back(cell);
  }
  return rows;
}

class RoundTrip : public testing::Test {
 protected:
  void SetUp() override {
    write(scratch.path() / "walk.c", kProgram);
    write(scratch.path() / "walk.txtpb",
          "name: \"walk\" duration_s: 60 arena { width_mm: 3000 height_mm: 3000 }\n"
          "robots { count: 6 behaviour: \"walk.c\" loop_rate: ONCE_PER_TICK layout { grid { pitch_mm: 300 } } }\n"
          "recording { every_s: 0.5 event: MOTION variable { name: \"sets\" every_s: 0.032768 } }\n");
    run({scratch / "walk.txtpb", "--mode", "local"}, scratch, "run");
    fs::create_directory(scratch / "measured");
    const Outcome outcome =
        kilotwin({"export", scratch / "run", "--trajectories", scratch / "measured/walk-1.csv", "--every", "0.5",
                  "--commands", scratch / "measured/commands.csv", "--variables", scratch / "sets.csv"},
                 scratch);
    ASSERT_EQ(outcome.status, 0) << outcome.err;
  }
  Scratch scratch;
};

TEST_F(RoundTrip, CommandsHaveTheTicksAtWhichTheProgramSetTheMotors) {
  std::map<std::string, std::vector<double>> changed_s;
  std::map<std::string, std::string> before;
  for (const auto& row : rows_of(scratch / "sets.csv")) {
    if (before.count(row[1]) != 0 && before[row[1]] != row[3]) changed_s[row[1]].push_back(std::stod(row[0]));
    before[row[1]] = row[3];
  }
  std::map<std::string, std::size_t> seen;
  std::size_t commands = 0;
  for (const auto& row : rows_of(scratch / "measured/commands.csv")) {
    if (row[2] == "0") continue;  // before the first command all stand
    ASSERT_LT(seen[row[1]], changed_s[row[1]].size());
    EXPECT_NEAR(std::stod(row[2]), changed_s[row[1]][seen[row[1]]++], 0.1 * kTick_s) << "robot " << row[1];
    ++commands;
  }
  EXPECT_GT(commands, 6u * 30);
}

TEST_F(RoundTrip, DrawsOfTheIdentifiedModelAreModels) {
  const Outcome outcome =
      kilotwin({"identify", "--train", scratch / "measured", "--out", scratch / "found", "--draws", "3", "--quiet"},
               scratch);
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto base = nlohmann::json::parse(read(scratch / "found/result.json")).at("base");
  EXPECT_EQ(base.at("command_lag_s"), 0);
  EXPECT_NEAR(base.at("straight_speed_mm_s").get<double>() / base.at("wheel_base_mm").get<double>(), 10.0 / 25,
              0.004)
      << "their common scale is not identifiable without contacts";
  const std::string fitted = read(scratch / "found/model.txtpb");
  std::vector<std::string> speeds;
  for (const char* name : {"model-01.txtpb", "model-02.txtpb", "model-03.txtpb"}) {
    const fs::path draw = scratch.path() / "found/draws" / name;
    const Outcome checked = kilotwin({"check", scratch / "walk.txtpb", "--model", draw.string()}, scratch);
    EXPECT_EQ(checked.status, 0) << checked.err;
    const std::string text = read(draw);
    const std::size_t at = text.find("straight_speed_mm_s");
    speeds.push_back(text.substr(at, text.find('\n', at) - at));
    EXPECT_EQ(fitted.find(speeds.back()), std::string::npos) << "a draw differs from the fit";
  }
  EXPECT_NE(speeds[0], speeds[1]);
  EXPECT_FALSE(fs::exists(scratch / "found/draws/model-04.txtpb"));
  const Outcome swept = kilotwin({"sweep", scratch / "walk.txtpb", "--duration", "2", "--models",
                                  scratch / "found/draws", "--out", scratch / "sweep"},
                                 scratch);
  ASSERT_EQ(swept.status, 0) << swept.err;
  EXPECT_EQ(rows_of(scratch / "sweep/designs.csv").at(0).at(1), "3");
}

/// The commands of each robot as (tick, motion), without those at the start.
std::map<std::string, std::vector<std::pair<long, std::string>>> commands_of(const fs::path& file) {
  std::map<std::string, std::vector<std::pair<long, std::string>>> commands;
  for (const auto& row : rows_of(file))
    if (row[2] != "0") commands[row[1]].emplace_back(std::lround(std::stod(row[2]) / kTick_s), row[3]);
  return commands;
}

TEST(PlannedRecording, IsPlayedToTheTick) {
  const Scratch scratch;
  fs::create_directory(scratch / "found");
  write(scratch.path() / "found/model.txtpb",
        "motion { straight_speed_mm_s: 10 turn_speed_mm_s: 20 wheel_base_mm: 25 }\n");
  write(scratch.path() / "found/result.json",
        R"({"base": {"straight_speed_mm_s": 10, "turn_speed_mm_s": 20, "wheel_base_mm": 25, "bias_sd_mm_s": 1.5},
            "base_sd": {"straight_speed_mm_s": 0.5}, "noise": {"tracker_position_sd_mm": 1, "tracker_heading_sd_rad": 0.05},
            "before": null, "robots": [{"robot": 0, "bias_left_mm_s": 0.5, "sd_left_mm_s": 0.2, "sd_right_mm_s": 0.2}]})");
  const Outcome planned = kilotwin({"identify", "--design", scratch / "found", "--robots", "3", "--duration", "30",
                                    "--arena", "900x900", "--out", scratch / "planned"},
                                   scratch);
  ASSERT_EQ(planned.status, 0) << planned.err;
  EXPECT_NE(planned.out.find("nat expected"), std::string::npos) << planned.out;
  const auto design = nlohmann::json::parse(read(scratch / "planned/design.json"));
  EXPECT_GE(design.at("information_nat"), design.at("random_information_nat"));
  for (const auto& parameter : design.at("parameters")) EXPECT_LT(parameter.at("sd_after"), parameter.at("sd_now"));

  run({scratch / "planned/planned.txtpb", "--mode", "local"}, scratch, "run");
  const Outcome exported = kilotwin({"export", scratch / "run", "--commands", scratch / "played.csv"}, scratch);
  ASSERT_EQ(exported.status, 0) << exported.err;
  const auto commands = commands_of(scratch / "planned/commands.csv");
  EXPECT_FALSE(commands.empty());
  EXPECT_EQ(commands_of(scratch / "played.csv"), commands);
}

TEST(PlannedRecording, RefusesOptionsThatDoNotBelongTogether) {
  const Scratch scratch;
  const auto refusal = [&](const Words& words) {
    const Outcome outcome = kilotwin(words, scratch);
    EXPECT_EQ(outcome.status, 2);
    return outcome.err;
  };
  EXPECT_NE(refusal({"identify"}).find("--train: give a directory"), std::string::npos);
  EXPECT_NE(refusal({"identify", "--train", "x", "--robots", "3"}).find("belongs to --design"), std::string::npos);
  EXPECT_NE(refusal({"identify", "--train", "x", "--design", "y"}).find("leave out --train"), std::string::npos);
  EXPECT_NE(refusal({"identify", "--design", scratch / "none"}).find("cannot be read"), std::string::npos);
}

}  // namespace
}  // namespace kilotwin::test
