/// Shows the robots of a run to ROS 2: topic kilotwin/robots becomes a PoseArray, and simulated time becomes /clock.
#pragma once

#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "clients/doors/door.hpp"
#include "clients/doors/ros2/types.hpp"

namespace kilotwin::doors::ros2 {

/// Collects samples, which arrive one by one and may be lost, into snapshots of all robots' poses at one time. A robot whose sample
/// was lost keeps its last pose. The first snapshot comes after every robot was seen once. A new run, or a time before the last
/// one, resets the collection.
class Snapshots {
 public:
  struct Pose {
    double x_mm = 0, y_mm = 0, heading_rad = 0;
  };
  struct Snapshot {
    double time_s = 0;
    std::vector<Pose> poses;  ///< by robot
  };
  explicit Snapshots(std::size_t robots) : poses_(robots), seen_at_s_(robots) {}
  /// Returns the snapshot that the sample completes, or that its time ends.
  std::optional<Snapshot> add(const PublicRobotState& sample);

 private:
  [[nodiscard]] std::optional<Snapshot> taken();

  std::vector<Pose> poses_;
  std::vector<std::optional<double>> seen_at_s_;
  std::uint64_t run_ = 0;
  double time_s_ = -1;
  std::size_t never_seen_ = 0, at_this_time_ = 0;
  bool was_returned_ = true;  ///< the snapshot of this time was returned
};

class RunPublisher {
 public:
  /// Reads the run by `run` and publishes by `ros`. `door` must outlive it.
  RunPublisher(const Door& door, const dds::Participant& run, const dds::Participant& ros);
  /// Publishes the latest snapshot if it has not been published. Throws RunError where DDS refuses a sample.
  void publish();
  [[nodiscard]] std::uint64_t published() const { return published_; }

 private:
  void write_poses(const Snapshots::Snapshot& snapshot);

  const Door& door_;
  std::mutex mutex_;
  Snapshots snapshots_;
  std::optional<Snapshots::Snapshot> latest_;
  std::uint64_t published_ = 0;
  std::optional<dds::Writer<PoseArray>> poses_;
  std::optional<dds::Writer<Clock>> clock_;
  dds::Reader<PublicRobotState> robots_;
};

}  // namespace kilotwin::doors::ros2
