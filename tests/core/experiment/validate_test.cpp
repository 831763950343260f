#include "core/experiment/limits.hpp"
#include "scratch.hpp"

namespace kilotwin::test {
namespace {

class Validate : public Scratch {};

struct Bad {
  std::string text, error;
};

/// A valid group, to which the cases add an error.
const std::string kGroup = "robots { count: 4 behaviour: 'a.c' }\n";

TEST_F(Validate, AcceptsTheSmallestExperiment) { EXPECT_EQ(check_error(kGroup), ""); }

// NOLINTNEXTLINE(readability-function-size): a table
TEST_F(Validate, OneLineForEveryMistake) {
  const Bad cases[] = {
      // Ranges; each field's own are tested below.
      {kGroup + "duration_s: -1", "e.txtpb:2:1: duration_s is -1; it takes a number, above 0, at most 1000000 s"},
      {kGroup + "duration_s: 0", "e.txtpb:2:1: duration_s is 0; it takes a number, above 0, at most 1000000 s"},
      {kGroup + "duration_s: nan", "e.txtpb:2:1: duration_s is nan; it takes a number, above 0, at most 1000000 s"},
      {kGroup + "radio { range_mm: inf }", "e.txtpb:2:9: range_mm is inf; it takes a number, above 33 mm"},
      {kGroup + "radio { range_mm: 1e999 }", "e.txtpb:2:9: range_mm is inf; it takes a number, above 33 mm"},
      {"robots {\n  count: 4\n  behaviour: 'a.c'\n  layout { grid {\n    pitch_mm: 32.9 } }\n}",
       "e.txtpb:5:5: pitch_mm is 32.9; it takes a number, 33..1000000 mm"},
      {"robots { count: 0 behaviour: 'a.c' }",
       "e.txtpb:1:10: count is 0; it takes a whole number, 1..100000 robots"},
      {kGroup + "deployment { partition_rows: 0 }",
       "e.txtpb:2:14: partition_rows is 0; it takes a whole number, 1..64"},
      {kGroup + "tick_cycles: 1000",
       "e.txtpb:2:1: tick_cycles is 1000; it takes a whole number, 32768..1048576 cycles"},
      // Names and text.
      {kGroup + "name: \"a b\"", "e.txtpb:2:1: name is \"a b\"; it takes 1 to 100 letters, digits, '-' and '_'"},
      {kGroup + "name: \"\"", "e.txtpb:2:1: name is empty; state it or leave it out"},
      {kGroup + "name: \"a\\n\"", "e.txtpb:2:1: name holds a control character; it takes plain text"},
      // Groups.
      {"seed: 3\n", "e.txtpb:1:1: there are 0 groups of robots; it takes 1..256, robots { ... }"},
      {"seed: 3\nrobots { behaviour: 'a.c' }",
       "e.txtpb:2:1: count is missing; state count: N, the number of robots"},
      {"robots { count: 60000 behaviour: 'a.c' }\nrobots { count: 60000 behaviour: 'a.c' }",
       "e.txtpb:1:1: the groups have 120000 robots together; an experiment takes 1..100000"},
      {"robots { count: 3 }",
       "e.txtpb:1:1: behaviour is missing; state behaviour: \"FILE.c\", the robots' program"},
      {"robots { count: 3 behaviour: 'a.c'\n  behaviour: 'b.c' }",
       "e.txtpb:2:3: there is no file b.c; name a program, relative to the experiment file"},
      {"robots { count: 3 behaviour: '.' }",
       "e.txtpb:1:19: there is no file .; name a program, relative to the experiment file"},
      {"robots { count: 3 behaviour: 'a.c' body: TRACKED }",
       "e.txtpb:1:19: a tracked group runs no program here; remove behaviour, or add says { shadow: true }"},
      // Layouts.
      {"robots { behaviour: 'a.c' layout { rings { count: [3, 4] radius_mm: 50 } } }",
       "e.txtpb:1:36: rings has 2 count and 1 radius_mm; give as many of one as of the other, at least one each"},
      {"robots { behaviour: 'a.c' layout { rings { count: [3,\n 0] radius_mm: [50, 90] } } }",
       "e.txtpb:1:44: count is 0; it takes a whole number, 1..100000 robots"},
      {"robots { behaviour: 'a.c' count: 5 layout { rings { count: [1, 3] radius_mm: [0, 50] } } }",
       "e.txtpb:1:27: count is 5 but the rings hold 4 robots; write 4 or leave count out"},
      {"robots { behaviour: 'a.c' layout { poses { } } }", "e.txtpb:1:36: csv is missing; state csv: \"FILE.csv\""},
      {"robots { count: 3 behaviour: 'a.c' layout { grid { heading_deg: 90 } } }",
       "e.txtpb:1:52: heading_deg has no effect here; add heading: HEADING_FIXED, or remove it"},
      // Arena and partitions.
      {kGroup + "arena { width_mm: 70 height_mm: 65 }",
       "e.txtpb:1:1: robot 0 at (-20, 20) mm reaches out of the arena; centres take x within +-18.5 mm and y "
       "within +-16 mm"},
      {kGroup + "arena { width_mm: 1000 }\ndeployment { partition_columns: 40 }",
       "e.txtpb:3:14: partition_columns is 40, which cuts the arena's width of 1000 mm into cells of 25 mm, "
       "smaller than a robot; "
       "it takes at most 30"},
      {kGroup + "deployment { hosts: 5 }", "e.txtpb:2:14: hosts is 5, more than there are robots; it takes 1..4"},
      // Features that an engine does not compute.
      {kGroup + "physics { tilt_deg: 3 }",
       "e.txtpb:2:11: tilt_deg is 3, but the floor of the PLANAR engine is level; add engine: ODE, or remove it"},
      {kGroup + "physics { engine: KINEMATIC\n downhill_deg: 3 }",
       "e.txtpb:3:2: downhill_deg is 3, but the floor of the KINEMATIC engine is level; add engine: ODE, or remove "
       "it"},
      {kGroup + "physics { engine: ODE }\nmotion { axle_offset_mm: 0 }",
       "e.txtpb:3:10: axle_offset_mm is 0, with which a robot of the ODE engine falls over its rear legs; it takes "
       "1..16.5 mm there"},
      // Times against the tick.
      {kGroup + "recording { every_s: 0.03 }",
       "e.txtpb:2:13: every_s is 0.03, shorter than a tick; it takes at least 0.032768 s"},
      {kGroup + "deployment { checkpoint_every_s: 0.01 }",
       "e.txtpb:2:14: checkpoint_every_s is 0.01, shorter than a tick; it takes 0 for none, or at least 0.032768 "
       "s"},
      // Station and model.
      {"robots { count: 1023 behaviour: 'a.c' }\nstation { environment { hub { } } }",
       "e.txtpb:2:11: environment is given with 1023 robots, but ARK's messages address 10-bit ids; it takes at "
       "most 1022 robots"},
      {kGroup + "station { environment { } }",
       "e.txtpb:2:11: environment has no kind; it takes hub, foraging or plugin { ... }"},
      {kGroup + "station { packet_interval_s: 0.01 }",
       "e.txtpb:2:11: packet_interval_s is 0.01; it takes 0, or at least 0.05 s"},
      {kGroup + "station { environment { plugin { } } }",
       "e.txtpb:2:25: plugin takes either source: \"FILE.cpp\" or built_in: \"NAME\""},
      {kGroup + "station { environment { plugin { built_in: 'hubs' } } }",
       "e.txtpb:2:34: built_in is \"hubs\"; it takes hub, foraging, identify, assign_ids, calibrate"},
      {kGroup + "station { environment { plugin { source: 'none.cpp' } } }",
       "e.txtpb:2:34: there is no file none.cpp; name a C++ file of the plugin, relative to the experiment file"},
      {kGroup + "station { environment { hub { } bits { count: 4 } } environment { hub { } } }",
       "e.txtpb:2:53: bits are given for some environments only; give them for all, or none"},
      {kGroup + "station { environment { hub { } bits { count: 4 } } environment { hub { } bits { first: 3 count: "
                "2 } } }",
       "e.txtpb:2:75: the bits overlap those of an environment above; each bit has one owner"},
      {kGroup + "station { environment { hub { } bits { first: 10 count: 5 } } }",
       "e.txtpb:2:33: bits 10..14 do not exist; a message has the bits 0..13"},
      {kGroup + "robot_model { bias_left_mm_s: 1 }",
       "e.txtpb:2:1: robot is missing; state robot: ID, the robot that the entry is about"},
      {kGroup + "robot_model { robot: 2 }\nrobot_model { robot: 2 }",
       "e.txtpb:3:1: robot 2 has an entry already, at e.txtpb:2:1; keep one of them"},
  };
  for (const auto& [text, error] : cases) EXPECT_EQ(check_error(text), error) << text;
}

TEST_F(Validate, ArkTakes1022Robots) {
  EXPECT_EQ(check_error("robots { count: 1022 behaviour: 'a.c' }\nstation { environment { hub { } } }"), "");
}

TEST_F(Validate, RobotsThatOverlapOrLieOutside) {
  const Bad cases[] = {
      {kGroup + kGroup,
       "e.txtpb:2:1: robot 4 at (-20, 20) mm overlaps robot 0 at (-20, 20) mm; keep centres at least 33 mm apart"},
      {"robots { behaviour: 'a.c'\n layout { rings { count: 2 radius_mm: 16.4 } } }",
       "e.txtpb:2:11: robot 1 at (-16.4, 0) mm overlaps robot 0 at (16.4, 0) mm; keep centres at least 33 mm "
       "apart"},
      {"robots { count: 1 behaviour: 'a.c' layout { x_mm: -984 } }",
       "e.txtpb:1:36: robot 0 at (-984, 0) mm reaches out of the arena; centres take x within +-983.5 mm and y "
       "within +-983.5 mm"},
      {"robots { count: 5 behaviour: 'a.c' layout { x_mm: 990 random { width_mm: 40 } } }",
       "e.txtpb:1:55: the rectangle has no room for a robot within the arena; move or widen it"},
  };
  for (const auto& [text, error] : cases) EXPECT_EQ(check_error(text), error) << text;
}

TEST_F(Validate, RobotsThatTouchAreValid) {
  EXPECT_EQ(check_error("robots { count: 400 behaviour: 'a.c' layout { grid { pitch_mm: 33 } } }\n"
                        "arena { width_mm: 660 height_mm: 660 }"),
            "");
}

TEST_F(Validate, ErrorsInPosesFilesNameTheirLine) {
  const Bad cases[] = {
      {"x_mm,y_mm\n1,2\n",
       "p.csv:1:1: the column heading_rad is missing, the header has x_mm, y_mm; write x_mm,y_mm,heading_rad or "
       "x_mm,y_mm,heading_deg"},
      {"x_mm,y_mm,heading_rad\n1,2,0\n50,x,0\n", "p.csv:3:4: y_mm is \"x\"; give a number"},
      {"x_mm,y_mm,heading_rad\n1,2,nan\n", "p.csv:2:5: heading_rad is \"nan\"; give a number"},
      {"x_mm,y_mm,heading_rad\n1e999,2,0\n", "p.csv:2:1: x_mm is \"1e999\"; give a number"},
      {"x_mm,y_mm,heading_rad\n1,,0\n", "p.csv:2:3: y_mm is \"\"; give a number"},
      {"x_mm,y_mm,heading_rad\r\n\r\n1,2\r\n", "p.csv:3:4: the row has 2 cells; the header names 3"},
      {"x_mm,y_mm,heading_deg\n1,2,3,4\n", "p.csv:2:7: the row has 4 cells; the header names 3"},
      {"x_mm,y_mm,heading_rad\n",
       "p.csv:2:1: there are no poses; the file takes the header x_mm,y_mm,heading_rad and a row per robot"},
      {"", "p.csv:1:1: is empty; the first line names the columns"},
      {"x_mm,y_mm,heading_rad\n0,0,0\n\n0,20,0\n",
       "p.csv:4:1: robot 1 at (0, 20) mm overlaps robot 0 at (0, 0) mm; keep centres at least 33 mm apart"},
      {"x_mm,y_mm,heading_rad\n1e300,0,0\n",
       "p.csv:2:1: robot 0 at (1e+300, 0) mm reaches out of the arena; centres take x "
       "within +-983.5 mm and y within +-983.5 mm"},
  };
  for (const auto& [csv, error] : cases) {
    write("p.csv", csv);
    EXPECT_EQ(check_error("robots { behaviour: 'a.c' layout { poses { csv: 'p.csv' } } }"), error) << csv;
  }
  write("p.csv", "x_mm,y_mm,heading_rad\n0,0,0\n0,40,0\n");
  EXPECT_EQ(check_error("robots {\n  count: 3 behaviour: 'a.c' layout { poses { csv: 'p.csv' } } }"),
            "e.txtpb:2:3: count is 3 but p.csv has 2 poses; write 2 or leave count out");
  EXPECT_EQ(
      check_error("robots { behaviour: 'a.c' layout { poses { csv: 'q.csv' } } }"),
      "e.txtpb:1:44: q.csv cannot be read (No such file or directory); name a file that exists and may be read");
}

}  // namespace
}  // namespace kilotwin::test
