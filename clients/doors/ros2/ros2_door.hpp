/// A door to ROS 2 at work: between a ROS domain and the domain of a run.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "clients/doors/door.hpp"
#include "clients/doors/ros2/pose_reader.hpp"
#include "clients/doors/ros2/run_publisher.hpp"

namespace kilotwin::doors::ros2 {

/// How nodes of ROS are found.
struct Discovery {
  std::uint32_t domain = 0;
  bool multicast = false;          ///< by multicast, as nodes do by default; else by unicast
  std::vector<std::string> peers;  ///< machines to look at besides this one
  std::string configuration;       ///< a configuration of Cyclone DDS, in place of the two
};
/// Nodes that use unicast look for participant indices up to this one.
inline constexpr std::uint32_t kLastIndex = 32;
[[nodiscard]] dds::Transport transport_of(const Discovery& discovery);

class Ros2Door {
 public:
  /// The two domains differ. Throws RunError where a domain cannot be joined.
  Ros2Door(Door door, const dds::Transport& run, const Discovery& ros);
  /// Passes on what has come and what comes within `wait_ns`.
  void serve(std::int64_t wait_ns);
  [[nodiscard]] Tally& tally() { return maker_.tally(); }
  [[nodiscard]] std::uint64_t published() const { return publisher_ ? publisher_->published() : 0; }
  [[nodiscard]] const std::vector<ReadTopic>& topics() const { return maker_.topics(); }

 private:
  void send(std::vector<TrackedFrame> frames);

  Door door_;
  dds::Participant run_, ros_;
  FrameWriter writer_;
  FrameMaker maker_;
  Inbox inbox_;
  std::uint64_t lost_ = 0;
  Readers readers_;
  std::unique_ptr<RunPublisher> publisher_;
};

}  // namespace kilotwin::doors::ros2
