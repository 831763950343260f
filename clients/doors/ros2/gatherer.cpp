#include "clients/doors/ros2/gatherer.hpp"

#include <algorithm>

namespace kilotwin::doors::ros2 {
namespace {

/// A stamp so much older than the last is no late message: the source was restarted, or its clock set.
constexpr std::int64_t kRestart_ns = 1'000'000'000;

}  // namespace

bool Gatherer::complete(const Pending& pending) const {
  if (pending.whole) return true;
  return !expected_.empty() && std::all_of(expected_.begin(), expected_.end(),
                                           [&](std::uint32_t robot) { return pending.robots.contains(robot); });
}

std::vector<TrackedFrame> Gatherer::add(Arrival arrival, std::int64_t now_ns, Tally& tally) {
  if (last_stamp_ns_ && arrival.stamp_ns <= *last_stamp_ns_) {
    if (arrival.stamp_ns >= *last_stamp_ns_ - kRestart_ns) {
      tally.left_out("messages that came after the frame of their stamp");
      for (const TrackedRobot& robot : arrival.robots) expected_.insert(robot.robot);
      return {};
    }
    last_stamp_ns_.reset();
    pending_.clear();
  }
  const auto [found, first] = pending_.try_emplace(arrival.stamp_ns);
  Pending& pending = found->second;
  if (first) pending.since_ns = now_ns;
  if (arrival.frame_number) pending.frame_number = arrival.frame_number;
  pending.whole = pending.whole || arrival.whole;
  for (const TrackedRobot& robot : arrival.robots) {
    if (!pending.robots.emplace(robot.robot, robot).second)
      tally.left_out("poses of a robot that the frame has already");
  }
  if (complete(pending)) return release(arrival.stamp_ns);
  return expire(now_ns);
}

std::vector<TrackedFrame> Gatherer::expire(std::int64_t now_ns) {
  std::optional<std::int64_t> last;
  for (const auto& [stamp, pending] : pending_) {
    if (now_ns - pending.since_ns >= hold_ns_) last = stamp;
  }
  return last ? release(*last) : std::vector<TrackedFrame>{};
}

std::optional<std::int64_t> Gatherer::deadline_ns() const {
  std::optional<std::int64_t> earliest;
  for (const auto& [stamp, pending] : pending_) {
    const std::int64_t deadline = pending.since_ns + hold_ns_;
    earliest = earliest ? std::min(*earliest, deadline) : deadline;
  }
  return earliest;
}

std::vector<TrackedFrame> Gatherer::release(std::int64_t up_to_stamp_ns) {
  std::vector<TrackedFrame> frames;
  while (!pending_.empty() && pending_.begin()->first <= up_to_stamp_ns) {
    const auto& [stamp, pending] = *pending_.begin();
    TrackedFrame frame;
    frame.capture_ns = stamp;
    frame.frame = pending.frame_number.value_or(next_frame_);
    next_frame_ = frame.frame + 1;
    expected_.clear();
    for (const auto& [id, robot] : pending.robots) {
      frame.robots.push_back(robot);
      expected_.insert(id);
    }
    last_stamp_ns_ = stamp;
    frames.push_back(std::move(frame));
    pending_.erase(pending_.begin());
  }
  return frames;
}

}  // namespace kilotwin::doors::ros2
