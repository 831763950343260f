#include "clients/identify/kilogrid/fast_swarm.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "clients/identify/kilogrid/single_robot.hpp"
#include "core/base/pose.hpp"
#include "idl/experiment.pb.h"

namespace kilotwin::kilogrid {
namespace {

struct Place {
  double x_mm, y_mm;
};

constexpr double kTouch_mm = 2 * kRobotRadius_mm;

/// Robots sorted by y, to find close pairs. The order changes little between steps.
class NearPairs {
 public:
  explicit NearPairs(std::size_t robots) : order_(robots) { std::iota(order_.begin(), order_.end(), 0u); }
  void sort(const std::vector<RobotState>& robots) {
    for (std::size_t i = 1; i < order_.size(); ++i) {
      const std::uint32_t robot = order_[i];
      std::size_t j = i;
      for (; j > 0 && robots[order_[j - 1]].y_mm > robots[robot].y_mm; --j) order_[j] = order_[j - 1];
      order_[j] = robot;
    }
  }
  /// Calls use(a, b, squared distance) for pairs within `reach_mm`.
  template <class Use> void each(std::vector<RobotState>& robots, double reach_mm, Use&& use) const {
    for (std::size_t i = 0; i < order_.size(); ++i) {
      RobotState& a = robots[order_[i]];
      for (std::size_t j = i + 1; j < order_.size(); ++j) {
        RobotState& b = robots[order_[j]];
        const double dy = b.y_mm - a.y_mm, dx = b.x_mm - a.x_mm;
        if (dy > reach_mm) break;
        const double square = dx * dx + dy * dy;
        if (square < reach_mm * reach_mm) use(order_[i], order_[j], square);
      }
    }
  }

 private:
  std::vector<std::uint32_t> order_;
};

/// Separates overlapping discs along their normal. Static friction between the discs prevents tangential slip;
/// both slip on the floor equally.
void resolve_contact(RobotState& a, RobotState& b, const Place& a_before, const Place& b_before, double square,
                     double friction) {
  const double distance = std::sqrt(std::max(square, 1e-12)), overlap = kTouch_mm - distance;
  const double nx = (b.x_mm - a.x_mm) / distance, ny = (b.y_mm - a.y_mm) / distance;
  const double slide = ((b.y_mm - b_before.y_mm) - (a.y_mm - a_before.y_mm)) * nx -
                       ((b.x_mm - b_before.x_mm) - (a.x_mm - a_before.x_mm)) * ny;
  const double held = std::clamp(slide, -friction * overlap, friction * overlap);
  const double x = (nx * overlap + ny * held) / 2, y = (ny * overlap - nx * held) / 2;
  a.x_mm -= x;
  a.y_mm -= y;
  b.x_mm += x;
  b.y_mm += y;
}

}  // namespace

FloorRun simulate_fast(const FloorScene& scene, const Floor& floor, const FloorSettings& settings,
                       std::uint64_t seed) {
  Dice dice(seed * 2 + 1);
  const SingleRobot model(floor, settings);
  std::vector<RobotState> robots;
  // One random sequence per robot, so that runs with other parameters and the same seed keep the same robots.
  std::vector<Dice> own;
  for (std::size_t i = 0; i < scene.x_mm.size(); ++i) {
    own.emplace_back(dice.bits());
    robots.push_back(model.start(static_cast<std::uint32_t>(i), scene.x_mm[i], scene.y_mm[i],
                                 (2 * own[i].uniform() - 1) * kPi, own[i]));
  }
  FloorReporter reporter(floor, settings.radio, static_cast<std::uint32_t>(robots.size()), dice.bits());
  NearPairs pairs(robots.size());
  std::vector<double> neighbours(robots.size(), 0);
  std::vector<Place> before(robots.size());
  const auto steps = static_cast<std::int64_t>(scene.duration_s / SingleRobot::kStep_s);
  const double friction = proto::Physics().rim_friction();
  constexpr int kPasses = 2;  // passes over close pairs, since parting one may close another; more cost time
  for (std::int64_t k = 0; k < steps; ++k) {
    pairs.sort(robots);
    if (model.neighbour_radius_mm() > 0) {
      std::fill(neighbours.begin(), neighbours.end(), 0);
      pairs.each(robots, model.neighbour_radius_mm(), [&](std::uint32_t a, std::uint32_t b, double) {
        ++neighbours[a];
        ++neighbours[b];
      });
    }
    for (std::size_t i = 0; i < robots.size(); ++i) {
      reporter.see(static_cast<std::uint32_t>(i), static_cast<double>(k) * SingleRobot::kStep_s, robots[i].x_mm,
                   robots[i].y_mm);
      before[i] = {robots[i].x_mm, robots[i].y_mm};
      model.step(robots[i], k, own[i], neighbours[i]);
    }
    for (int pass = 0; pass < kPasses; ++pass) {
      pairs.sort(robots);
      pairs.each(robots, kTouch_mm, [&](std::uint32_t a, std::uint32_t b, double square) {
        resolve_contact(robots[a], robots[b], before[a], before[b], square, friction);
        model.keep_inside(robots[a]);
        model.keep_inside(robots[b]);
      });
    }
  }
  return reporter.take(scene.name, scene.duration_s);
}

}  // namespace kilotwin::kilogrid
