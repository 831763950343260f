// int has 16 bits, as on the robot: values wrap, and the line is told once.
#include "services/behaviours/robot_int.hpp"

#include <gtest/gtest.h>

#include "core/base/error.hpp"
#include "tests/services/behaviours/swarm.hpp"

namespace kilotwin::behaviours::test {
namespace {

std::vector<std::string> warnings_of(const std::string& body, int ticks = 3) {
  Swarm swarm({program(body)}, 3);
  swarm.start();
  swarm.steps(ticks);
  EXPECT_EQ(swarm.hosts[0]->robots_failed(), 0u);
  std::vector<std::string> result;
  for (const auto& warning : swarm.hosts[0]->warnings()) result.push_back(warning.text);
  return result;
}

/// The LED is red if `condition` holds after `statements`.
bool holds(const std::string& statements, const std::string& condition, const std::string& before = "") {
  Swarm swarm({program(before + "\nstatic void loop(void) {\n" + statements + "\nset_color(" + condition +
                       " ? RGB(3, 0, 0) : RGB(0, 0, 3)); }\n")},
              1);
  swarm.start();
  swarm.steps(2);
  EXPECT_NE(swarm.led(0), 0) << statements;
  return swarm.led(0) == 3;
}

TEST(RobotInt, TheClockHasTheWidthOfTheProgramsLong) {
  const std::string before = "#include <time.h>\nstatic long t[2] = {-1, 7};\n";
  EXPECT_TRUE(holds("time(&t[0]);", "t[0] >= 0 && t[0] < 9 && t[1] == 7", before));
  EXPECT_TRUE(
      holds("time_t now = time(NULL); clock_t ticks = clock();",
            "sizeof(time_t) == 4 && sizeof(clock_t) == 4 && now < 9 && ticks < 90 && difftime(now, now + 2) == -2",
            before));
}

TEST(RobotInt, WrapsLikeTheRobots) {
  // A sum of 300 readings of a light sensor, the classical mistake.
  EXPECT_TRUE(holds("int sum = 0; for (int i = 0; i < 300; i++) sum += 512;", "sum == (int16_t)(300 * 512)"));
  EXPECT_TRUE(holds("volatile int a = 32767; a++;", "a == -32768"));
  EXPECT_TRUE(holds("volatile int a = 300; int b = a * a;", "b == (int16_t)90000"));
  EXPECT_TRUE(holds("volatile int a = -32768; --a;", "a == 32767"));
  EXPECT_TRUE(holds("volatile int a = 200; a *= a;", "a == (int16_t)40000"));
  EXPECT_TRUE(holds("volatile signed s = 32767; s = s + 2;", "s == -32767"));
  EXPECT_TRUE(holds("int a[2] = {32000, 1}; int *p = a; *p += 1000; *p -= 0;", "a[0] == -32536 && a[1] == 1"));
  EXPECT_TRUE(holds("struct { int x; } s = {32767}, *p = &s; p->x++;", "s.x == -32768"));
}

TEST(RobotInt, UnsignedHas16BitsAndLong32) {
  EXPECT_TRUE(
      holds("volatile unsigned a = 65535; a += 10; volatile unsigned int b = 70000;", "a == 9 && b == 4464"));
  EXPECT_TRUE(holds("volatile long a = 2147483647L; a += 1; volatile unsigned long b = 4294967295UL; ++b;",
                    "a < 0 && b == 0"));
  EXPECT_TRUE(holds("volatile long int a = 65536; a = a * a;", "a == 0"));
  EXPECT_TRUE(holds("volatile uint32_t x = 5000000; x = x * 1000UL / 1000;", "x == 5000000UL * 1000 / 1000"));
  EXPECT_TRUE(holds("volatile unsigned long a = 1; long long b = 1LL << 40; double d = 1.5L;",
                    "sizeof a == 4 && sizeof b == 8 && b > 0x7fffffffL && d == 1.5 && sizeof(unsigned) == 2"));
  EXPECT_TRUE(holds("struct { unsigned long state, other; } r = {1, 7}; rand_r(&r.state); random_r(&r.state);",
                    "r.other == 7 && r.state != 1"));
  // Data of a message or the EEPROM have the robot's layout.
  EXPECT_TRUE(holds("struct { unsigned id; long seen; unsigned int near : 1; uint8_t last; } s;", "sizeof s == 8"));
  EXPECT_TRUE(
      holds("char t[20]; long a = -70000; unsigned long b = 70000; unsigned c = 7;"
            "snprintf(t, sizeof t, \"%ld %lu %u\", a, b, c);",
            "strcmp(t, \"-70000 70000 7\") == 0", "#include <stdio.h>"));
}

TEST(RobotInt, LeavesOtherTypesAlone) {
  EXPECT_TRUE(holds("volatile int32_t a = 40000; a += 40000;", "a == 80000"));
  EXPECT_TRUE(holds("volatile long a = 40000; a *= 2;", "a == 80000"));
  EXPECT_TRUE(holds("float f = 1e6; f += 0.5; f *= 2; double d = 1; d += 0.25;", "f == 2000001.0f && d == 1.25"));
  EXPECT_TRUE(holds("uint8_t u = 250; u += 10; char c = 3; c++;", "u == 4 && c == 4"));
  EXPECT_TRUE(holds("int a[3] = {1, 2, 3}, *p = a; p += 2; p -= 1; ++p;", "*p == 3 && sizeof(int) == 2"));
  EXPECT_TRUE(
      holds("qsort(v, 4, sizeof *v, by);", "v[0] == -5 && v[3] == 30000",
            "static int v[] = {3, 30000, -5, 7};\n"
            "static int by(const void* a, const void* b) { const int x = *(const int*)a, y = *(const int*)b; "
            "return (x > y) - (x < y); }"));
  EXPECT_TRUE(warnings_of("static void loop(void) { uint16_t a = 40000; int32_t b = 40000; int c = 5;\n"
                          "a += 100; b += 100; c += 3; c = c - 2; for (int i = 0; i < 4; ++i) c *= 1; }")
                  .empty());
}

TEST(RobotInt, TellsEachLineOnce) {
  const auto told = warnings_of(
      "static int total; static void loop(void) {\n"
      "  int sum = 0;\n"
      "  for (int i = 0; i < 100; ++i) sum += 1000;\n"
      "  total = sum + 32000;\n"
      "  int product = sum * 1000;\n"
      "  set_color(product + total);\n}\n",
      20);
  ASSERT_GE(told.size(), 2u);
  EXPECT_LE(told.size(), 3u);
  EXPECT_NE(told[0].find("an int overflows in loop() at program0.c:3"), std::string::npos) << told[0];
}

TEST(RobotInt, ProgramsThatDoNotAllowItKeepAWideInt) {
  const Folder folder;
  const auto compiled = [&](const std::string& text, bool wide) {
    CompileOptions options = cached();
    options.wide_int = wide;
    return compile({folder.write("a.c", text)}, options);
  };
  const std::string scans = program("static void loop(void) { int a = 0; sscanf(\"7\", \"%d\", &a); }");
  const auto notes = compiled("#include <stdio.h>\n" + scans, false).notes;
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_NE(notes[0].find("its int has 32 bits here, 16 on the robot"), std::string::npos) << notes[0];
  const std::string plain = program("static void loop(void) {}");
  EXPECT_TRUE(compiled(plain, false).notes.empty());
  EXPECT_TRUE(compiled(plain, true).notes.empty());
}

/// Text that is no program, or half of one, neither crashes the pass nor keeps it busy.
TEST(RobotInt, SurvivesAnyText) {
  const std::string pieces[] = {"int",
                                " ",
                                "x",
                                "=",
                                "+",
                                "+=",
                                "(",
                                ")",
                                "{",
                                "}",
                                ";",
                                ",",
                                "*",
                                "[",
                                "]",
                                "\n",
                                "# 1 \"a.c\" 3\n",
                                "\"",
                                "'",
                                "unsigned",
                                "long",
                                "7L",
                                "1.5",
                                "for",
                                "if",
                                "->",
                                ".",
                                "1",
                                "__builtin_va_arg"};
  std::uint64_t state = 7;
  for (int n = 0; n < 3000; ++n) {
    std::string text;
    for (int i = 0; i < 40; ++i) {
      state = state * 6364136223846793005u + 1442695040888963407u;
      text += pieces[(state >> 33) % std::size(pieces)];
      text += ' ';
    }
    EXPECT_LT(with_robot_int(text).size(), 40 * text.size() + 1000);
    static_cast<void>(allows_robot_int(text));
  }
}

}  // namespace
}  // namespace kilotwin::behaviours::test
