#include "clients/doors/tracked_frame.hpp"

#include <algorithm>

namespace kilotwin::doors {
namespace {

/// One column of a sample, which DDS reads but does not own.
template <class Value, class Sequence>
std::vector<Value> column(const TrackedFrame& frame, Value TrackedRobot::*field, Sequence& sequence) {
  std::vector<Value> values;
  values.reserve(frame.robots.size());
  for (const TrackedRobot& robot : frame.robots) values.push_back(robot.*field);
  sequence._length = sequence._maximum = static_cast<std::uint32_t>(values.size());
  sequence._buffer = values.data();
  sequence._release = false;
  return values;
}

}  // namespace

FrameWriter::FrameWriter(const dds::Participant& participant, std::string source, const dds::Channel& channel)
    : source_(std::move(source)), writer_(participant, channel) {}

void FrameWriter::write(const TrackedFrame& frame) {
  PublicTrackerFrame sample{};
  const std::size_t length = std::min(source_.size(), sizeof sample.source - 1);
  std::copy_n(source_.begin(), length, std::begin(sample.source));
  sample.frame = frame.frame;
  sample.capture_ns = frame.capture_ns;
  sample.sent_ns = frame.sent_ns;
  sample.clock = frame.utc ? 1 : 0;
  const auto robot = column(frame, &TrackedRobot::robot, sample.robot);
  const auto state = column(frame, &TrackedRobot::state, sample.state);
  const auto x_mm = column(frame, &TrackedRobot::x_mm, sample.x_mm);
  const auto y_mm = column(frame, &TrackedRobot::y_mm, sample.y_mm);
  const auto heading_rad = column(frame, &TrackedRobot::heading_rad, sample.heading_rad);
  const auto xx = column(frame, &TrackedRobot::xx_mm2, sample.xx_mm2);
  const auto xy = column(frame, &TrackedRobot::xy_mm2, sample.xy_mm2);
  const auto yy = column(frame, &TrackedRobot::yy_mm2, sample.yy_mm2);
  const auto heading_variance = column(frame, &TrackedRobot::heading_variance_rad2, sample.heading_variance_rad2);
  const auto led = column(frame, &TrackedRobot::led, sample.led);
  const auto vx = column(frame, &TrackedRobot::vx_mm_s, sample.vx_mm_s);
  const auto vy = column(frame, &TrackedRobot::vy_mm_s, sample.vy_mm_s);
  writer_.write(sample);
}

}  // namespace kilotwin::doors
