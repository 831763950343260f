#include "clients/identify/kilogrid/track_windows.hpp"

#include <algorithm>
#include <cmath>
#include <complex>

namespace kilotwin::kilogrid {
namespace {

constexpr std::size_t kWindow = 20;  // blocks
constexpr double kStill_mm = 16, kMoving_mm = 40, kBeside_mm = 60;

}  // namespace

const std::vector<std::string>& feature_names() {
  static const std::vector<std::string> names = {
      "mean step",     "spread of steps",  "still",  "longest rest",  "mean turn",     "sharp turns",
      "side of turns", "net displacement", "extent", "beside a wall", "wall distance", "without reports"};
  return names;
}

std::vector<TrackWindow> windows_of(const FloorBlocks& blocks, const Floor& floor) {
  std::vector<TrackWindow> windows;
  for (std::size_t robot = 0; robot < blocks.robots(); ++robot) {
    const std::vector<double>&x = blocks.x_mm[robot], &y = blocks.y_mm[robot];
    for (std::size_t begin = 0; begin + kWindow <= blocks.blocks; begin += kWindow) {
      std::vector<std::size_t> heard;
      for (std::size_t k = begin; k < begin + kWindow; ++k) {
        if (!std::isnan(x[k])) heard.push_back(k);
      }
      if (heard.size() < kWindow / 2) continue;
      double step = 0, square = 0, steps = 0, still = 0, row = 0, longest = 0, turn = 0, sharp = 0, side = 0,
             turns = 0;
      double wall = 0, beside = 0;
      std::complex<double> last = 0;
      std::size_t last_at = 0;
      for (std::size_t i = 0; i < heard.size(); ++i) {
        const std::size_t k = heard[i];
        const double wall_mm = wall_distance_mm(floor, x[k], y[k]);
        wall += wall_mm;
        beside += wall_mm < kBeside_mm ? 1 : 0;
        if (i == 0 || heard[i - 1] + 1 != k) continue;
        const std::complex<double> way(x[k] - x[k - 1], y[k] - y[k - 1]);
        const double way_mm = std::abs(way);
        step += way_mm;
        square += way_mm * way_mm;
        ++steps;
        row = way_mm < kStill_mm ? row + 1 : 0;
        longest = std::max(longest, row);
        still += way_mm < kStill_mm ? 1 : 0;
        if (way_mm > kMoving_mm && std::abs(last) > kMoving_mm && last_at + 1 == k) {
          const double angle = std::arg(way * std::conj(last));
          turn += std::abs(angle);
          side += angle;
          sharp += std::abs(angle) > 1.2 ? 1 : 0;
          ++turns;
        }
        last = way;
        last_at = k;
      }
      if (steps < 3) continue;
      const auto [low_x, high_x] =
          std::minmax_element(heard.begin(), heard.end(), [&](auto a, auto b) { return x[a] < x[b]; });
      const auto [low_y, high_y] =
          std::minmax_element(heard.begin(), heard.end(), [&](auto a, auto b) { return y[a] < y[b]; });
      const auto count = static_cast<double>(heard.size());
      const double mean = step / steps, some = std::max(turns, 1.0);
      windows.push_back({robot,
                         {mean, std::sqrt(std::max(square / steps - mean * mean, 0.0)), still / steps, longest,
                          turn / some, sharp / some, side / some,
                          std::hypot(x[heard.back()] - x[heard.front()], y[heard.back()] - y[heard.front()]),
                          std::hypot(x[*high_x] - x[*low_x], y[*high_y] - y[*low_y]), beside / count, wall / count,
                          static_cast<double>(kWindow) - count}});
    }
  }
  return windows;
}

std::vector<TrackWindow> windows_of(const FloorRun& run, const Floor& floor) {
  return windows_of(blocks_of(run), floor);
}

}  // namespace kilotwin::kilogrid
