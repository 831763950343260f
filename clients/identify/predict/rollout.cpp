#include "clients/identify/predict/rollout.hpp"

#include <Eigen/Cholesky>
#include <cmath>

#include "core/random/random.hpp"

namespace kilotwin::identify {
namespace {

/// Step of joint rollouts. Robots in contact slide along each other; twice the step displaces them by up to 2 mm
/// over 10 s.
constexpr double kRaster_s = kSubStep_s;
/// Sweeps over all pairs: separating one pair may make another overlap.
constexpr int kPasses = 4;

/// Standard normal numbers (Box-Muller) of a counter-based generator.
class Normals {
 public:
  explicit Normals(std::array<std::uint32_t, 2> key) : key_(key) {}
  template <int n>
  [[nodiscard]] Eigen::Matrix<double, n, 1> draw(std::uint32_t sample, std::uint32_t robot,
                                                 std::uint32_t step) const {
    Eigen::Matrix<double, n, 1> out;
    for (int i = 0; i < n; i += 4) {
      const auto word = philox4x32({sample, robot, step, static_cast<std::uint32_t>(i)}, key_);
      for (int pair = 0; pair < 2; ++pair) {
        const double radius = std::sqrt(-2 * std::log((word[static_cast<std::size_t>(2 * pair)] + 0.5) * 0x1p-32));
        const double angle = 2 * M_PI * word[static_cast<std::size_t>(2 * pair + 1)] * 0x1p-32;
        if (i + 2 * pair < n) out[i + 2 * pair] = radius * std::cos(angle);
        if (i + 2 * pair + 1 < n) out[i + 2 * pair + 1] = radius * std::sin(angle);
      }
    }
    return out;
  }
  [[nodiscard]] double uniform(std::uint32_t sample, std::uint32_t robot) const {
    return (philox4x32({sample, robot, 0, 1u << 31}, key_)[0] + 0.5) * 0x1p-32;
  }

 private:
  std::array<std::uint32_t, 2> key_;
};

}  // namespace

std::vector<RolloutMoments> rollouts(const MotionModel& model, const std::vector<RolloutStart>& robots,
                                     const TrafficGrids& initial_grids, double from_s, double to_s,
                                     std::uint32_t count, bool neighbours, std::array<std::uint32_t, 2> key) {
  const Normals normals(key);
  std::vector<RolloutMoments> out(robots.size());
  std::vector<double> x(robots.size()), y(robots.size());
  std::vector<TrackFilter> filters;
  std::vector<NeighbourView> nears(robots.size());
  std::vector<OtherRobot> list;
  for (std::uint32_t sample = 0; sample < count; ++sample) {
    // Antithetic pairs.
    const double mirror = sample % 2 == 0 ? 1 : -1;
    filters.clear();
    for (std::uint32_t r = 0; r < robots.size(); ++r) {
      double left = normals.uniform(sample, r);
      std::size_t chosen = 0;
      while (chosen + 1 < robots[r].filters.size() && left > robots[r].weights[chosen])
        left -= robots[r].weights[chosen++];
      TrackFilter& filter = filters.emplace_back(*robots[r].filters[chosen]);
      filter.begin_forecast();
      Belief& belief = filter.belief();
      const Eigen::LDLT<StateCovariance> root(belief.covariance);
      const State scaled = root.vectorD().cwiseMax(0).cwiseSqrt().cwiseProduct(normals.draw<5>(sample / 2, r, 0));
      belief.mean += mirror * (root.transpositionsP().transpose() * (root.matrixL() * scaled));
      belief.covariance.setZero();
    }
    double now_s = from_s;
    TrafficGrids grids = initial_grids;
    for (std::uint32_t step = 1; now_s < to_s - 1e-9; ++step) {
      const double next_s = std::min(to_s, now_s + kRaster_s);
      for (std::size_t r = 0; r < robots.size(); ++r) {
        x[r] = filters[r].belief().centre_x_mm();
        y[r] = filters[r].belief().centre_y_mm();
      }
      list.clear();
      for (std::size_t r = 0; r < robots.size(); ++r) {
        nears[r] = neighbours ? view_of(r, x, y, &list) : NeighbourView{};
        grids.see(robots[r].view->place, x[r], y[r], now_s, nears[r]);
      }
      for (std::size_t r = 0; grids.any() && r < robots.size(); ++r)
        if (robots[r].view->clock->at(now_s).driven())
          grids.add(robots[r].view->place, x[r], y[r], next_s - now_s, now_s);
      for (std::uint32_t r = 0; r < robots.size(); ++r) {
        const NeighbourView& near = nears[r];
        const double start_s = step == 1 ? robots[r].now_s : now_s;
        Belief& belief = filters[r].belief();
        sub_steps(*robots[r].view->clock, start_s, next_s,
                  [&](double t, double h, const CommandState& commands) { filters[r].step(t, h, commands, near); });
        const Eigen::LDLT<Eigen::Matrix3d> root(belief.covariance.topLeftCorner<3, 3>());
        const Eigen::Vector3d scaled =
            root.vectorD().cwiseMax(0).cwiseSqrt().cwiseProduct(normals.draw<3>(sample / 2, r, step));
        belief.mean.head<3>() += mirror * (root.transpositionsP().transpose() * (root.matrixL() * scaled));
        belief.covariance.setZero();
      }
      for (std::size_t r = 0; r < robots.size(); ++r) {
        x[r] = filters[r].belief().centre_x_mm();
        y[r] = filters[r].belief().centre_y_mm();
      }
      std::vector<double> free_x = x, free_y = y;
      for (int pass = 0; pass < kPasses; ++pass) {
        const bool pushed = model.contacts && push_apart(x, y);
        for (std::size_t r = 0; r < robots.size(); ++r) {
          x[r] = model.walls.inside_x(x[r]);
          y[r] = model.walls.inside_y(y[r]);
        }
        if (!pushed) break;
      }
      for (std::size_t r = 0; r < robots.size(); ++r) {
        filters[r].belief().mean[0] += x[r] - free_x[r];
        filters[r].belief().mean[1] += y[r] - free_y[r];
      }
      now_s = next_s;
    }
    for (std::size_t r = 0; r < robots.size(); ++r) {
      const Eigen::Vector3d seen = filters[r].expected(to_s, robots[r].view->clock->at(to_s - 1e-9));
      out[r].x_mm += seen[0];
      out[r].y_mm += seen[1];
      out[r].square_mm2 += seen.head<2>().squaredNorm();
    }
  }
  for (RolloutMoments& f : out) {
    f.x_mm /= count;
    f.y_mm /= count;
    f.square_mm2 = std::max(0.0, f.square_mm2 / count - f.x_mm * f.x_mm - f.y_mm * f.y_mm);
  }
  return out;
}

}  // namespace kilotwin::identify
