#include "clients/cli/vision/tracker_stream.hpp"

#include <chrono>
#include <utility>

#include "clients/track/led.hpp"
#include "core/base/clocks.hpp"

namespace kilotwin::cli {

TrackerStream::TrackerStream(const dds::Transport& transport, std::string source, SampleIds ids)
    : ids_(ids), participant_(transport), writer_(participant_, std::move(source)) {}

void TrackerStream::publish(std::uint64_t frame, std::int64_t capture_ns,
                            const std::vector<track::TrackedRobot>& robots) {
  doors::TrackedFrame sample{frame, capture_ns, 0, false, {}};
  for (const track::TrackedRobot& robot : robots) {
    if (ids_ == SampleIds::kNumbers && !robot.number) continue;
    doors::TrackedRobot& one = sample.robots.emplace_back();
    one.robot = ids_ == SampleIds::kNumbers ? *robot.number : robot.track;
    one.state = static_cast<std::uint8_t>(robot.state);
    one.x_mm = robot.position.x_mm;
    one.y_mm = robot.position.y_mm;
    one.xx_mm2 = static_cast<float>(robot.covariance.xx);
    one.xy_mm2 = static_cast<float>(robot.covariance.xy);
    one.yy_mm2 = static_cast<float>(robot.covariance.yy);
    if (robot.heading) {
      one.heading_rad = robot.heading->heading_rad;
      one.heading_variance_rad2 = static_cast<float>(robot.heading->variance_rad2);
    }
    if (robot.led_known) one.led = track::bits_of(robot.led);
  }
  sample.sent_ns = steady_ns();
  writer_.write(sample);
}

}  // namespace kilotwin::cli
