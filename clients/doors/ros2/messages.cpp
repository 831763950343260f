#include "clients/doors/ros2/messages.hpp"

#include <algorithm>
#include <limits>
#include <span>

namespace kilotwin::doors::ros2 {
namespace {

constexpr std::int64_t kNsPerS = 1'000'000'000;

std::string text_of(const char* text) { return text == nullptr ? std::string{} : std::string{text}; }

/// A stamp of 0 is what a driver leaves that sets none.
std::optional<std::int64_t> stamp_of(const Time& time) {
  if (time.nanosec >= kNsPerS || (time.sec == 0 && time.nanosec == 0)) return std::nullopt;
  return time.sec * kNsPerS + time.nanosec;
}

Message begin(const Header& header, bool whole) {
  Message message;
  message.stamp_ns = stamp_of(header.stamp);
  message.frame_id = text_of(header.frame_id);
  message.whole = whole;
  return message;
}

SourcePose pose_of(const Pose& pose) {
  return {pose.position.x,    pose.position.y,    pose.position.z,   pose.orientation.x,
          pose.orientation.y, pose.orientation.z, pose.orientation.w};
}

template <class Sequence> auto elements(const Sequence& sequence) {
  return std::span(sequence._buffer, sequence._length);
}

}  // namespace

std::vector<Message> read(const NamedPoseArray& sample, const std::string&) {
  Message message = begin(sample.header, true);
  for (const auto& named : elements(sample.poses))
    message.poses.push_back({text_of(named.name), {}, pose_of(named.pose), {}});
  return {std::move(message)};
}

std::vector<Message> read(const PoseArray& sample, const std::string&) {
  Message message = begin(sample.header, true);
  for (const auto& pose : elements(sample.poses))
    message.poses.push_back({{}, message.poses.size(), pose_of(pose), {}});
  return {std::move(message)};
}

std::vector<Message> read(const PoseStamped& sample, const std::string& name) {
  Message message = begin(sample.header, false);
  message.poses.push_back({name, {}, pose_of(sample.pose), {}});
  return {std::move(message)};
}

std::vector<Message> read(const PoseWithCovarianceStamped& sample, const std::string& name) {
  // Rows and columns x, y, z, about x, about y, about z.
  const auto entry = [&](int row, int column) { return sample.pose.covariance[6 * row + column]; };
  const SourceCovariance covariance{entry(0, 0), entry(0, 1), entry(0, 2), entry(1, 1),
                                    entry(2, 2), entry(4, 4), entry(5, 5)};
  Message message = begin(sample.header, false);
  message.poses.push_back({name, {}, pose_of(sample.pose.pose), covariance});
  return {std::move(message)};
}

std::vector<Message> read(const TFMessage& sample, const std::string&) {
  std::vector<Message> messages;
  for (const auto& each : elements(sample.transforms)) {
    Message next = begin(each.header, false);
    const bool same =
        !messages.empty() && messages.back().stamp_ns == next.stamp_ns && messages.back().frame_id == next.frame_id;
    if (!same) messages.push_back(std::move(next));
    const auto& [at, turned] = each.transform;
    messages.back().poses.push_back(
        {text_of(each.child_frame_id), {}, {at.x, at.y, at.z, turned.x, turned.y, turned.z, turned.w}, {}});
  }
  return messages;
}

std::vector<Message> read(const RigidBodies& sample, const std::string&) {
  Message message = begin(sample.header, true);
  message.frame_number = sample.frame_number;
  for (const auto& body : elements(sample.rigidbodies))
    message.poses.push_back({text_of(body.rigid_body_name), {}, pose_of(body.pose), {}});
  return {std::move(message)};
}

Time time_of(std::int64_t time_ns) {
  const std::int64_t seconds = std::min<std::int64_t>(time_ns / kNsPerS, std::numeric_limits<std::int32_t>::max());
  return {static_cast<std::int32_t>(seconds), static_cast<std::uint32_t>(time_ns % kNsPerS)};
}

Pose pose_of(const SourcePose& pose) { return {{pose.x, pose.y, pose.z}, {pose.qx, pose.qy, pose.qz, pose.qw}}; }

}  // namespace kilotwin::doors::ros2
