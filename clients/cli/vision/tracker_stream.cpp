#include "clients/cli/vision/tracker_stream.hpp"

#include <chrono>
#include <limits>
#include <utility>

#include "clients/track/led.hpp"

namespace kilotwin::cli {
namespace {

constexpr std::uint8_t kLedUnknown = 255;

/// Lets a sequence of the wire refer to a vector, which must outlive the sample.
template <class Sequence, class Value> void refer(Sequence& sequence, std::vector<Value>& values) {
  sequence._length = sequence._maximum = static_cast<std::uint32_t>(values.size());
  sequence._buffer = values.data();
  sequence._release = false;
}

}  // namespace

TrackerStream::TrackerStream(const dds::Transport& transport, std::string source, SampleIds ids)
    : source_(std::move(source)),
      ids_(ids),
      participant_(transport),
      writer_(participant_, topics::tracker_frames()) {}

void TrackerStream::publish(std::uint64_t frame, std::int64_t capture_ns,
                            const std::vector<track::TrackedRobot>& robots) {
  std::vector<std::uint32_t> ids;
  std::vector<std::uint8_t> states, leds;
  std::vector<double> x, y, heading;
  std::vector<float> xx, xy, yy, variance;
  for (const track::TrackedRobot& robot : robots) {
    if (ids_ == SampleIds::kNumbers && !robot.number) continue;
    ids.push_back(ids_ == SampleIds::kNumbers ? *robot.number : robot.track);
    states.push_back(static_cast<std::uint8_t>(robot.state));
    x.push_back(robot.position.x_mm);
    y.push_back(robot.position.y_mm);
    heading.push_back(robot.heading ? robot.heading->heading_rad : 0);
    xx.push_back(static_cast<float>(robot.covariance.xx));
    xy.push_back(static_cast<float>(robot.covariance.xy));
    yy.push_back(static_cast<float>(robot.covariance.yy));
    variance.push_back(robot.heading ? static_cast<float>(robot.heading->variance_rad2)
                                     : std::numeric_limits<float>::infinity());
    leds.push_back(robot.led_known ? track::bits_of(robot.led) : kLedUnknown);
  }
  PublicTrackerFrame sample{};
  source_.copy(sample.source, sizeof sample.source - 1);
  sample.frame = frame;
  sample.capture_ns = capture_ns;
  sample.clock = 0;
  refer(sample.robot, ids);
  refer(sample.state, states);
  refer(sample.x_mm, x);
  refer(sample.y_mm, y);
  refer(sample.heading_rad, heading);
  refer(sample.xx_mm2, xx);
  refer(sample.xy_mm2, xy);
  refer(sample.yy_mm2, yy);
  refer(sample.heading_variance_rad2, variance);
  refer(sample.led, leds);
  sample.sent_ns =
      std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now().time_since_epoch())
          .count();
  writer_.write(sample);
}

}  // namespace kilotwin::cli
