#include "clients/doors/ros2/pose_reader.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cmath>

#include "core/base/clocks.hpp"
#include "core/base/pose.hpp"

namespace kilotwin::doors::ros2 {
namespace {

using SteadyTime = std::chrono::steady_clock::time_point;
using std::chrono::nanoseconds;

constexpr std::string_view kName = "{name}";
constexpr std::size_t kMostWaiting = 4096;
constexpr double kNsPerMs = 1e6;

const char* reason_of(Fault fault) {
  switch (fault) {
    case Fault::kNotFinite: return "poses that are not finite";
    case Fault::kQuaternion: return "poses whose quaternion is no rotation";
    default: return "poses that lean more than max_tilt_deg";
  }
}

}  // namespace

std::vector<ReadTopic> topics_of(const Door& door) {
  std::vector<ReadTopic> topics;
  for (const proto::Ros2Topic& topic : door.settings.ros2().topic()) {
    const std::size_t at = topic.name().find(kName);
    if (at == std::string::npos) {
      topics.push_back({topic.name(), "", topic.type(), topic.frame_id()});
      continue;
    }
    for (const std::string& robot : door.names.names()) {
      std::string name = topic.name();
      name.replace(at, kName.size(), robot);
      topics.push_back({std::move(name), robot, topic.type(), topic.frame_id()});
    }
  }
  return topics;
}

void Inbox::put(Item item) {
  const std::lock_guard lock(mutex_);
  if (items_.size() == kMostWaiting) {
    items_.pop_front();
    ++lost_;
  }
  items_.push_back(std::move(item));
  filled_.notify_one();
}

std::vector<Inbox::Item> Inbox::take(std::int64_t deadline_ns, std::uint64_t& lost) {
  std::unique_lock lock(mutex_);
  filled_.wait_until(lock, SteadyTime(nanoseconds(deadline_ns)), [this] { return !items_.empty(); });
  std::vector<Item> all(std::make_move_iterator(items_.begin()), std::make_move_iterator(items_.end()));
  items_.clear();
  lost += std::exchange(lost_, 0);
  return all;
}

FrameMaker::FrameMaker(const Door& door, std::vector<ReadTopic> topics)
    : door_(door),
      topics_(std::move(topics)),
      max_tilt_rad_(door.settings.ros2().max_tilt_deg() * kPi / 180),
      gatherer_(std::llround(door.settings.ros2().gather_ms() * kNsPerMs)) {}

std::optional<TrackedRobot> FrameMaker::robot_of(const NamedPose& pose) {
  const auto robot = pose.number ? door_.names.of_number(*pose.number) : door_.names.of_name(pose.name);
  if (!robot) {
    tally_.left_out("poses that belong to no tracked robot",
                    pose.number ? fmt::format("number {}", *pose.number) : fmt::format("\"{}\"", pose.name));
    return std::nullopt;
  }
  TrackedRobot placed;
  placed.robot = *robot;
  const Fault fault = door_.placement.place(pose.pose, max_tilt_rad_, placed);
  if (fault != Fault::kNone) {
    tally_.left_out(reason_of(fault), fmt::format("robot {}", *robot));
    return std::nullopt;
  }
  if (pose.covariance) door_.placement.spread(*pose.covariance, placed);
  return placed;
}

std::vector<TrackedFrame> FrameMaker::add(const Inbox::Item& item, std::int64_t now_ns) {
  const ReadTopic& topic = topics_[item.topic];
  const Message& message = item.message;
  if (!topic.frame_id.empty() && message.frame_id != topic.frame_id) {
    tally_.left_out("messages of another frame_id", fmt::format("\"{}\" on {}", message.frame_id, topic.name));
    return {};
  }
  const bool by_arrival = door_.settings.ros2().stamp() == proto::Ros2Door::ARRIVAL;
  if (!by_arrival && !message.stamp_ns) {
    tally_.left_out("messages whose stamp is no time; set stamp: ARRIVAL where the driver sets none", topic.name);
    return {};
  }
  Gatherer::Arrival arrival;
  arrival.stamp_ns = by_arrival ? item.arrived_utc_ns : *message.stamp_ns;
  // Another topic may bring further robots of the stamp.
  arrival.whole = by_arrival || (message.whole && topics_.size() == 1);
  if (topics_.size() == 1) arrival.frame_number = message.frame_number;
  for (const NamedPose& pose : message.poses) {
    if (const auto robot = robot_of(pose)) arrival.robots.push_back(*robot);
  }
  if (arrival.robots.empty() && !arrival.whole) return {};
  return counted(gatherer_.add(std::move(arrival), now_ns, tally_));
}

std::vector<TrackedFrame> FrameMaker::expire(std::int64_t now_ns) { return counted(gatherer_.expire(now_ns)); }

std::vector<TrackedFrame> FrameMaker::counted(std::vector<TrackedFrame> frames) {
  for (TrackedFrame& frame : frames) {
    frame.utc = door_.settings.ros2().utc();
    tally_.passed(frame.robots.size());
  }
  return frames;
}

template <class T> struct Readers::Of : Any {
  Of(const dds::Participant& participant, const ReadTopic& topic, std::size_t index, Inbox& inbox)
      : reader(participant, channel<T>(topic.name, dds::Delivery::kSensor),
               [robot = topic.robot, index, &inbox](const T& sample, dds::SampleState state) {
                 if (!state.valid) return;
                 const std::int64_t arrived_ns = utc_ns();
                 for (Message& message : read(sample, robot)) inbox.put({index, std::move(message), arrived_ns});
               }) {}
  dds::Reader<T> reader;
};

Readers::Readers(const dds::Participant& participant, const std::vector<ReadTopic>& topics, Inbox& inbox) {
  const auto add = [&]<class T>(std::size_t i) {
    readers_.push_back(std::make_unique<Of<T>>(participant, topics[i], i, inbox));
  };
  for (std::size_t i = 0; i < topics.size(); ++i) {
    switch (topics[i].type) {
      case proto::Ros2Topic::NAMED_POSE_ARRAY: add.template operator()<NamedPoseArray>(i); break;
      case proto::Ros2Topic::POSE_ARRAY: add.template operator()<PoseArray>(i); break;
      case proto::Ros2Topic::POSE_STAMPED: add.template operator()<PoseStamped>(i); break;
      case proto::Ros2Topic::POSE_WITH_COVARIANCE_STAMPED:
        add.template operator()<PoseWithCovarianceStamped>(i);
        break;
      case proto::Ros2Topic::TF_MESSAGE: add.template operator()<TFMessage>(i); break;
      case proto::Ros2Topic::RIGID_BODIES: add.template operator()<RigidBodies>(i); break;
    }
  }
}

Readers::~Readers() = default;

}  // namespace kilotwin::doors::ros2
