// Doors of an experiment: what is refused, and in which words.
#include "scratch.hpp"

namespace kilotwin::test {
namespace {

class DoorChecks : public Scratch {};

/// An experiment with a tracked robot and one door.
std::string with(const std::string& door) { return "robots { count: 4 body: TRACKED }\ndoor { " + door + " }"; }

TEST_F(DoorChecks, AcceptsEveryKind) {
  EXPECT_EQ(check_error(with("name: 'a' ros2 { topic { name: '/poses' type: NAMED_POSE_ARRAY } }")), "");
  EXPECT_EQ(check_error(with("name: 'a' ros2 { topic { name: '/vrpn/{name}/pose' type: POSE_STAMPED } }")), "");
  EXPECT_EQ(check_error(with("name: 'a' ros2 { publish { poses: '/kilotwin/poses' } }")), "");
  EXPECT_EQ(check_error(with("name: 'a' ark {}")), "");
  EXPECT_EQ(check_error(with("name: 'a' log {}")), "");
  EXPECT_EQ(check_error(with("name: 'a' listener { robot: 2 }")), "");
  EXPECT_EQ(check_error(with("name: 'a' listener { id_octet: 0 line: 'heard {data}' }")), "");
  EXPECT_EQ(check_error(with("name: 'a' log { format: LARS columns: 4 } placement { unit_mm: 1.1 }")), "");
  EXPECT_EQ(check_error(with("name: 'a' ark {} robots { pattern: 'k{number}' robot { name: 'x' robot: 1 } }")), "");
}

TEST_F(DoorChecks, OneLineForEveryMistake) {
  const std::pair<const char*, const char*> cases[] = {
      {"ark {}", "e.txtpb:2:1: name is missing; state name: \"NAME\", the source that tracker frames name"},
      {"name: 'a'", "e.txtpb:2:1: door has no kind; it takes ros2, ark, log or listener { ... }"},
      {"name: 'a' ark { interval_ms: 1 }", "e.txtpb:2:24: interval_ms is 1; it takes a whole number, 10..10000 ms"},
      {"name: 'a' ark {} robots { pattern: 'kilobot' }",
       "e.txtpb:2:34: pattern is \"kilobot\"; it takes a name with {number} once, where the number stands"},
      {"name: 'a' ark {} robots { pattern: '{number}{number}' }",
       "e.txtpb:2:34: pattern is \"{number}{number}\"; it takes a name with {number} once, where the number "
       "stands"},
      {"name: 'a' ark {} robots { robot { name: 'x' } }",
       "e.txtpb:2:34: name or robot is missing; state both, name: \"NAME\" robot: ID"},
      {"name: 'a' ark {} robots { robot { name: 'x' robot: 1 }\n robot { name: 'x' robot: 2 } }",
       "e.txtpb:3:2: \"x\" has an entry already, at e.txtpb:2:34; keep one of them"},
      {"name: 'a' ark {} robots { robot { name: 'x' robot: 1 }\n robot { name: 'y' robot: 1 } }",
       "e.txtpb:3:2: robot 1 has an entry already, at e.txtpb:2:34; keep one of them"},
      {"name: 'a' ros2 {}", "e.txtpb:2:18: ros2 neither reads nor publishes; add topic { ... } or publish { ... }"},
      {"name: 'a' ros2 { topic { type: POSE_ARRAY } }", "e.txtpb:2:25: name is missing; state name: \"/TOPIC\""},
      {"name: 'a' ros2 { topic { name: '/poses' } }",
       "e.txtpb:2:25: type is missing; state the type of its messages, for example type: NAMED_POSE_ARRAY"},
      {"name: 'a' ros2 { topic { name: '/pose' type: POSE_STAMPED } }",
       "e.txtpb:2:33: messages of \"/pose\" do not say whose pose they bring; write {name} where the robot's name "
       "stands in the topic"},
      {"name: 'a' ros2 { topic { name: '/p' type: POSE_ARRAY }\n topic { name: '/p' type: POSE_ARRAY } }",
       "e.txtpb:3:10: the topic is read already, at e.txtpb:2:25; keep one of them"},
      {"name: 'a' log { format: LARS }",
       "e.txtpb:2:1: placement.unit_mm is missing; a log of LARS is in pixels of its camera: state unit_mm, "
       "millimetres per pixel"},
      {"name: 'a' log { columns: 4 }", "e.txtpb:2:24: columns is 4; a log of ARK takes 5 or 6"},
      {"name: 'a' listener {}",
       "e.txtpb:2:18: nothing tells who sent a message; state robot: NUMBER, the listener's own, or id_octet, or "
       "{sender} in line"},
      {"name: 'a' listener { robot: 1 line: '{type}' }",
       "e.txtpb:2:38: {data} is missing; it stands for the octets of the message"},
      {"name: 'a' log {} }\ntracker { source: 'b'",
       "e.txtpb:2:8: the experiment lists its trackers, and \"a\" is none of them, so its poses would not count; "
       "add "
       "tracker { source: \"a\" }"},
      {"name: 'a' ark {} }\ndoor { name: 'a' ark {}",
       "e.txtpb:3:8: a door has this name already, at e.txtpb:2:1; "
       "choose another"},
  };
  for (const auto& [door, error] : cases) EXPECT_EQ(check_error(with(door)), error) << door;
}

TEST_F(DoorChecks, TopicsHaveNamesOfRos) {
  for (const char* name : {"/a", "/a/b_c/D9", "/_x"})
    EXPECT_EQ(check_error(with(std::string{"name: 'a' ros2 { publish { poses: '"} + name + "' } }")), "") << name;
  for (const char* name : {"a", "/", "/a/", "//a", "/9a", "/a/9", "/a-b", "/a b", "/{name}", "/ä"}) {
    const std::string error =
        check_error(with(std::string{"name: 'a' ros2 { publish { poses: '"} + name + "' } }"));
    EXPECT_NE(error.find("it takes an absolute name of ROS"), std::string::npos) << name << ": " << error;
  }
}

TEST_F(DoorChecks, ANameHasAtMost63Characters) {
  EXPECT_EQ(check_error(with("name: '" + std::string(63, 'a') + "' ark {}")), "");
  EXPECT_EQ(check_error(with("name: '" + std::string(64, 'a') + "' ark {}")),
            "e.txtpb:2:8: name has 64 characters; it takes at most 63");
}

}  // namespace
}  // namespace kilotwin::test
