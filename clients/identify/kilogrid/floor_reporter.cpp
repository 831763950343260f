#include "clients/identify/kilogrid/floor_reporter.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/math/elementary.h"

namespace kilotwin::kilogrid {
namespace {

/// Relative spread of robot clocks.
constexpr double kClock_sd = 0.005;

}  // namespace

FloorReporter::FloorReporter(const Floor& floor, const FloorRadio& radio, std::uint32_t robots, std::uint64_t seed)
    : floor_(floor), radio_(radio), dice_(seed), tracks_(robots) {
  for (std::uint32_t robot = 0; robot < robots; ++robot) {
    tracks_[robot].robot = robot;
    every_s_.push_back(radio.report_every_s * (1 + kClock_sd * dice_.normal()));
    next_s_.push_back(every_s_.back() * dice_.uniform());
    heard_.push_back(std::clamp(radio.heard + radio.heard_sd * dice_.normal(), 0.05, 1.0));
    // No bursts at the start: all robots are reported within seconds.
    talking_.push_back(false);
    change_s_.push_back(-radio.silent_s * kt_log(dice_.uniform()));
    phase_.push_back(static_cast<std::uint32_t>(dice_.bits() >> 62));
    pace_.push_back(draw_pace());
  }
}

std::uint32_t FloorReporter::draw_pace() {
  const double turn = dice_.uniform() * (radio_.later[0] + radio_.later[1] + radio_.later[2] + radio_.later[3]);
  std::uint32_t later = 0;
  for (double below = radio_.later[0]; turn > below && later < 3; below += radio_.later[later]) ++later;
  return later;
}

void FloorReporter::see(std::uint32_t robot, double time_s, double x_mm, double y_mm) {
  if (time_s < next_s_[robot]) return;
  next_s_[robot] += every_s_[robot];
  while (change_s_[robot] < time_s) {
    talking_[robot] = !talking_[robot];
    change_s_[robot] -= (talking_[robot] ? radio_.talking_s : radio_.silent_s) * kt_log(dice_.uniform());
  }
  const double chance = heard_[robot] * (talking_[robot] ? radio_.while_talking : 1);
  if (dice_.uniform() * radio_.same_pace_s < every_s_[robot]) pace_[robot] = draw_pace();
  phase_[robot] += pace_[robot];
  const auto off = dice_.uniform() < radio_.in_turn ? 0u : static_cast<std::uint32_t>(dice_.bits() >> 62);
  const double module_mm = 2 * floor_.cell_mm;
  const int columns = static_cast<int>(floor_.width_mm / module_mm),
            rows = static_cast<int>(floor_.height_mm / module_mm);
  const int column = static_cast<int>(x_mm / module_mm), row = static_cast<int>(y_mm / module_mm);
  FloorTrack& track = tracks_[robot];
  for (int r = std::max(row - 1, 0); r <= std::min(row + 1, rows - 1); ++r) {
    for (int c = std::max(column - 1, 0); c <= std::min(column + 1, columns - 1); ++c) {
      // Each module starts polling at a random cell.
      const auto cell =
          static_cast<int>(phase_[robot] + off + Dice(static_cast<std::uint64_t>(r * columns + c)).bits() % 4) % 4;
      const double cell_x_mm = (2 * c + (cell & 1) + 0.5) * floor_.cell_mm,
                   cell_y_mm = (2 * r + (cell >> 1) + 0.5) * floor_.cell_mm;
      const double dx = x_mm - cell_x_mm, dy = y_mm - cell_y_mm;
      const double over = (std::sqrt(dx * dx + dy * dy) - radio_.range_mm) / radio_.blur_mm;
      if (over > 30 || dice_.uniform() * (1 + kt_exp(over)) > chance) continue;
      track.time_s.push_back(std::floor(time_s));
      track.x_mm.push_back(cell_x_mm);
      track.y_mm.push_back(cell_y_mm);
    }
  }
}

FloorRun FloorReporter::take(std::string name, double duration_s) {
  FloorRun run{std::move(name), duration_s, {}, {}};
  for (FloorTrack& track : tracks_) {
    if (track.size() > 1) run.tracks.push_back(std::move(track));
  }
  return run;
}

}  // namespace kilotwin::kilogrid
