// Programs as published in repositories: several files, copies of kilolib, C++, dialects of other simulators; and printing.
#include <gtest/gtest.h>

#include <algorithm>

#include "core/base/error.hpp"
#include "core/logs/robot_logs.hpp"
#include "core/os/files.hpp"
#include "core/os/process.hpp"
#include "idl/manifest.pb.h"
#include "services/behaviours/robot_warnings.hpp"
#include "tests/services/behaviours/swarm.hpp"

namespace kilotwin::behaviours::test {
namespace {

namespace fs = std::filesystem;

/// The LED after three ticks of one robot.
std::uint8_t led_of(const fs::path& source) {
  Swarm swarm({source.string()}, 1);
  swarm.start();
  swarm.steps(3);
  return swarm.led(0);
}

TEST(Dialects, CopiesOfKilolibAreIgnored) {
  const Folder folder;
  folder.write("kilolib/kilolib.h", "#error the copy\nextern volatile uint32_t kilo_ticks;\n");
  folder.write("kilolib/debug.h", "#error the copy\nvoid debug_init();\n");
  folder.write("src/local.h", "#include \"../kilolib/kilolib.h\"\n#define COLOUR 5\n");
  const fs::path source = folder.write(
      "src/a.c",
      "#include \"local.h\"\n#include \"missing/kilolib/message.h\"\n#include \"../kilolib/debug.h\"\n"
      "message_t m; void setup() { debug_init(); } void loop() { printf(\"x\"); set_color(COLOUR); }\n" +
          kMain);
  const CompiledProgram program = compile({source}, cached());
  EXPECT_TRUE(mentions(program.notes, "kilolib.h: left aside"));
  EXPECT_TRUE(mentions(program.notes, "debug.h: left aside"));
  EXPECT_EQ(led_of(source), 5);
  // A user's file with such a name is used.
  folder.write("src/debug.h", "#define COLOUR 9\n");
  EXPECT_EQ(led_of(folder.write("src/b.c",
                                "#include <kilolib.h>\n#include \"debug.h\"\nvoid setup() {} void loop() { "
                                "set_color(COLOUR); }\n" +
                                    kMain)),
            9);
  // Kilolib's own source among those of the program.
  const fs::path kilolib =
      folder.write("kilolib/kilolib.c", "#error the copy\nvoid kilo_start(void (*s)(), void (*l)()) {}\n");
  EXPECT_TRUE(mentions(compile({source, kilolib}, cached()).notes, "kilolib.c: left aside"));
}

TEST(Dialects, ErrorsInPreparedSourcesKeepTheirPlace) {
  const Folder folder;
  folder.write("kilolib.h", "extern volatile uint32_t kilo_ticks;\n");
  const fs::path source =
      folder.write("a.c", "#include \"kilolib.h\"\nvoid setup() {}\nvoid loop() { wrong; }\n" + kMain);
  try {
    (void)compile({source}, cached());
    ADD_FAILURE() << "no error";
  } catch (const UserError& error) {
    EXPECT_TRUE(std::string(error.what()).starts_with(source.string() + ":3:15: error: 'wrong' undeclared"))
        << error.what();
  }
}

TEST(Dialects, SourcesAndHeadersThatAMakefileWouldNameAreFound) {
  const Folder folder;
  folder.write("project/include/light.h", "extern int colour; int next(int);\n");
  folder.write("project/lib/light.c", "#include \"light.h\"\nint colour = 3; int next(int c) { return c + 1; }\n");
  folder.write("project/lib/other.c", "int main(void) { return 0; }\nint next(int c) { return 0; }\n");
  const fs::path source = folder.write(
      "project/src/a.c",
      "#include <kilolib.h>\n#include \"light.h\"\nvoid setup() {} void loop() { set_color(next(colour)); }\n" +
          kMain);
  const CompiledProgram program = compile({source}, cached());
  EXPECT_TRUE(mentions(program.notes, "light.h: found")) << program.notes.size();
  EXPECT_TRUE(mentions(program.notes, "light.c: compiled too"));
  EXPECT_FALSE(mentions(program.notes, "other.c"));
  EXPECT_EQ(led_of(source), 4);
}

TEST(Dialects, AProjectIsSearchedFromItsTop) {
  const Folder folder;
  folder.write("project/README.md", "A project.\n");
  folder.write("project/lib/robot/light.h", "#define COLOUR 6\n");
  folder.write("light.h", "#define COLOUR 1\n");
  const std::string text =
      "#include <kilolib.h>\n#include <light.h>\nvoid setup() {} void loop() { set_color(COLOUR); }\n" + kMain;
  const fs::path deep = folder.write("project/src/programs/first/robot/a.c", text);
  EXPECT_TRUE(mentions(compile({deep}, cached()).notes, "light.h: found for #include <light.h>"));
  EXPECT_EQ(led_of(deep), 6);
  // Without a top, no farther than two folders above.
  EXPECT_THROW((void)compile({folder.write("other/src/programs/first/a.c", text)}, cached()), UserError);
}

TEST(Dialects, FunctionsWhoseNamesMacrosMakeAreFound) {
  const Folder folder;
  folder.write("state.h", "#define NAME(state) on_##state\nint NAME(idle)(void);\n");
  folder.write("states/idle.c", "#include \"state.h\"\nint NAME(idle)(void) { return 3; }\n");
  folder.write("states/template.c", "#include \"state.h\"\nint NAME(other)(void) { return 4; }\n");
  const fs::path source = folder.write(
      "a.c",
      "#include <kilolib.h>\n#include \"state.h\"\nvoid setup() {} void loop() { set_color(NAME(idle)()); }\n" +
          kMain);
  const CompiledProgram program = compile({source}, cached());
  EXPECT_TRUE(mentions(program.notes, "idle.c: compiled too"));
  EXPECT_FALSE(mentions(program.notes, "template.c"));
  EXPECT_EQ(led_of(source), 3);
}

TEST(Dialects, AMissingFunctionIsAnError) {
  const Folder folder;
  folder.write("huge.c", "int operator_plus;\nint others[] = {" + std::string(300'000, '1') + "};\n");
  for (const char* name : {"a.c", "a.cpp"}) {
    const fs::path source = folder.write(name,
                                         "#include <kilolib.h>\nint elsewhere(int);\n"
                                         "void setup() {} void loop() { set_color(elsewhere(1)); }\n" +
                                             kMain);
    try {
      (void)compile({source}, cached());
      ADD_FAILURE() << "no error";
    } catch (const UserError& error) {
      EXPECT_NE(std::string(error.what()).find("undefined reference to `elsewhere"), std::string::npos)
          << error.what();
    }
  }
}

TEST(Dialects, Cpp) {
  const Folder folder;
  const fs::path source =
      folder.write("a.cpp",
                   "#include <kilolib.h>\n#include <stdlib.h>\nstruct Counter { int count; Counter() : count(40) "
                   "{} virtual int next() { return ++count; } virtual ~Counter() {} };\n"
                   "struct Half : Counter { int next() override { return count += 2; } };\n"
                   "static Half half; static Counter* any = &half;\n"
                   "void setup() { int* p = new int(1); delete p; static Counter late; any = late.count == 40 ? "
                   "any : nullptr; }\n"
                   "void loop() { set_color(any->count == 40 ? any->next() : 42); }\n" +
                       kMain);
  EXPECT_EQ(compile({source}, cached()).notes.size(), 0u);
  Swarm swarm({"#include <kilolib.h>\nvoid f() {}\nint main() { kilo_init(); kilo_start(f, f); }\n"}, 1);
  proto::Manifest manifest = swarm.plan->manifest();
  const CompiledProgram program = compile({source}, cached());
  manifest.mutable_program(0)->set_sha256(program.sha256);
  swarm.folder.write("programs/" + program.sha256 + ".so", os::read_if_there(program.file).value());
  swarm.hosts.clear();
  swarm.programs.reset();
  swarm.plan = std::make_unique<RunPlan>(manifest);
  swarm.programs = ProgramSet::load(*swarm.plan, swarm.folder.path());
  swarm.hosts.push_back(std::make_unique<BehavioursEngine>(*swarm.plan, HostId{0}, swarm.programs));
  swarm.start();
  swarm.steps(3);
  EXPECT_EQ(swarm.led(0), 42);
}

TEST(Dialects, CppAndCDrawTheSameRandomNumbers) {
  const std::string body =
      "#include <kilolib.h>\n#include <stdlib.h>\nvoid setup() { uint32_t state = 7; srand(7);\n"
      "  set_color(rand() == rand_r(&state) && rand() == rand_r(&state) ? 9 : 1); }\n"
      "void loop() {}\n" +
      kMain;
  for (const char* const name : {"a.c", "a.cpp"}) {
    const Folder folder;
    Swarm swarm({folder.write(name, body).string()}, 1);
    swarm.start();
    EXPECT_EQ(swarm.led(0), 9) << name;
  }
}

TEST(Dialects, KilomboProgramsRunAsOnTheRobot) {
  const Folder folder;
  const fs::path source =
      folder.write("a.c",
                   "#include <kilombo.h>\n#ifdef SIMULATOR\n#error not first\n#endif\n#include "
                   "<jansson.h>\ntypedef struct { uint8_t colour; } USERDATA;\nREGISTER_USERDATA(USERDATA)\n"
                   "json_t* json_state() { json_t* s = json_object(); json_object_set_new(s, \"c\", "
                   "json_integer(mydata->colour)); return s; }\n"
                   "void setup() { mydata->colour = kilo_uid + 1; } void loop() { set_color(mydata->colour); }\n"
                   "int main() { kilo_init(); SET_CALLBACK(json_state, json_state); SET_CALLBACK(reset, setup); "
                   "kilo_start(setup, loop); return 0; }\n");
  Swarm swarm({source.string()}, 3);
  swarm.start();
  swarm.steps(3);
  for (std::uint32_t robot = 0; robot < 3; ++robot) EXPECT_EQ(swarm.led(robot), robot + 1);
}

TEST(Dialects, KilombosUserDataIsTheSecondAttempt) {
  const Folder folder;
  const fs::path source = folder.write(
      "a.c",
      "#include <kilolib.h>\ntypedef struct { uint8_t colour; } USERDATA;\nextern USERDATA* mydata;\nextern char* "
      "(*callback_botinfo)(void); char* info(void) { return \"\"; }\n"
      "#ifdef SIMULATOR\nint UserdataSize = sizeof(USERDATA);\nUSERDATA* mydata;\n#endif\n"
      "void setup() { mydata->colour = 7; callback_botinfo = info; } void loop() { set_color(mydata->colour); }\n" +
          kMain);
  EXPECT_TRUE(mentions(compile({source}, cached()).notes, "SIMULATOR"));
  EXPECT_EQ(led_of(source), 7);
}

TEST(Dialects, KilombosUserDataWorksWithoutItsHeader) {
  const Folder folder;
  const std::string text =
      "typedef struct { uint8_t colour; } USERDATA;\nREGISTER_USERDATA(USERDATA)\n"
      "void setup() { mydata->colour += 4; } void loop() { set_color(mydata->colour); }\n" +
      kMain;
  EXPECT_EQ(
      led_of(folder.write("own.c",
                          "#include <kilolib.h>\n#define REGISTER_USERDATA(type) int UserdataSize = sizeof(type); "
                          "type* mydata;\n" +
                              text)),
      4);
  // Data that the program defines remain.
  EXPECT_EQ(led_of(folder.write(
                "both.c",
                "#define SIMULATOR\n#include <kilombo.h>\nstruct { uint8_t colour; } first = {3};\nvoid* mine = "
                "&first;\ntypedef struct { uint8_t colour; } USERDATA;\nUSERDATA own = {2};\nUSERDATA* mydata = "
                "&own;\nREGISTER_USERDATA(USERDATA)\n"
                "void setup() { mydata->colour += 4; } void loop() { set_color(mydata->colour); }\n" +
                    kMain)),
            6);
}

TEST(Dialects, StructuresOfGlobalsInCppThatPrintByLogMessage) {
  const Folder folder;
  const fs::path source =
      folder.write("a.c",
                   "//#include \"kilolib.h\"\nstruct GLOBALS { uint16_t colour = 5; message_t message; }* g;\n"
                   "void setup() { g->colour = 7; log_message(\"colour %d\", g->colour); } void loop() { "
                   "set_color(g->colour); }\n"
                   "int main() { GLOBALS* g_safe = (GLOBALS*)malloc(sizeof(GLOBALS)); kilo_init(); g = g_safe; "
                   "kilo_start(setup, loop); "
                   "free(g_safe); return 0; }\n");
  EXPECT_TRUE(mentions(compile({source}, cached()).notes, "log_message"));
  EXPECT_EQ(led_of(source), 7);
}

TEST(Dialects, ArgosDebugStructures) {
  const Folder folder;
  const fs::path source =
      folder.write("a.c",
                   "#include <argos3/plugins/robots/kilobot/control_interface/kilolib.h>\ntypedef struct { int "
                   "gradient; } debug_info_t;\n#include <debug.h>\n"
                   "void setup() { debug_info_set(gradient, 6); debug_print(\"g %d\\n\", "
                   "debug_info_get(gradient)); } void loop() { set_color(debug_info_get(gradient)); }\n"
                   "int main() { kilo_init(); debug_info_create(); kilo_start(setup, loop); return 0; }\n");
  EXPECT_EQ(led_of(source), 6);
  // Without the structure its fields vanish, as on the robot.
  EXPECT_EQ(led_of(folder.write("b.c",
                                "#include <kilolib.h>\n#include <debug.h>\nvoid setup() { debug_info_set(gradient, "
                                "6); } void loop() { set_color(2); }\n" +
                                    kMain)),
            2);
}

TEST(Dialects, MotorsAndConverterAreReachedByTheirRegisters) {
  const Folder folder;
  const fs::path source = folder.write(
      "a.c",
      "#include <kilolib.h>\n#include <avr/io.h>\n#include <avr/interrupt.h>\n#include <util/crc16.h>\n"
      "volatile int fired; ISR(TIMER1_OVF_vect) { fired = 1; }\n"
      "void setup() { asm volatile(\"cli\"); asm(\"nop\"); asm(\"sei\"); ADMUX = 6; ADCSRA |= _BV(ADSC); while "
      "(ADCSRA & _BV(ADSC)); OCR2A = 50; }\n"
      "void loop() { message_t m = {{1}, 2, 0}; uint16_t crc = 0xffff; for (int i = 0; i < 10; i++) crc = "
      "_crc_ccitt_update(crc, ((uint8_t*)&m)[i]);\n"
      "  set_color(ADC == get_voltage() && crc == message_crc(&m) && !fired ? 3 : 4); }\n" +
          kMain);
  Swarm swarm({source.string()}, 1);
  swarm.start();
  swarm.steps(3);
  EXPECT_EQ(swarm.led(0), 3);
  EXPECT_EQ(swarm.frame().motor_left[0], 50);
}

TEST(Printing, ReachesTheHostImmediatelyAndInOrder) {
  Swarm swarm({"#include <kilolib.h>\n#include <stdio.h>\nvoid setup() { printf(\"%s %5.2f|\", \"pi\", 3.14159); "
               "fprintf(stderr, \"%d\\n\", kilo_uid); }\n"
               "void loop() { if (kilo_ticks > 10) { printf(\"late\\n\"); *(volatile int*)8 = 1; } }\n" +
               kMain},
              2);
  swarm.step();
  EXPECT_TRUE(swarm.hosts[0]->printed().empty());
  Air air;
  for (std::uint32_t robot = 0; robot < 2; ++robot) air.receptions.push_back({robot, message(kRun)});
  swarm.step(air);
  ASSERT_EQ(swarm.hosts[0]->printed().size(), 2u);
  EXPECT_EQ(swarm.hosts[0]->printed()[1].robot, 1u);
  EXPECT_EQ(swarm.hosts[0]->printed()[1].text, "pi  3.14|1\n");
  swarm.step();
  EXPECT_TRUE(swarm.hosts[0]->printed().empty());
  for (int k = 0; k < 20 && swarm.hosts[0]->printed().empty(); ++k) swarm.step();
  // Text that a robot prints in the tick in which it fails.
  ASSERT_EQ(swarm.hosts[0]->printed().size(), 2u);
  EXPECT_EQ(swarm.hosts[0]->printed()[0].text, "late\n");
  EXPECT_EQ(swarm.hosts[0]->robots_failed(), 2u);
}

TEST(Printing, NumbersOf64BitsKeepTheirSizeWhateverLongIs) {
  Swarm swarm({"#include <kilolib.h>\n#include <stdio.h>\n#include <inttypes.h>\n"
               "void setup() { int64_t n = -INT64_C(1099511627777); uint64_t u = UINT64_C(18446744073709551615);\n"
               "  int32_t l = INT32_C(-2147483647); uint16_t s = 65535;\n"
               "  printf(\"%\" PRId64 \" %\" PRIu64 \" %\" PRId32 \" %\" PRIu16 \" %d\", n, u, l, s, 5); }\n"
               "void loop() {}\n" +
               kMain},
              1);
  Air air;
  air.receptions.push_back({0, message(kRun)});
  swarm.step();
  swarm.step(air);
  ASSERT_EQ(swarm.hosts[0]->printed().size(), 1u);
  EXPECT_EQ(swarm.hosts[0]->printed()[0].text, "-1099511627777 18446744073709551615 -2147483647 65535 5");
}

TEST(Printing, IsCompiledToNothingWithoutDebug) {
  Swarm swarm({"#include <kilolib.h>\n#include <debug.h>\nvoid setup() { debug_init(); printf(\"%d\", 1); }\nvoid "
               "loop() {}\n" +
               kMain},
              1);
  swarm.start();
  EXPECT_TRUE(swarm.hosts[0]->printed().empty());
}

TEST(Printing, TakesTheTimeOfTheSerialLine) {
  // 504 octets at 38400 baud: 131 ms, four ticks.
  Swarm swarm({"#define DEBUG\n#include <kilolib.h>\n#include <debug.h>\nvoid setup() { debug_init(); for (int i = "
               "0; i < 126; i++) printf(\"abcd\"); set_color(3); }\nvoid loop() {}\n" +
               kMain},
              1);
  swarm.start();
  swarm.steps(3);
  EXPECT_EQ(swarm.led(0), 0);
  swarm.steps(2);
  EXPECT_EQ(swarm.led(0), 3);
}

TEST(Printing, LogsBeginEachLineWithItsTimeAndGoOnFromACheckpoint) {
  const Folder folder;
  const TickLength length(262144);
  const auto own = [](std::uint32_t robot) { return robot != 0; };
  const std::string others = "0.983 of another process\n";
  folder.write("logs/robot-00000.txt", others);
  folder.write("logs/robot-00002.txt", "0.000 of an attempt before\n");
  {
    RobotLogs logs(folder.path(), length, Tick{0}, own);
    logs.write(Tick{0}, 2, "a\nb");
    logs.write(Tick{10}, 2, "c\n");
    logs.write(Tick{10}, 1, "x\n");
    logs.write(Tick{20}, 2, "d\n");
  }
  EXPECT_EQ(os::read_if_there(folder.path() / "logs/robot-00002.txt").value(), "0.000 a\n0.000 bc\n0.655 d\n");
  RobotLogs resumed(folder.path(), length, Tick{20}, own);
  EXPECT_EQ(os::read_if_there(folder.path() / "logs/robot-00002.txt").value(), "0.000 a\n0.000 bc\n");
  EXPECT_EQ(os::read_if_there(folder.path() / "logs/robot-00001.txt").value(), "0.328 x\n");
  EXPECT_EQ(os::read_file(folder.path() / "logs/robot-00000.txt"), others);
}

TEST(Printing, ALogThatCannotBeWrittenEndsTheRun) {
  const Folder folder;
  folder.write("logs", "no folder");
  RobotLogs logs(folder.path(), TickLength(262144), Tick{0}, [](std::uint32_t) { return true; });
  logs.write(Tick{0}, 2, "a\n");
  EXPECT_THROW(logs.write(Tick{40}, 2, "b\n"), RunError);
}

TEST(RobotWarnings, NameCodeThatAvrComputesDifferently) {
  if (os::find_executable("avr-gcc").empty()) GTEST_SKIP() << "no avr-gcc";
  const Folder folder;
  const fs::path source = folder.write("a.c",
                                       "#include <kilolib.h>\n"
                                       "uint8_t s; int last; uint32_t t; uint16_t a; double d;\n"
                                       "void setup() {}\n"
                                       "void loop() {\n"
                                       "  last = kilo_ticks;\n"
                                       "  t = s * 1000;\n"
                                       "  t = 1 << 16;\n"
                                       "  if (last > 40000) t = 60 * 1000;\n"
                                       "  d = kilo_ticks;\n"
                                       "  t = s * 100 + kilo_ticks;\n"
                                       "  t = (uint32_t)s * 1000;\n"
                                       "  s = a + 1;\n"
                                       "}\n" +
                                           kMain);
  const std::vector<std::string> warnings = robot_warnings({source}, cached());
  const std::string place = source.string();
  for (const char* line : {":5:10: ", ":6:9: ", ":7:9: ", ":8:12: ", ":9:7: "})
    EXPECT_TRUE(mentions(warnings, place + line)) << line;
  for (const char* line : {":10:", ":11:", ":12:"}) EXPECT_FALSE(mentions(warnings, place + line)) << line;
  for (const char* name : {"blink.c", "disperse.c", "walk.c"})
    EXPECT_TRUE(robot_warnings({std::string(KILOTWIN_BEHAVIOURS) + "/" + name}, cached()).empty()) << name;
}

TEST(RobotWarnings, CompilingForAvrTakesTheSameSources) {
  if (os::find_executable("avr-gcc").empty()) GTEST_SKIP() << "no avr-gcc";
  const Folder folder;
  folder.write("kilolib.h", "extern volatile uint32_t kilo_ticks;\n");
  folder.write("part.h", "int part(void);\n");
  const fs::path part =
      folder.write("part.c", "#include \"part.h\"\nchar room[100];\nint part(void) { return room[3]; }\n");
  const fs::path source = folder.write(
      "a.c",
      "#include \"kilolib.h\"\n#include \"part.h\"\nvoid setup() {} void loop() { set_color(part()); }\n" + kMain);
  EXPECT_GE(compile_for_avr({source, part}, cached()).ram_octets, 100u);
}

}  // namespace
}  // namespace kilotwin::behaviours::test
