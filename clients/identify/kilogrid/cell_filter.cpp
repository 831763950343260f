#include "clients/identify/kilogrid/cell_filter.hpp"

#include <algorithm>
#include <cmath>

#include "clients/identify/kilogrid/single_robot.hpp"
#include "core/base/pose.hpp"
#include "core/math/elementary.h"

namespace kilotwin::kilogrid {
namespace {

constexpr double kStep_s = SingleRobot::kStep_s;
/// Time between predictions, and the earliest one. A finer raster costs time and judges overlapping stretches; a later
/// start gives the filter more reports.
constexpr double kEvery_s = 5, kFirst_s = 10;
/// Probability of a report from anywhere, outside the reception model.
constexpr double kAstray = 2e-4;
/// Jitter of resampled particles, and the share that gets a new heading.
constexpr double kPart_mm = 4, kPart_rad = 0.15, kTurned = 0.1;

/// Largest robot number that the model may distinguish.
constexpr std::uint64_t kNumbers = 100;
/// Correlation of persistent properties when a particle is copied. It prevents degeneracy to a single draw.
constexpr double kKeep = 0.97;

/// Reception of a robot by the floor, as the filter assumes it.
class Hearing {
 public:
  Hearing(const Floor& floor, const FloorRadio& radio) : floor_(floor), radio_(radio) {}

  /// Probability that the report of a robot comes from this cell.
  [[nodiscard]] double chance_of(const RobotState& p, double cell_x_mm, double cell_y_mm) const {
    const double cell = floor_.cell_mm;
    const auto column = static_cast<int>(p.x_mm / cell), row = static_cast<int>(p.y_mm / cell);
    const int columns = static_cast<int>(floor_.width_mm / cell), rows = static_cast<int>(floor_.height_mm / cell);
    double all = 0;
    for (int r = std::max(row - 1, 0); r <= std::min(row + 1, rows - 1); ++r) {
      for (int c = std::max(column - 1, 0); c <= std::min(column + 1, columns - 1); ++c)
        all += kernel(p, (c + 0.5) * cell, (r + 0.5) * cell);
    }
    return (all > 0 ? kernel(p, cell_x_mm, cell_y_mm) / all : 0) + kAstray;
  }

 private:
  [[nodiscard]] double kernel(const RobotState& p, double x_mm, double y_mm) const {
    const double dx = p.x_mm - x_mm, dy = p.y_mm - y_mm;
    // Wider than the true range: the filter's time steps are coarse.
    const double over = (std::sqrt(dx * dx + dy * dy) - radio_.range_mm) / (radio_.blur_mm + 3);
    return 1 / (1 + kt_exp(std::min(over, 50.0)));
  }

  const Floor& floor_;
  const FloorRadio& radio_;
};

/// A robot that may have caused a report of this cell.
RobotState start_near(const SingleRobot& robot, const Floor& floor, double x_mm, double y_mm, Dice& dice) {
  const auto number = static_cast<std::uint32_t>(dice.bits() % kNumbers);
  const double x = x_mm + 2 * floor.cell_mm * (dice.uniform() - 0.5),
               y = y_mm + 2 * floor.cell_mm * (dice.uniform() - 0.5);
  return robot.start(number, x, y, (2 * dice.uniform() - 1) * kPi, dice);
}

/// Multinomial resampling by weight.
void resample(const SingleRobot& robot, std::vector<RobotState>& particles, std::vector<double>& weights,
              Dice& dice) {
  const std::size_t n = particles.size();
  std::vector<RobotState> kept;
  kept.reserve(n);
  double at = dice.uniform() / static_cast<double>(n), below = weights[0];
  for (std::size_t i = 0, j = 0; i < n; ++i, at += 1 / static_cast<double>(n)) {
    while (at > below && j + 1 < n) below += weights[++j];
    kept.push_back(particles[j]);
    RobotState& p = kept.back();
    p.program.reseed(dice.bits());
    robot.renew(p, kKeep, dice);
    if (dice.uniform() > kKeep) p.number = static_cast<std::uint32_t>(dice.bits() % kNumbers);
    // Copies diffuse, and some turn: the program's state is unknown.
    p.x_mm += kPart_mm * dice.normal();
    p.y_mm += kPart_mm * dice.normal();
    p.heading_rad = wrapped(dice.uniform() < kTurned ? (2 * dice.uniform() - 1) * kPi
                                                     : p.heading_rad + kPart_rad * dice.normal());
  }
  particles = std::move(kept);
  std::fill(weights.begin(), weights.end(), 1 / static_cast<double>(n));
}

}  // namespace

CellFilterResult filter_cells(const FloorTrack& track, const Floor& floor, const FloorSettings& settings,
                              double horizon_s, std::size_t count, std::uint64_t seed) {
  CellFilterResult result;
  Dice dice(seed);
  const SingleRobot robot(floor, settings);
  const Hearing hearing(floor, settings.radio);
  std::vector<RobotState> particles;
  for (std::size_t i = 0; i < count; ++i)
    particles.push_back(start_near(robot, floor, track.x_mm.front(), track.y_mm.front(), dice));
  std::vector<double> weights(count, 1 / static_cast<double>(count));
  auto k = static_cast<std::int64_t>(track.time_s.front() / kStep_s);
  std::size_t next = 1;
  const double end_s = track.time_s.back();
  double target_s = std::max(kFirst_s, kEvery_s * std::ceil((track.time_s.front() + horizon_s) / kEvery_s));
  std::size_t heard_next = 0;
  for (; static_cast<double>(k) * kStep_s <= end_s; ++k) {
    const double now_s = static_cast<double>(k) * kStep_s;
    for (; target_s - horizon_s <= now_s && target_s <= end_s; target_s += kEvery_s) {
      while (heard_next + 1 < track.size() &&
             std::abs(track.time_s[heard_next + 1] - target_s) <= std::abs(track.time_s[heard_next] - target_s))
        ++heard_next;
      if (std::abs(track.time_s[heard_next] - target_s) > 1) continue;
      std::vector<RobotState> ahead = particles;
      const auto last = static_cast<std::int64_t>(target_s / kStep_s);
      CellPrediction prediction{target_s, 0, 0, track.x_mm[heard_next], track.y_mm[heard_next]};
      for (std::size_t i = 0; i < count; ++i) {
        for (std::int64_t q = k; q < last; ++q) robot.step(ahead[i], q, dice);
        prediction.x_mm += weights[i] * ahead[i].x_mm;
        prediction.y_mm += weights[i] * ahead[i].y_mm;
      }
      result.predictions.push_back(prediction);
    }
    for (RobotState& p : particles) robot.step(p, k, dice);
    for (; next < track.size() && track.time_s[next] <= now_s + kStep_s; ++next) {
      double all = 0, squares = 0;
      for (std::size_t i = 0; i < count; ++i)
        all += weights[i] *= hearing.chance_of(particles[i], track.x_mm[next], track.y_mm[next]);
      result.log_likelihood += kt_log(all);
      ++result.reports;
      if (all < 3 * kAstray) {
        // No particle explains the report: restarts there.
        for (RobotState& p : particles) p = start_near(robot, floor, track.x_mm[next], track.y_mm[next], dice);
        std::fill(weights.begin(), weights.end(), 1 / static_cast<double>(count));
        continue;
      }
      for (double& w : weights) {
        w /= all;
        squares += w * w;
      }
      if (1 / squares < 0.5 * static_cast<double>(count)) resample(robot, particles, weights, dice);
    }
  }
  return result;
}

double cell_noise_mm(const Floor& floor, const FloorRadio& radio) {
  // Integrates over the distance from a cell centre, weighted by area.
  double squares = 0, all = 0;
  for (double d = 0.5; d < 3 * floor.cell_mm; ++d) {
    const double weight = d / (1 + std::exp((d - radio.range_mm) / radio.blur_mm));
    squares += weight * d * d;
    all += weight;
  }
  return std::sqrt(squares / all);
}

}  // namespace kilotwin::kilogrid
