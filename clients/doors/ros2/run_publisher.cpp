#include "clients/doors/ros2/run_publisher.hpp"

#include <chrono>
#include <cmath>

#include "clients/doors/ros2/messages.hpp"
#include "core/base/clocks.hpp"

namespace kilotwin::doors::ros2 {
namespace {

constexpr double kRunNsPerS = 1e9;

}  // namespace

std::optional<Snapshots::Snapshot> Snapshots::taken() {
  if (was_returned_ || never_seen_ > 0) return std::nullopt;
  was_returned_ = true;
  return Snapshot{time_s_, poses_};
}

std::optional<Snapshots::Snapshot> Snapshots::add(const PublicRobotState& sample) {
  if (sample.robot >= poses_.size() || !std::isfinite(sample.time_s)) return std::nullopt;
  std::optional<Snapshot> complete;
  if (sample.run != run_ || sample.time_s < time_s_ || time_s_ < 0) {
    seen_at_s_.assign(poses_.size(), std::nullopt);
    never_seen_ = poses_.size();
    at_this_time_ = 0;
    was_returned_ = false;
    run_ = sample.run;
  } else if (sample.time_s > time_s_) {
    complete = taken();
    at_this_time_ = 0;
    was_returned_ = false;
  }
  time_s_ = sample.time_s;
  std::optional<double>& seen_at_s = seen_at_s_[sample.robot];
  if (!seen_at_s) --never_seen_;
  if (!seen_at_s || *seen_at_s < time_s_) ++at_this_time_;
  seen_at_s = time_s_;
  poses_[sample.robot] = {sample.x_mm, sample.y_mm, sample.heading_rad};
  if (at_this_time_ == poses_.size()) {
    if (auto all = taken()) return all;
  }
  return complete;
}

RunPublisher::RunPublisher(const Door& door, const dds::Participant& run, const dds::Participant& ros)
    : door_(door),
      snapshots_(door.names.robots()),
      robots_(run, topics::robots(), [this](const PublicRobotState& sample, dds::SampleState state) {
        if (!state.valid) return;
        const std::lock_guard lock(mutex_);
        if (auto snapshot = snapshots_.add(sample)) latest_ = std::move(snapshot);
      }) {
  const proto::Ros2Publish& publish = door.settings.ros2().publish();
  if (publish.has_poses()) poses_.emplace(ros, channel<PoseArray>(publish.poses(), dds::Delivery::kNode));
  if (publish.clock()) clock_.emplace(ros, channel<Clock>("/clock", dds::Delivery::kNode));
}

void RunPublisher::publish() {
  std::optional<Snapshots::Snapshot> snapshot;
  {
    const std::lock_guard lock(mutex_);
    snapshot = std::exchange(latest_, std::nullopt);
  }
  if (!snapshot) return;
  // The clock goes first: nodes must know the time of a stamp when they see it.
  if (clock_) clock_->write(Clock{time_of(std::llround(snapshot->time_s * kRunNsPerS))});
  if (poses_) write_poses(*snapshot);
  ++published_;
}

void RunPublisher::write_poses(const Snapshots::Snapshot& snapshot) {
  std::string frame_id = door_.settings.ros2().publish().frame_id();
  std::vector<Pose> poses;
  poses.reserve(snapshot.poses.size());
  for (const Snapshots::Pose& pose : snapshot.poses)
    poses.push_back(pose_of(door_.placement.from_arena(pose.x_mm, pose.y_mm, pose.heading_rad)));
  PoseArray sample{};
  sample.header.stamp = time_of(clock_ ? std::llround(snapshot.time_s * kRunNsPerS) : utc_ns());
  sample.header.frame_id = frame_id.data();
  sample.poses._length = sample.poses._maximum = static_cast<std::uint32_t>(poses.size());
  sample.poses._buffer = poses.data();
  poses_->write(sample);
}

}  // namespace kilotwin::doors::ros2
