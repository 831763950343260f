// The tracker of bench/tracking and bench/endurance: robots that circle at 10 mm/s, on a square grid around the origin.
// Usage: synthetic_tracker DOMAIN FIRST COUNT PITCH_MM [PACE]. PACE: that of the run, default 1. It ends upon SIGINT or SIGTERM.
#include "tests/system/synthetic_tracker.hpp"

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <iostream>

#include "core/os/interrupt.hpp"

int main(int argc, char** argv) {
  using namespace kilotwin;
  if (argc != 5 && argc != 6) {
    std::cerr << "usage: synthetic_tracker DOMAIN FIRST COUNT PITCH_MM [PACE]\n";
    return 2;
  }
  constexpr double kSpeed_mm_s = 10, kRadius_mm = 20;
  const auto number = [&](int i) { return static_cast<std::uint32_t>(std::strtoul(argv[i], nullptr, 10)); };
  const std::uint32_t first = number(2), count = number(3);
  const double pitch_mm = std::strtod(argv[4], nullptr);
  const auto columns = static_cast<std::uint32_t>(std::ceil(std::sqrt(count)));
  const double middle = (columns - 1) / 2.0;
  std::vector<test::CirclingRobot> robots;
  for (std::uint32_t n = 0; n < count; ++n) {
    test::CirclingRobot& robot = robots.emplace_back();
    robot.robot = first + n;
    robot.x_mm = (n % columns - middle) * pitch_mm;
    robot.y_mm = (n / columns - middle) * pitch_mm;
    robot.radius_mm = kRadius_mm;
    robot.rate_rad_s = kSpeed_mm_s / kRadius_mm;
    robot.phase_rad = n;
  }
  const dds::Participant participant({number(1), {}});
  test::TrackerKind kind;
  if (argc == 6) kind.pace = std::strtod(argv[5], nullptr);
  test::SyntheticTracker tracker(participant, kind, robots);
  catch_interrupts();
  tracker.start();
  while (interrupted() == 0) std::this_thread::sleep_for(std::chrono::milliseconds(100));
}
