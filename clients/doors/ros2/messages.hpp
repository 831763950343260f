/// From ROS messages to poses with names, and from poses of the arena to ROS messages.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "clients/doors/placement.hpp"
#include "clients/doors/ros2/types.hpp"

namespace kilotwin::doors::ros2 {

/// A pose as a message names it.
struct NamedPose {
  std::string name;                     ///< empty where `number` says whose it is
  std::optional<std::uint64_t> number;  ///< place in a PoseArray
  SourcePose pose;
  std::optional<SourceCovariance> covariance;
};

/// Poses of one header.
struct Message {
  std::optional<std::int64_t> stamp_ns;  ///< absent: the header holds no time
  std::string frame_id;
  /// All robots of the stamp are in it; else further messages may bring more.
  bool whole = true;
  std::optional<std::uint64_t> frame_number;
  std::vector<NamedPose> poses;
};

/// `name`: whose topic it is; empty where messages name their robots.
[[nodiscard]] std::vector<Message> read(const NamedPoseArray& sample, const std::string& name);
[[nodiscard]] std::vector<Message> read(const PoseArray& sample, const std::string& name);
[[nodiscard]] std::vector<Message> read(const PoseStamped& sample, const std::string& name);
[[nodiscard]] std::vector<Message> read(const PoseWithCovarianceStamped& sample, const std::string& name);
/// One message per header.
[[nodiscard]] std::vector<Message> read(const TFMessage& sample, const std::string& name);
[[nodiscard]] std::vector<Message> read(const RigidBodies& sample, const std::string& name);

/// `time_ns`: since the epoch, at least 0. Seconds beyond 2^31 - 1 are cut to it, as ROS has no later time.
[[nodiscard]] Time time_of(std::int64_t time_ns);
[[nodiscard]] Pose pose_of(const SourcePose& pose);

}  // namespace kilotwin::doors::ros2
