// kilotwin debug: gdb stops in the program of the wanted robot, at the wanted time, and where a robot fails.
#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "tests/system/program.hpp"

namespace kilotwin::test {
namespace {

constexpr const char* kProgram = R"(#include <kilolib.h>
int16_t squares[3];
static uint16_t beats;
void setup(void) { for (int i = 0; i < 3; ++i) squares[i] = kilo_uid * kilo_uid + i; }
void loop(void) {
  ++beats;
  if (kilo_ticks == 60 && kilo_uid == 12) *(volatile int*)8 = 1;
}
int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }
)";

/// Nine robots of one program, numbered from 10 on: robots 1 and 8 + 1 share a slot.
constexpr const char* kExperiment = R"(
name: "debugged"
duration_s: 3
arena { width_mm: 600 height_mm: 600 }
robots { count: 10 first_uid: 10 behaviour: "debugged.c" layout { grid { pitch_mm: 50 } } }
)";

Outcome debugged(const Scratch& scratch, const Words& options) {
  std::ofstream(scratch / "debugged.c") << kProgram;
  std::ofstream(scratch / "debugged.txtpb") << kExperiment;
  Words words{"debug", scratch / "debugged.txtpb", "--out", scratch / "run", "--force"};
  words.insert(words.end(), options.begin(), options.end());
  return kilotwin(words, scratch);
}

TEST(Debug, StopsInTheWantedRobotAtTheWantedTime) {
  // Early: on machines without hardware watchpoints, gdb looks at each of some thousand passes of a tick.
  const Scratch scratch;
  for (const int robot : {1, 9}) {
    const Outcome outcome = debugged(scratch, {"--robot", std::to_string(robot), "--at", "0.2", "--command",
                                               "print squares", "--command", "print kilo_ticks"});
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    const int uid = 10 + robot, square = uid * uid;
    EXPECT_NE(outcome.out.find("= {" + std::to_string(square) + ", " + std::to_string(square + 1)),
              std::string::npos)
        << outcome.out << outcome.err;
    EXPECT_NE(outcome.out.find("loop () at ./debugged.c:"), std::string::npos) << outcome.out;
    EXPECT_NE(outcome.out.find("= 6\n"), std::string::npos) << outcome.out;
  }
}

TEST(Debug, StopsAtALine) {
  const Scratch scratch;
  const Outcome outcome = debugged(scratch, {"--robot", "4", "--break", "debugged.c:4", "--command", "backtrace"});
  EXPECT_NE(outcome.out.find("setup ()"), std::string::npos) << outcome.out << outcome.err;
}

TEST(Debug, StopsWhereARobotFails) {
  const Scratch scratch;
  const Outcome outcome = debugged(scratch, {"--robot", "2", "--at", "0.1", "--command", "delete", "--command",
                                             "continue", "--command", "print kilo_ticks"});
  EXPECT_NE(outcome.out.find("SIGSEGV"), std::string::npos) << outcome.out << outcome.err;
  EXPECT_NE(outcome.out.find("= 60\n"), std::string::npos) << outcome.out;
}

TEST(Debug, ListsTheRobots) {
  const Scratch scratch;
  const Outcome outcome = debugged(scratch, {"--robot", "10"});
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.err.find("--robot 10: the experiment has robots 0 to 9"), std::string::npos) << outcome.err;
}

}  // namespace
}  // namespace kilotwin::test
