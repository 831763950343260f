// Division by zero and INT_MIN / -1 give the results of the robot's library.
#include <gtest/gtest.h>

#include "tests/services/behaviours/swarm.hpp"

namespace kilotwin::behaviours::test {
namespace {

/// The LED is red if every line holds. `lines` may use the variables below, whose values the compiler does not know.
void all_hold(const std::string& lines) {
  Swarm swarm(
      {program("volatile int8_t z8; volatile int16_t z16; volatile int32_t z32; volatile int64_t z64;\n"
               "volatile int32_t n = -7, p = 7, m1 = -1, least = INT32_MIN; volatile int64_t least64 = INT64_MIN;\n"
               "volatile uint32_t u = 1000; volatile uint64_t u64 = 1ull << 40; struct { int a; volatile int z[3]; "
               "} s;\n"
               "static void loop(void) { set_color(" +
               lines + " ? RGB(3, 0, 0) : RGB(0, 0, 3)); }")},
      20);
  swarm.start();
  swarm.steps(3);
  for (std::uint32_t robot = 0; robot < 20; ++robot) EXPECT_EQ(swarm.led(robot), 3) << lines;
  EXPECT_EQ(swarm.hosts[0]->robots_failed(), 0u);
  ASSERT_EQ(swarm.hosts[0]->warnings().size(), 1u);
  EXPECT_NE(swarm.hosts[0]->warnings()[0].text.find("division by zero in loop() at program0.c:4"),
            std::string::npos)
      << swarm.hosts[0]->warnings()[0].text;
}

TEST(Division, Unsigned) {
  all_hold(
      "u / (uint32_t)z32 == UINT32_MAX && u % (uint32_t)z32 == 1000 && (uint16_t)(u / (uint16_t)z16) == UINT16_MAX"
      "&& u64 / (uint64_t)z64 == UINT64_MAX && u64 % (uint64_t)z64 == 1ull << 40");
}

TEST(Division, Signed) {
  all_hold(
      "p / z32 == -1 && p % z32 == 7 && n / z32 == 1 && n % z32 == -7 && n / z8 == 1 && p / z16 == -1"
      "&& (int64_t)n / z64 == 1 && (int64_t)n % z64 == -7");
}

TEST(Division, OperandsInMemory) {
  all_hold(
      "p / s.z[kilo_ticks & 1] == -1 && n % s.z[2] == -7 && least / m1 == least && least % m1 == 0 && least64 / m1 "
      "== least64");
}

}  // namespace
}  // namespace kilotwin::behaviours::test
