// Cells of a Kilogrid in whole runs: who hears whom, nothing in the robots' way, one hash for every division, and bad input.
#include <gtest/gtest.h>

#include <map>
#include <sstream>

#include "tests/system/program.hpp"

namespace kilotwin::test {
namespace {

/// Columns of an exported table by name, as text, per robot: the last row counts.
std::map<int, std::map<std::string, std::string>> last_rows(const std::string& table) {
  std::map<int, std::map<std::string, std::string>> result;
  std::istringstream lines(table);
  std::vector<std::string> names;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with('#')) continue;
    std::vector<std::string> fields;
    std::istringstream row(line);
    for (std::string field; std::getline(row, field, ',');) fields.push_back(field);
    if (names.empty()) {
      names = fields;
      continue;
    }
    std::map<std::string, std::string> named;
    for (std::size_t i = 0; i < names.size() && i < fields.size(); ++i) named[names[i]] = fields[i];
    result[std::stoi(named["robot"])] = named;
  }
  return result;
}

/// 4 x 4 cells of 50 mm, with the colours 1 to 16 of modules from the bottom left. Robots 0 and 1 stand at the middle of cells,
/// robot 2 stands at a cell's corner, robot 3 drives to the right along the top row.
class KilogridCells : public testing::Test {
 protected:
  KilogridCells() {
    write(
        scratch.path() / "robot.c",
        "#include <kilolib.h>\n#include <utils.h>\n#include <kilob_tracking.h>\n"
        "static tracking_user_data_t report;\n"
        "static void rx(IR_message_t* m, distance_measurement_t* d) { if (m->type == 32) set_color(m->data[0]); }\n"
        "static void setup(void) { kilob_tracking_init(); report.byte[0] = 100 + kilo_uid; }\n"
        "static void loop(void) { kilob_tracking(&report); if (kilo_uid == 3) move_straight(); }\n"
        "int main(void) { kilo_init(); utils_init(); utils_message_rx = rx; kilo_start(setup, loop); return 0; "
        "}\n");
    write(scratch.path() / "module.c",
          "#include <module.h>\n#include <moduleIR.h>\n#include <CAN.h>\n"
          "static void rx(IR_message_t* m, cell_num_t c, distance_measurement_t* d, uint8_t wrong) {\n"
          "  CAN_message_t* can = m->type == TRACKING ? next_CAN_message() : 0;\n"
          "  if (can) serialize_tracking_message(can, c, (tracking_user_data_t*)m->data);\n}\n"
          "static void setup(void) { for (int c = 0; c < configuration_size; ++c) { IR_message_t m; "
          "init_IR_message(&m);\n"
          "  m.type = 32; m.data[0] = configuration[c]; set_IR_message(&m, (cell_num_t)c); } }\n"
          "static void loop(void) {}\n"
          "int main(void) { module_init(); module_IR_message_rx = rx; module_start(setup, loop); return 0; }\n");
    write(scratch.path() / "poses.csv", "x_mm,y_mm,heading_rad\n-25,25,0\n75,-75,0\n0,-26,0\n-75,75,0\n");
    write(scratch.path() / "colours.kconf",
          "# overwritten below\naddress\nx:0-1\ndata\n0x3f\n\naddress\nmodule:0-0\n\ndata\n0x01\n0x02\n0x03\n0x04\n"
          "address\nmodule:1-0\ndata\n0x05\n0x06\n0x07\n0x08\naddress\nmodule:0-1\ndata\n0x09\n0x0a\n0x0b\n0x0c\n"
          "address\ny:1\nmodule:1-1\ndata\n0x0d\n0x0e\n0x0f\n0x10\naddress\nmodule:0-"
          "1\ndata\n0x09\n0x0a\n0x0b\n0x0c\n");
    write_experiment(kCells);
  }
  void write_experiment(const std::string& cells) const {
    write(scratch.path() / "grid.txtpb",
          "duration_s: 40 seed: 5 arena { width_mm: 300 height_mm: 300 } motion { noise: false }\n"
          "robots { behaviour: \"robot.c\" layout { poses { csv: \"poses.csv\" } } }\n" +
              cells);
  }
  [[nodiscard]] std::map<int, std::map<std::string, std::string>> end_of(const std::string& name) const {
    const Outcome outcome = kilotwin({"export", scratch / name, "--trajectories", "-"}, scratch);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    return last_rows(outcome.out);
  }
  static int colour(const std::map<std::string, std::string>& row) {
    return std::stoi(row.at("led_r")) + 4 * std::stoi(row.at("led_g")) + 16 * std::stoi(row.at("led_b"));
  }

  static constexpr const char* kCells =
      "robots { count: 16 behaviour: \"module.c\" cells { configuration: \"colours.kconf\" }\n"
      "  layout { grid { columns: 4 pitch_mm: 50 heading: HEADING_FIXED } } }\n";
  Scratch scratch;
};

TEST_F(KilogridCells, RobotsHearTheCellBelowThemAndCellsTheRobotsAbove) {
  (void)run({scratch / "grid.txtpb", "--mode", "local"}, scratch, "run");
  const auto end = end_of("run");
  // Cells 0 to 3 of a module are its top left, top right, bottom left and bottom right.
  EXPECT_EQ(colour(end.at(0)), 0x0c);  // column 1, row 2 from below: module 0-1, cell 3
  EXPECT_EQ(colour(end.at(1)), 0x08);  // column 3, row 0: module 1-0, cell 3
  EXPECT_EQ(colour(end.at(2)), 0x05);  // x = 0 is the left border of column 2, row 1: module 1-0, cell 0
  EXPECT_EQ(colour(end.at(3)), std::stod(end.at(3).at("x_mm")) < 50 ? 0x0d : 0x0e);
  const auto reports = [&](int cell) {
    const std::string name = "run/logs/robot-000" + std::to_string(cell / 10) + std::to_string(cell % 10) + ".txt";
    return std::filesystem::exists(scratch / name) ? read(scratch / name) : std::string();
  };
  // Cells are robots 4 to 19, row by row from the top left.
  EXPECT_NE(reports(4 + 5).find("tracking 0 1 3 100 "), std::string::npos);
  EXPECT_NE(reports(4 + 15).find("tracking 1 0 3 101 "), std::string::npos);
  EXPECT_NE(reports(4 + 10).find("tracking 1 0 0 102 "), std::string::npos);
  for (const int beside : {6, 9, 12, 13}) EXPECT_EQ(reports(4 + beside), "") << beside;
}

TEST_F(KilogridCells, CountApartFromRobots) {
  const recorder::Summary summary = run({scratch / "grid.txtpb", "--mode", "local"}, scratch, "run");
  EXPECT_EQ(summary.robots, 4u);
  EXPECT_EQ(summary.cells, 16u);
  EXPECT_EQ(summary.per_robot.robots, 4u);
  // One robot of four drives; cells would bring the mean to a fifth of it.
  EXPECT_NEAR(summary.moved_mm.mean, summary.moved_mm.max / 4, 0.01 * summary.moved_mm.max);
}

TEST_F(KilogridCells, TheLibraryCanBeNamed) {
  write(scratch.path() / "plain.c",
        "#include <kilolib.h>\nstatic void setup(void) {}\n"
        "static void loop(void) { set_color(TRACKING & 3); }\n"
        "int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }\n");
  write(scratch.path() / "plain.txtpb", "duration_s: 1 robots { count: 1 behaviour: \"plain.c\" }\n");
  const std::string experiment = scratch / "plain.txtpb";
  EXPECT_EQ(kilotwin({"check", experiment}, scratch).status, 2) << "kilolib has no TRACKING";
  EXPECT_EQ(kilotwin({"check", experiment, "--kilolib", "kilogrid"}, scratch).status, 0);
  EXPECT_EQ(kilotwin({"check", experiment, "--kilolib", "kilogird"}, scratch).status, 2);
}

TEST_F(KilogridCells, BlockNobody) {
  (void)run({scratch / "grid.txtpb", "--mode", "local"}, scratch, "with");
  write_experiment("");
  (void)run({scratch / "grid.txtpb", "--mode", "local"}, scratch, "without");
  const auto with = end_of("with"), without = end_of("without");
  EXPECT_GT(std::stod(with.at(3).at("x_mm")), -20);
  for (const char* const column : {"x_mm", "y_mm", "heading_rad"}) {
    for (int robot = 0; robot < 4; ++robot)
      EXPECT_EQ(with.at(robot).at(column), without.at(robot).at(column)) << robot;
  }
}

TEST_F(KilogridCells, GiveOneHashForEveryDivision) {
  const auto whole =
      run({scratch / "grid.txtpb", "--mode", "local", "--checkpoint-every", "15"}, scratch, "whole").state_hash;
  EXPECT_EQ(
      run({scratch / "grid.txtpb", "--mode", "local", "--partitions", "2x2", "--hosts", "3"}, scratch, "parts")
          .state_hash,
      whole);
  EXPECT_EQ(run({scratch / "grid.txtpb", "--partitions", "2x1", "--hosts", "2", "--resume", scratch / "whole"},
                scratch, "resumed")
                .state_hash,
            whole);
  // The run directory can run again by itself.
  EXPECT_EQ(run({scratch / "whole/experiment.txtpb", "--mode", "local"}, scratch, "again").state_hash, whole);
}

TEST_F(KilogridCells, WrongInputIsNamedWithItsLine) {
  const auto refusal = [&](const std::string& kconf, const std::string& cells) {
    write(scratch.path() / "colours.kconf", kconf);
    write_experiment(cells);
    const Outcome outcome = kilotwin({"check", scratch / "grid.txtpb"}, scratch);
    EXPECT_EQ(outcome.status, 2) << cells;
    return outcome.err;
  };
  EXPECT_NE(refusal("address\nmodule:2-0\n", kCells).find("colours.kconf:2:1: there is no module 2-0"),
            std::string::npos);
  EXPECT_NE(refusal("address\ncell:0-0\n", kCells).find("colours.kconf:2:1: cell:0-0 is no address"),
            std::string::npos);
  EXPECT_NE(refusal("address\nx:0\ndata\n0x1g\n", kCells).find("colours.kconf:4:1: 0x1g is no octet"),
            std::string::npos);
  EXPECT_NE(refusal("data\n", kCells).find("colours.kconf:1:1: data without an address"), std::string::npos);
  EXPECT_NE(refusal("", std::string(kCells) + "radio { model: SIMPLE }\n").find("DISC"), std::string::npos);
  std::string odd = kCells;
  odd.replace(odd.find("columns: 4"), 10, "columns: 3");
  EXPECT_NE(refusal("", odd).find("cells lie in a full grid"), std::string::npos);
}

}  // namespace
}  // namespace kilotwin::test
