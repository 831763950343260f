// Writes what tests of the page and measurements read:
//   view_samples recording FILE ROBOTS STATES EVERY_S    a recording of robots on circles
//   view_samples frame FRAME EXPECTED                    a frame, and what it holds as JSON
#include <fmt/format.h>

#include <cstdlib>
#include <nlohmann/json.hpp>
#include <string>

#include "clients/view/frame_code.hpp"
#include "core/os/files.hpp"
#include "tests/clients/view/recordings.hpp"

namespace {

using namespace kilotwin;

int write_frame(const std::string& file, const std::string& expected) {
  constexpr std::uint32_t kRobots = 257;  // odd, so that no column but the first is aligned by chance
  std::vector<double> x, y, heading;
  std::vector<std::uint8_t> led, life, left, right;
  const std::vector<double> mx{10, -20, 30.5}, my{1, 2, 3}, mh{0, 0.5, -3};
  nlohmann::json robots = nlohmann::json::array();
  for (std::size_t i = 0; i < kRobots; ++i) {
    const Pose pose = test::circling_pose(static_cast<std::uint32_t>(i), kRobots, static_cast<double>(i));
    x.push_back(pose.x_mm);
    y.push_back(pose.y_mm);
    heading.push_back(pose.heading_rad);
    led.push_back(static_cast<std::uint8_t>(i % 64));
    life.push_back(static_cast<std::uint8_t>(i % 9 < 7 ? i % 9 : 248 + i % 9 - 1));
    left.push_back(i % 2 ? 255 : 0);
    right.push_back(i % 3 ? 1 : 0);
    robots.push_back({{"x", x[i]},
                      {"y", y[i]},
                      {"heading", heading[i]},
                      {"led", led[i]},
                      {"life", life[i] & 15},
                      {"left", left[i] > 0},
                      {"right", right[i] > 0}});
  }
  const view::PositionGrid grid = view::PositionGrid::over(1000, 1000);
  os::write_file(file, view::encode_frame({3, 1234567890123, 1234567890456},
                                          {x, y, heading, led, life, left, right, mx, my, mh}, grid));
  os::write_file(expected, nlohmann::json{{"request", 3},
                                          {"tick", 1234567890123},
                                          {"nextTick", 1234567890456},
                                          {"movables", {10, -20, 30.5, 1, 2, 3, 0, 0.5, -3}},
                                          {"gridLowest", grid.lowest_mm},
                                          {"gridStep", grid.step_mm},
                                          {"robots", robots}}
                               .dump());
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string what = argc > 1 ? argv[1] : "";
  if (what == "frame" && argc == 4) return write_frame(argv[2], argv[3]);
  if (what == "recording" && argc == 6) {
    test::write_circling(argv[2], {.robots = static_cast<std::uint32_t>(std::atoi(argv[3])),
                                   .states = std::atoi(argv[4]),
                                   .every_s = std::atof(argv[5]),
                                   .floors = true,
                                   .outside = true,
                                   .flights = true,
                                   .placed = true});
    return 0;
  }
  fmt::print(stderr, "view_samples: expected recording FILE ROBOTS STATES EVERY_S, or frame FRAME EXPECTED\n");
  return 2;
}
