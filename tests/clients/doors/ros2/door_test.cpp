// The door between two domains: nodes that publish and read as nodes of ROS 2 do, and an outsider of the run.
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <condition_variable>
#include <mutex>

#include "clients/doors/ros2/ros2_door.hpp"
#include "tests/clients/doors/doors.hpp"

namespace kilotwin::doors::ros2 {
namespace {

using doors::test::door;

constexpr std::int64_t kServe_ns = 20'000'000;

template <class T> class Collected {
 public:
  void put(T value) {
    const std::lock_guard lock(mutex_);
    values_.push_back(std::move(value));
  }
  std::vector<T> values() {
    const std::lock_guard lock(mutex_);
    return values_;
  }

 private:
  std::mutex mutex_;
  std::vector<T> values_;
};

struct Frame {
  std::string source;
  std::int64_t capture_ns, sent_ns;
  int clock;
  std::vector<std::uint32_t> robots;
  std::vector<double> x_mm;
  std::vector<float> xx_mm2;
};

/// A run's domain and a ROS domain on this machine, and who reads tracker frames.
class Domains {
 public:
  explicit Domains(const std::string& text, std::size_t robots)
      : run_claim_(dds::DomainClaim::any()),
        ros_claim_(dds::DomainClaim::any()),
        door_(door(text, robots), {run_claim_.domain(), {}}, {ros_claim_.domain(), false, {}, {}}),
        run({run_claim_.domain(), {}}),
        ros(transport_of({ros_claim_.domain(), false, {}, {}})),
        frames_(run, topics::tracker_frames(), [this](const PublicTrackerFrame& sample, dds::SampleState state) {
          if (!state.valid) return;
          frames.put({sample.source,
                      sample.capture_ns,
                      sample.sent_ns,
                      sample.clock,
                      {sample.robot._buffer, sample.robot._buffer + sample.robot._length},
                      {sample.x_mm._buffer, sample.x_mm._buffer + sample.x_mm._length},
                      {sample.xx_mm2._buffer, sample.xx_mm2._buffer + sample.xx_mm2._length}});
        }) {}

  /// Repeats `write` until `seen` holds; false after 500 rounds, a bound against hanging.
  template <class Write, class Seen> bool until(Write write, Seen seen) {
    for (int round = 0; round < 500; ++round) {
      write(round);
      door_.serve(kServe_ns);
      if (seen()) return true;
    }
    return false;
  }
  Ros2Door& served() { return door_; }

 private:
  dds::DomainClaim run_claim_, ros_claim_;
  Ros2Door door_;

 public:
  dds::Participant run, ros;
  Collected<Frame> frames;

 private:
  dds::Reader<PublicTrackerFrame> frames_;
};

std::string frame_id = "world", first = "kilobot_0", second = "kilobot_1", wand = "wand";

Header header(int sec) { return {{sec, 500}, frame_id.data()}; }
Pose at(double x) { return {{x, 0, 0}, {0, 0, 0, 1}}; }

TEST(Ros2Door, NamedPosesBecomeTrackerFrames) {
  Domains domains(
      "name: 'optitrack' robots { pattern: 'kilobot_{number}' }"
      "ros2 { utc: true topic { name: '/poses' type: NAMED_POSE_ARRAY frame_id: 'world' } }",
      2);
  dds::Writer<NamedPoseArray> node(domains.ros, channel<NamedPoseArray>("/poses", dds::Delivery::kNode));
  motion_capture_tracking_interfaces_msg_dds__NamedPose_ poses[] = {
      {second.data(), at(0.25)}, {wand.data(), at(9)}, {first.data(), at(-0.5)}};
  ASSERT_TRUE(domains.until(
      [&](int round) {
        NamedPoseArray sample{};
        sample.header = header(1'700'000'000 + round);
        sample.poses = {3, 3, poses, false};
        node.write(sample);
      },
      [&] { return domains.frames.values().size() >= 3; }));
  const std::vector<Frame> frames = domains.frames.values();
  for (const Frame& frame : frames) {
    EXPECT_EQ(frame.source, "optitrack");
    EXPECT_EQ(frame.capture_ns % 1'000'000'000, 500);
    EXPECT_EQ(frame.clock, 1);
    EXPECT_GT(frame.sent_ns, 1'700'000'000'000'000'000);
    EXPECT_EQ(frame.robots, (std::vector<std::uint32_t>{0, 1}));
    EXPECT_EQ(frame.x_mm, (std::vector<double>{-500, 250}));
  }
  EXPECT_GT(domains.served().tally().left_out_for("poses that belong to no tracked robot"), 0u);
}

TEST(Ros2Door, APoseStampedPerRobotIsGathered) {
  Domains domains(
      "name: 'vrpn' robots { pattern: 'kilobot_{number}' } ros2 { gather_ms: 200 topic "
      "{ name: '/vrpn/{name}/pose' type: POSE_STAMPED } }",
      2);
  dds::Writer<PoseStamped> one(domains.ros, channel<PoseStamped>("/vrpn/kilobot_0/pose", dds::Delivery::kNode));
  dds::Writer<PoseStamped> two(domains.ros, channel<PoseStamped>("/vrpn/kilobot_1/pose", dds::Delivery::kNode));
  ASSERT_TRUE(domains.until(
      [&](int round) {
        one.write({header(round + 1), at(1)});
        two.write({header(round + 1), at(2)});
      },
      [&] {
        const auto frames = domains.frames.values();
        return !frames.empty() && frames.back().robots.size() == 2;
      }));
  const Frame frame = domains.frames.values().back();
  EXPECT_EQ(frame.x_mm, (std::vector<double>{1000, 2000}));
  EXPECT_EQ(frame.clock, 0);
  EXPECT_EQ(frame.sent_ns, 0);
}

TEST(Ros2Door, TheOtherTypesAreReadToo) {
  Domains domains(
      "name: 'lab' ros2 { gather_ms: 1 topic { name: '/array' type: POSE_ARRAY } topic { name: '/tf' type: "
      "TF_MESSAGE } topic { name: '/bodies' type: RIGID_BODIES } topic { name: '/amcl{name}' type: "
      "POSE_WITH_COVARIANCE_STAMPED } }",
      4);
  dds::Writer<PoseArray> array(domains.ros, channel<PoseArray>("/array", dds::Delivery::kNode));
  dds::Writer<TFMessage> tf(domains.ros, channel<TFMessage>("/tf", dds::Delivery::kNode));
  dds::Writer<RigidBodies> bodies(domains.ros, channel<RigidBodies>("/bodies", dds::Delivery::kNode));
  dds::Writer<PoseWithCovarianceStamped> one(domains.ros,
                                             channel<PoseWithCovarianceStamped>("/amcl3", dds::Delivery::kNode));
  std::string number1 = "1", number2 = "2";
  const auto seen = [&](std::uint32_t robot, double x_mm) {
    const auto frames = domains.frames.values();
    return std::any_of(frames.begin(), frames.end(), [&](const Frame& frame) {
      for (std::size_t i = 0; i < frame.robots.size(); ++i) {
        if (frame.robots[i] == robot && frame.x_mm[i] == x_mm) return true;
      }
      return false;
    });
  };
  Pose pose = at(1);
  geometry_msgs_msg_dds__TransformStamped_ transform{};
  mocap4r2_msgs_msg_dds__RigidBody_ body{};
  ASSERT_TRUE(domains.until(
      [&](int round) {
        PoseArray poses{header(2 * round + 1), {1, 1, &pose, false}};
        array.write(poses);
        transform = {header(2 * round + 1), number1.data(), {{2, 0, 0}, {0, 0, 0, 1}}};
        tf.write({{1, 1, &transform, false}});
        body.rigid_body_name = number2.data();
        body.pose = at(3);
        bodies.write({header(2 * round + 1), 5, {1, 1, &body, false}});
        PoseWithCovarianceStamped known{};
        known.header = header(2 * round + 1);
        known.pose.pose = at(4);
        known.pose.covariance[0] = 25e-6;
        known.pose.covariance[7] = 16e-6;
        one.write(known);
      },
      [&] { return seen(0, 1000) && seen(1, 2000) && seen(2, 3000) && seen(3, 4000); }));
  for (const Frame& frame : domains.frames.values()) {
    for (std::size_t i = 0; i < frame.robots.size(); ++i)
      EXPECT_NEAR(frame.xx_mm2[i], frame.robots[i] == 3 ? 25 : 1, 1e-4);
  }
}

TEST(Ros2Door, RosSeesTheRobotsOfTheRunAndItsTime) {
  Domains domains(
      "name: 'rviz' placement { x_mm: 1000 turn_deg: 90 }"
      "ros2 { publish { poses: '/kilotwin/poses' clock: true frame_id: 'map' } }",
      2);
  struct Seen {
    double x, y, z, w;
    int sec;
    std::string frame;
  };
  Collected<Seen> poses;
  Collected<double> clock;
  const dds::Reader<PoseArray> rviz(
      domains.ros, channel<PoseArray>("/kilotwin/poses", dds::Delivery::kNode),
      [&](const PoseArray& sample, dds::SampleState state) {
        if (!state.valid || sample.poses._length != 2) return;
        const Pose& pose = sample.poses._buffer[1];
        poses.put({pose.position.x, pose.position.y, pose.orientation.z, pose.orientation.w,
                   sample.header.stamp.sec, sample.header.frame_id});
      });
  const dds::Reader<Clock> time(domains.ros, channel<Clock>("/clock", dds::Delivery::kNode),
                                [&](const Clock& sample, dds::SampleState state) {
                                  if (state.valid) clock.put(sample.clock.sec + 1e-9 * sample.clock.nanosec);
                                });
  dds::Writer<PublicRobotState> run(domains.run, topics::robots());
  ASSERT_TRUE(domains.until(
      [&](int round) {
        for (std::uint32_t robot = 0; robot < 2; ++robot) {
          PublicRobotState state{};
          state.robot = robot;
          state.run = 9;
          state.time_s = 7 + 0.01 * round;
          state.x_mm = 1000;
          state.y_mm = 500 * robot;
          state.heading_rad = 1.5707963267948966;
          run.write(state);
        }
      },
      [&] { return poses.values().size() >= 2 && clock.values().size() >= 2; }));
  for (const Seen& pose : poses.values()) {
    EXPECT_NEAR(pose.x, 0.5, 1e-12);
    EXPECT_NEAR(pose.y, 0, 1e-12);
    EXPECT_NEAR(std::abs(pose.w), 1, 1e-12) << "it heads along the x axis of ROS";
    EXPECT_GE(pose.sec, 7);
    EXPECT_LT(pose.sec, 20) << "simulated time";
    EXPECT_EQ(pose.frame, "map");
  }
  const auto times = clock.values();
  for (std::size_t i = 1; i < times.size(); ++i) EXPECT_GT(times[i], times[i - 1]);
}

TEST(Ros2Door, FaultsAreCountedByReason) {
  const Door d = door("name: 'x' ros2 { topic { name: '/p' type: NAMED_POSE_ARRAY frame_id: 'world' } }", 3);
  FrameMaker maker(d, topics_of(d));
  const auto add = [&](Message message) { return maker.add({0, std::move(message), 1}, 0); };
  const SourcePose good{};
  EXPECT_EQ(add({1, "world", true, {}, {{"0", {}, good, {}}}}).size(), 1u);
  EXPECT_TRUE(add({2, "map", true, {}, {{"0", {}, good, {}}}}).empty());
  EXPECT_TRUE(add({std::nullopt, "world", true, {}, {{"0", {}, good, {}}}}).empty());
  const auto frames = add({3,
                           "world",
                           true,
                           {},
                           {{"9", {}, good, {}},
                            {"1", {}, {NAN, 0, 0}, {}},
                            {"0", {}, good, {}},
                            {"2", {}, {0, 0, 0, 1, 0, 0, 0}, {}}}});
  ASSERT_EQ(frames.size(), 1u);
  EXPECT_EQ(frames[0].robots.size(), 1u);
  Tally& tally = maker.tally();
  EXPECT_EQ(tally.left_out_for("messages of another frame_id"), 1u);
  EXPECT_EQ(tally.left_out_for("messages whose stamp is no time; set stamp: ARRIVAL where the driver sets none"),
            1u);
  EXPECT_EQ(tally.left_out_for("poses that belong to no tracked robot"), 1u);
  EXPECT_EQ(tally.left_out_for("poses that are not finite"), 1u);
  EXPECT_EQ(tally.left_out_for("poses that lean more than max_tilt_deg"), 1u);
  EXPECT_EQ(tally.frames(), 2u);
  EXPECT_EQ(tally.poses(), 2u);
  EXPECT_NE(tally.in_words().find("1 messages of another frame_id (the first: \"map\" on /p)"), std::string::npos)
      << tally.in_words();
}

TEST(Ros2Door, ArrivalStandsForAMissingStamp) {
  const Door d = door("name: 'x' ros2 { stamp: ARRIVAL topic { name: '/{name}' type: POSE_STAMPED } }", 2);
  FrameMaker maker(d, topics_of(d));
  const auto frames = maker.add({1, {std::nullopt, "", false, {}, {{"1", {}, {}, {}}}}, 4711}, 0);
  ASSERT_EQ(frames.size(), 1u);
  EXPECT_EQ(frames[0].capture_ns, 4711);
  EXPECT_EQ(frames[0].robots.at(0).robot, 1u);
}

TEST(Ros2Door, TheInboxLosesTheOldest) {
  Inbox inbox;
  for (std::size_t i = 0; i < 5000; ++i) inbox.put({i, {}, 0});
  std::uint64_t lost = 0;
  const auto items = inbox.take(0, lost);
  ASSERT_EQ(items.size() + lost, 5000u);
  EXPECT_GT(lost, 0u);
  EXPECT_EQ(items.front().topic, lost);
  EXPECT_EQ(items.back().topic, 4999u);
}

}  // namespace
}  // namespace kilotwin::doors::ros2
