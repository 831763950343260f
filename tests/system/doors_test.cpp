// Doors as a laboratory uses them: the program, a run, nodes of ROS.
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <mutex>

#include "clients/doors/ros2/ros2_door.hpp"
#include "tests/system/own_domain.hpp"
#include "tests/system/program.hpp"

namespace kilotwin::test {
namespace {

namespace ros2 = doors::ros2;

class Doors : public testing::Test {
 protected:
  /// An experiment with two simulated and three tracked robots, and the door.
  std::string experiment(const std::string& door) const {
    const std::string file = scratch / "lab.txtpb";
    write(file, "duration_s: 3600\nrobots { count: 2 behaviour: '" + source("behaviours/disperse.c") +
                    "' }\nrobots { count: 3 body: TRACKED layout { x_mm: 300 grid {} } }\ndoor { name: 'lab' " +
                    door + " }\n");
    return file;
  }
  const OwnDomain ros, run;
  Scratch scratch;
};

TEST_F(Doors, RosSeesTheRobotsOfARun) {
  const std::string file = experiment("ros2 { publish { poses: '/kilotwin/poses' clock: true } }");
  const dds::Participant node(ros2::transport_of({ros.number, false, {}, {}}));
  std::mutex mutex;
  std::vector<double> x_m;
  int clocks = 0;
  const dds::Reader<ros2::PoseArray> poses(node,
                                           ros2::channel<ros2::PoseArray>("/kilotwin/poses", dds::Delivery::kNode),
                                           [&](const ros2::PoseArray& sample, dds::SampleState state) {
                                             if (!state.valid) return;
                                             const std::lock_guard lock(mutex);
                                             x_m.clear();
                                             for (std::uint32_t i = 0; i < sample.poses._length; ++i)
                                               x_m.push_back(sample.poses._buffer[i].position.x);
                                           });
  const dds::Reader<ros2::Clock> clock(node, ros2::channel<ros2::Clock>("/clock", dds::Delivery::kNode),
                                       [&](const ros2::Clock&, dds::SampleState state) {
                                         const std::lock_guard lock(mutex);
                                         clocks += state.valid ? 1 : 0;
                                       });
  Process simulation({program(), "run", file, "--pace", "1", "--domain", run.name, "--out", scratch / "run"},
                     scratch.path());
  const Scratch other;
  Process door({program(), "ros2", file, "--domain", run.name, "--ros-domain", ros.name}, other.path());
  EXPECT_TRUE(eventually([&] {
    const std::lock_guard lock(mutex);
    return x_m.size() == 5 && clocks > 2;
  }));
  {
    const std::lock_guard lock(mutex);
    ASSERT_EQ(x_m.size(), 5u);
    for (std::size_t i = 2; i < x_m.size(); ++i) EXPECT_NEAR(x_m[i], 0.3, 0.05) << "metres";
  }
  door.signal(SIGINT);
  const Outcome outcome = door.wait();
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("door \"lab\" closes: 0 frames with 0 poses; published "), std::string::npos)
      << outcome.err;
  simulation.signal(SIGINT);
  static_cast<void>(simulation.wait());
}

TEST_F(Doors, ALogIsPlayedOnceSomebodyReads) {
  const std::string file = experiment("log {}");
  write(scratch / "a.log", "0\t0\t1\t1000\t900\t90\n0.05\t0\t1\t1010\t900\t90\n0.1\t2\t3\t1020\t900\t90\n");
  Process play({program(), "play", file, scratch / "a.log", "--domain", run.name}, scratch.path());
  EXPECT_TRUE(play.says("waits for a run on domain " + run.name, 30));
  const dds::Participant reader({run.number, {}});
  std::mutex mutex;
  std::vector<std::pair<std::uint32_t, double>> seen;  // robot, x
  std::vector<std::int64_t> captured;
  const dds::Reader<PublicTrackerFrame> frames(
      reader, topics::played_frames(), [&](const PublicTrackerFrame& sample, dds::SampleState state) {
        if (!state.valid) return;
        const std::lock_guard lock(mutex);
        captured.push_back(sample.capture_ns);
        EXPECT_GE(sample.sent_ns, sample.capture_ns);
        EXPECT_STREQ(sample.source, "lab");
        for (std::uint32_t i = 0; i < sample.robot._length; ++i)
          seen.emplace_back(sample.robot._buffer[i], sample.x_mm._buffer[i]);
      });
  const Outcome outcome = play.wait();
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("played 3 frames with 3 poses"), std::string::npos) << outcome.err;
  // The player leaves after this reader has confirmed all frames.
  const std::lock_guard lock(mutex);
  EXPECT_EQ(seen, (std::vector<std::pair<std::uint32_t, double>>{{2, 0}, {2, 10}, {4, 20}}));
  EXPECT_EQ(captured, (std::vector<std::int64_t>{0, 50'000'000, 100'000'000}));
}

TEST_F(Doors, MistakesAreOneLineWithStatus2) {
  const auto refused = [&](const Words& words, const std::string& expected) {
    const Outcome outcome = kilotwin(words, scratch);
    EXPECT_EQ(outcome.status, 2);
    EXPECT_NE(outcome.err.find(expected), std::string::npos) << outcome.err;
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  };
  const std::string ros_file = experiment("ros2 { topic { name: '/p' type: POSE_ARRAY } }");
  refused({"play", ros_file, "a.log", "--domain", "7"}, "the experiment has no door to log; add door {");
  refused({"ros2", ros_file, "--domain", "0"}, "--domain: the run and ROS are both on domain 0");
  refused({"ros2", ros_file, "--domain", "7", "--door", "x"},
          "--door: \"x\" is no door of this experiment; give one of \"lab\"");
  refused({"ros2", ros_file}, "--domain");
  const std::string log_file = experiment("log {}");
  refused({"play", log_file, scratch / "none.log", "--domain", "7"}, "none.log: cannot be read; name a log");
  write(scratch / "bad.log", "0\t0\t1\tx\t900\t90\n");
  refused({"play", log_file, scratch / "bad.log", "--domain", "7"}, "bad.log:1:7: x is \"x\"; it takes a number");
  write(scratch / "alone.txtpb",
        "robots { count: 2 behaviour: '" + source("behaviours/disperse.c") + "' }\ndoor { name: 'a' log {} }\n");
  refused({"play", scratch / "alone.txtpb", scratch / "bad.log", "--domain", "7"},
          "alone.txtpb:2:1: the door reads poses, but no robot is tracked; add a group with body: TRACKED");
  write(scratch / "list.txtpb", "robots { count: 2 behaviour: '" + source("behaviours/disperse.c") +
                                    "' }\nrobots { count: 1 body: TRACKED layout { x_mm: 300 grid {} } }\ndoor { "
                                    "name: 'a' log {} robots { robot { "
                                    "name: 'x' robot: 1 } } }\n");
  refused({"play", scratch / "list.txtpb", scratch / "bad.log", "--domain", "7"},
          "robot 1 is not tracked; name a robot of a group with body: TRACKED");
}

}  // namespace
}  // namespace kilotwin::test
