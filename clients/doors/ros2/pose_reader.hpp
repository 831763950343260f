/// Reads the topics of a door from a ROS domain and makes tracker frames of them.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "clients/doors/door.hpp"
#include "clients/doors/ros2/gatherer.hpp"
#include "clients/doors/ros2/messages.hpp"
#include "clients/doors/tally.hpp"

namespace kilotwin::doors::ros2 {

/// A topic that is read, after `{name}` has been replaced.
struct ReadTopic {
  std::string name;   ///< absolute
  std::string robot;  ///< whose topic it is; empty: messages name their robots
  proto::Ros2Topic::Type type = proto::Ros2Topic::NAMED_POSE_ARRAY;
  std::string frame_id;  ///< empty: any
};
[[nodiscard]] std::vector<ReadTopic> topics_of(const Door& door);

/// Messages that receive threads hand to the door's own thread.
class Inbox {
 public:
  struct Item {
    std::size_t topic = 0;
    Message message;
    std::int64_t arrived_utc_ns = 0;
  };
  /// The oldest is lost where too many wait.
  void put(Item item);
  /// Waits for items, until `deadline_ns` on the steady clock. `lost` is increased by the items that were lost.
  [[nodiscard]] std::vector<Item> take(std::int64_t deadline_ns, std::uint64_t& lost);

 private:
  std::mutex mutex_;
  std::condition_variable filled_;
  std::deque<Item> items_;
  std::uint64_t lost_ = 0;
};

/// Turns messages into frames: names to robots, coordinates to the arena's, stamps to frames. Pure: times are given.
class FrameMaker {
 public:
  FrameMaker(const Door& door, std::vector<ReadTopic> topics);
  [[nodiscard]] std::vector<TrackedFrame> add(const Inbox::Item& item, std::int64_t now_ns);
  [[nodiscard]] std::vector<TrackedFrame> expire(std::int64_t now_ns);
  [[nodiscard]] std::optional<std::int64_t> deadline_ns() const { return gatherer_.deadline_ns(); }
  [[nodiscard]] const std::vector<ReadTopic>& topics() const { return topics_; }
  [[nodiscard]] Tally& tally() { return tally_; }

 private:
  [[nodiscard]] std::optional<TrackedRobot> robot_of(const NamedPose& pose);
  [[nodiscard]] std::vector<TrackedFrame> counted(std::vector<TrackedFrame> frames);

  const Door& door_;
  std::vector<ReadTopic> topics_;
  double max_tilt_rad_;
  Gatherer gatherer_;
  Tally tally_;
};

/// Readers of all topics; they fill the inbox.
class Readers {
 public:
  Readers(const dds::Participant& participant, const std::vector<ReadTopic>& topics, Inbox& inbox);
  ~Readers();
  Readers(const Readers&) = delete;
  Readers& operator=(const Readers&) = delete;

 private:
  struct Any {
    virtual ~Any() = default;
  };
  template <class T> struct Of;
  std::vector<std::unique_ptr<Any>> readers_;
};

}  // namespace kilotwin::doors::ros2
