// A day of tracking as fast as it goes: 100 robots at 30 Hz of source time through the clock model, the filters and the frames
// of every tick. Prints the memory of the process over source time and the errors of stamps; status 1 if the memory grows
// after the first twentieth, or if the 99th percentile of the errors reaches 1 ms.
// Usage: tracked_day [HOURS]
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <random>

#include "services/ark/tracking/clock_model.hpp"
#include "services/ark/tracking/latency_histogram.hpp"
#include "services/ark/tracking/tracked_swarm.hpp"
#include "tests/support/scenes.hpp"

namespace kilotwin {
namespace {

constexpr std::uint32_t kRobots = 100;
constexpr double kFrames_per_s = 30, kTick_s = 0.032768, kAhead_s = 37, kDrift = 50e-6, kQueue_s = 0.003;

double memory_mib() {
  std::ifstream statm("/proc/self/statm");
  double total = 0, resident = 0;
  statm >> total >> resident;
  return resident * 4096 / 1048576;
}

/// Robots that circle, each at its own place.
TrackerSample seen_at(double t_s, std::int64_t cycle, std::mt19937_64& random) {
  std::normal_distribution<float> noise(0, 0.5F);
  TrackerSample sample;
  sample.capture_cycle = cycle;
  for (std::uint32_t robot = 0; robot < kRobots; ++robot) {
    const double angle = 0.2 * t_s + robot;
    sample.robot.push_back(robot);
    sample.state.push_back(0);
    sample.x.push_back(static_cast<float>(100.0 * (robot % 10) - 450 + 40 * std::cos(angle)) + noise(random));
    sample.y.push_back(static_cast<float>(100.0 * std::floor(robot / 10.0) - 450 + 40 * std::sin(angle)) +
                       noise(random));
    sample.heading_rad.push_back(static_cast<float>(std::remainder(angle, 2 * M_PI)));
    sample.xx.push_back(0.25F);
    sample.xy.push_back(0);
    sample.yy.push_back(0.25F);
    sample.heading_variance_rad2.push_back(0.01F);
    sample.led.push_back(static_cast<std::uint8_t>(robot % 64));
  }
  return sample;
}

int run(double hours) {
  const RunPlan plan = testing::make_plan("robots { count: 100 body: TRACKED }",
                                          testing::grid_crowd(kRobots, 60, testing::Facing::kRight));
  ark::ClockModel clock;
  ark::TrackedSwarm swarm(plan);
  ark::LatencyHistogram error, way;
  TrackingFrame frame;
  std::mt19937_64 random(1);
  std::exponential_distribution<double> queue(1 / kQueue_s);
  const auto frames = static_cast<std::uint64_t>(hours * 3600 * kFrames_per_s);
  double at_first_mib = 0;
  Tick now;
  fmt::print("source time, h   memory, MiB\n");
  for (std::uint64_t n = 1; n <= frames; ++n) {
    const double capture_s = static_cast<double>(n) / kFrames_per_s, sent_s = capture_s + 0.012;
    const double arrival_s = sent_s + queue(random);
    const auto reading = [](double t_s) { return std::llround((kAhead_s + (1 + kDrift) * t_s) * 1e9); };
    const auto stamp =
        clock.take({n, reading(capture_s), reading(sent_s), false, std::llround(arrival_s * 1e9), 0});
    if (!stamp) continue;
    const double stamped_s = static_cast<double>(stamp->capture_ns) * 1e-9;
    if (clock.warm()) error.add(std::abs(stamped_s - capture_s));
    way.add(arrival_s - sent_s);
    const TrackerSample sample = seen_at(capture_s, std::llround(stamped_s * kNominalClockHz), random);
    for (; static_cast<double>(now.count() + 1) * kTick_s < arrival_s; ++now) {
      swarm.take(now, {});
      swarm.emit(now, frame);
      swarm.commit({});
    }
    swarm.take(now, std::span(&sample, 1));
    swarm.emit(now, frame);
    swarm.commit({});
    ++now;
    if (n % std::max<std::uint64_t>(frames / 20, 1) != 0) continue;
    const double mib = memory_mib();
    if (at_first_mib == 0) at_first_mib = mib;
    fmt::print("{:14.2f} {:13.2f}\n", capture_s / 3600, mib);
  }
  const double growth_mib = memory_mib() - at_first_mib;
  const double p99_ms = 1e3 * error.quantile_s(0.99);
  fmt::print("{} samples of {} robots; growth {:.2f} MiB; stamp error p50 {:.3f} ms, p99 {:.3f} ms\n", frames,
             kRobots, growth_mib, 1e3 * error.quantile_s(0.5), p99_ms);
  return growth_mib < 0.5 && p99_ms < 1 && frame.robot.size() == kRobots ? 0 : 1;
}

}  // namespace
}  // namespace kilotwin

int main(int count, char** words) { return kilotwin::run(count > 1 ? std::atof(words[1]) : 24); }
