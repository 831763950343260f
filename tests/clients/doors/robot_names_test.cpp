#include "clients/doors/robot_names.hpp"

#include <gtest/gtest.h>

#include "tests/clients/doors/doors.hpp"

namespace kilotwin::doors::test {
namespace {

TEST(RobotNames, NumbersCountFromTheFirstTrackedRobot) {
  const Door d = door("ros2 {} robots { pattern: 'kilobot_{number}' }", 12, 10);
  EXPECT_EQ(d.names.of_name("kilobot_0"), 10u);
  EXPECT_EQ(d.names.of_name("kilobot_1"), 11u);
  EXPECT_EQ(d.names.of_name("kilobot_01"), 11u) << "zeros before a number say nothing";
  EXPECT_EQ(d.names.of_number(1), 11u);
  EXPECT_EQ(d.names.names(), (std::vector<std::string>{"kilobot_0", "kilobot_1"}));
}

TEST(RobotNames, ANameThatIsNoneMeansNoRobot) {
  const Door d = door("ros2 {} robots { pattern: 'kilobot_{number}x' }", 12, 10);
  for (const char* name : {"", "kilobot_", "kilobot_x", "kilobot_2x", "kilobot_0", "robot_0x", "kilobot_-1x",
                           "kilobot_0.0x", "kilobot_99999999999999999999999x", "kilobot_ 1x"})
    EXPECT_FALSE(d.names.of_name(name)) << name;
  EXPECT_TRUE(d.names.of_name("kilobot_1x"));
}

TEST(RobotNames, ListedNamesComeFirst) {
  const Door d = door(
      "ros2 {} robots { first_number: 1 first_robot: 2 robot { name: '1' robot: 4 } robot { name: 'leader' robot: "
      "2 } }",
      5, 1);
  EXPECT_EQ(d.names.of_name("1"), 4u);
  EXPECT_EQ(d.names.of_name("leader"), 2u);
  EXPECT_EQ(d.names.of_name("2"), 3u);
  EXPECT_FALSE(d.names.of_name("0")) << "numbers begin with 1";
  EXPECT_EQ(d.names.names(), (std::vector<std::string>{"leader", "2", "1"}));
}

TEST(RobotNames, EveryNameMeansItsRobot) {
  for (const std::uint32_t first : {0u, 3u, 100u}) {
    const Door d =
        door("ros2 {} robots { pattern: 'k{number}' first_number: " + std::to_string(first) + " }", 40, 7);
    const auto names = d.names.names();
    ASSERT_EQ(names.size(), 33u);
    for (std::size_t i = 0; i < names.size(); ++i) EXPECT_EQ(d.names.of_name(names[i]), 7 + i);
  }
}

TEST(RobotNames, ASimulatedRobotIsMeantByNoName) {
  const Door d = door("ros2 {} robots { first_robot: 0 robot { name: 'x' robot: 1 } }", 4, 2);
  EXPECT_FALSE(d.names.of_name("0"));
  EXPECT_FALSE(d.names.of_name("x"));
  EXPECT_EQ(d.names.of_name("2"), 2u);
}

TEST(RobotNames, ARobotHasTheNumberThatMeansIt) {
  const Door d =
      door("ark {} robots { first_number: 1 robot { name: '77' robot: 3 } robot { name: '2' robot: 9 } }", 10, 2);
  EXPECT_EQ(d.names.of_number(77), 3u);
  EXPECT_EQ(d.names.of_number(2), 9u);
  for (std::uint32_t robot = 0; robot < 12; ++robot) {
    const auto number = d.names.number_of(robot);
    if (number) {
      EXPECT_EQ(d.names.of_number(*number), robot);
    }
    EXPECT_EQ(number.has_value(), robot >= 2 && robot < 10) << robot;
  }
}

}  // namespace
}  // namespace kilotwin::doors::test
