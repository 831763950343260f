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
      for (const int first : {0, 2}) {
        const auto at = static_cast<std::size_t>(first);
        const double radius = std::sqrt(-2 * std::log((word[at] + 0.5) * 0x1p-32));
        const double angle = 2 * M_PI * word[at + 1] * 0x1p-32;
        if (i + first < n) out[i + first] = radius * std::cos(angle);
        if (i + first + 1 < n) out[i + first + 1] = radius * std::sin(angle);
      }
    }
    return out;
  }
  [[nodiscard]] double uniform(std::uint32_t sample, std::uint32_t robot, std::uint32_t number = 0) const {
    return (philox4x32({sample, robot, number, 1u << 31}, key_)[0] + 0.5) * 0x1p-32;
  }

 private:
  std::array<std::uint32_t, 2> key_;
};

/// A random vector of the distribution N(0, covariance), by a root of the covariance and standard normal numbers.
template <int n>
Eigen::Matrix<double, n, 1> correlated(const Eigen::Matrix<double, n, n>& covariance,
                                       const Eigen::Matrix<double, n, 1>& normals) {
  const Eigen::LDLT<Eigen::Matrix<double, n, n>> root(covariance);
  const Eigen::Matrix<double, n, 1> scaled = root.vectorD().cwiseMax(0).cwiseSqrt().cwiseProduct(normals);
  return root.transpositionsP().transpose() * (root.matrixL() * scaled);
}

/// The spells of one robot in one rollout.
class SpellDraws {
 public:
  /// uniform(): the next random number. `now`: if it is known.
  template <class Uniform>
  SpellDraws(const Stalls& stalls, const std::optional<SpellState>& now, Uniform&& uniform)
      : stalls_(&stalls), in_spell_(now ? now->in_spell : uniform() < stalls.share()) {
    left_s_ = !in_spell_ ? -stalls.mean_apart_s * std::log(uniform())
              : now      ? stalls.rest_after_s(now->lasted_s, uniform())
                         : stalls.rest_s(uniform());
  }
  /// Share of the next `for_s` in spells.
  template <class Uniform> double share(double for_s, Uniform&& uniform) {
    double rest_s = for_s, in_s = 0;
    while (left_s_ < rest_s) {
      if (in_spell_) in_s += left_s_;
      rest_s -= left_s_;
      in_spell_ = !in_spell_;
      left_s_ = in_spell_ ? stalls_->length_s(uniform()) : -stalls_->mean_apart_s * std::log(uniform());
    }
    if (in_spell_) in_s += rest_s;
    left_s_ -= rest_s;
    return for_s > 0 ? in_s / for_s : 0;
  }

 private:
  const Stalls* stalls_;
  bool in_spell_;
  double left_s_ = 0;
};

/// Joint random rollouts of robots: each has a known state, and steps with the process noise.
class Rollout {
  /// A function that draws the robot's next number for spells.
  [[nodiscard]] auto uniforms_of(std::uint32_t r) {
    return [this, r] { return normals_.uniform(sample_, r, ++drawn_[r]); };
  }

 public:
  Rollout(const MotionModel& model, const std::vector<RolloutStart>& robots, bool neighbours,
          std::array<std::uint32_t, 2> key)
      : model_(model),
        robots_(robots),
        neighbours_(neighbours),
        normals_(key),
        x_(robots.size()),
        y_(robots.size()),
        near_(robots.size()),
        who_(robots.size()) {}

  /// Draws the robots' states. Samples come in antithetic pairs.
  void start(std::uint32_t sample) {
    sample_ = sample;
    mirror_ = sample % 2 == 0 ? 1 : -1;
    filters_.clear();
    spells_.clear();
    drawn_.assign(robots_.size(), 0);
    for (std::uint32_t r = 0; r < robots_.size(); ++r) {
      double left = normals_.uniform(sample, r);
      std::size_t chosen = 0;
      while (chosen + 1 < robots_[r].filters.size() && left > robots_[r].weights[chosen])
        left -= robots_[r].weights[chosen++];
      TrackFilter& filter = filters_.emplace_back(*robots_[r].filters[chosen]);
      filter.begin_forecast();
      Belief& belief = filter.belief();
      belief.mean += mirror_ * correlated<5>(belief.covariance, normals_.draw<5>(sample / 2, r, 0));
      belief.covariance.setZero();
      if (model_.stalls) spells_.emplace_back(*model_.stalls, robots_[r].spells[chosen], uniforms_of(r));
    }
  }
  /// `number`: of the step, from 1.
  void step(std::uint32_t number, double now_s, double next_s, TrafficGrids& grids) {
    see_neighbours(now_s, next_s, grids);
    for (std::uint32_t r = 0; r < robots_.size(); ++r) {
      if (model_.stalls) filters_[r].in_spell(spells_[r].share(next_s - now_s, uniforms_of(r)), 0, false);
      sub_steps(
          *robots_[r].view->clock, number == 1 ? robots_[r].now_s : now_s, next_s,
          [&](double t, double h, const CommandState& commands) { filters_[r].step(t, h, commands, near_[r]); });
      Belief& belief = filters_[r].belief();
      belief.mean.head<3>() += mirror_ * correlated<3>(belief.covariance.topLeftCorner<3, 3>(),
                                                       normals_.draw<3>(sample_ / 2, r, number));
      belief.covariance.setZero();
    }
    resolve_contacts();
  }
  void add_places(double at_s, std::vector<RolloutMoments>& to) const {
    for (std::size_t r = 0; r < robots_.size(); ++r) {
      const Eigen::Vector3d seen = filters_[r].expected(at_s, robots_[r].view->clock->at(at_s - 1e-9));
      to[r].x_mm += seen[0];
      to[r].y_mm += seen[1];
      to[r].square_mm2 += seen.head<2>().squaredNorm();
    }
  }

 private:
  void find_centres() {
    for (std::size_t r = 0; r < robots_.size(); ++r) {
      x_[r] = filters_[r].belief().centre_x_mm();
      y_[r] = filters_[r].belief().centre_y_mm();
    }
  }
  void see_neighbours(double now_s, double next_s, TrafficGrids& grids) {
    find_centres();
    list_.clear();
    for (std::size_t r = 0; neighbours_ && r < robots_.size(); ++r)
      who_[r] = {robots_[r].view->track->robot, robots_[r].view->clock->at(now_s).driven()};
    for (std::size_t r = 0; r < robots_.size(); ++r) {
      near_[r] = neighbours_ ? view_of(r, x_, y_, &list_, who_) : NeighbourView{};
      grids.see(robots_[r].view->place, x_[r], y_[r], now_s, near_[r]);
    }
    for (std::size_t r = 0; grids.any() && r < robots_.size(); ++r)
      if (robots_[r].view->clock->at(now_s).driven())
        grids.add(robots_[r].view->place, x_[r], y_[r], next_s - now_s, now_s);
  }
  /// Separates robots that overlap, and keeps all within the walls.
  void resolve_contacts() {
    find_centres();
    const std::vector<double> free_x = x_, free_y = y_;
    for (int pass = 0; pass < kPasses; ++pass) {
      const bool pushed = model_.contacts && push_apart(x_, y_);
      for (std::size_t r = 0; r < robots_.size(); ++r) {
        x_[r] = model_.walls.inside_x(x_[r]);
        y_[r] = model_.walls.inside_y(y_[r]);
      }
      if (!pushed) break;
    }
    for (std::size_t r = 0; r < robots_.size(); ++r) {
      filters_[r].belief().mean[0] += x_[r] - free_x[r];
      filters_[r].belief().mean[1] += y_[r] - free_y[r];
    }
  }

  const MotionModel& model_;
  const std::vector<RolloutStart>& robots_;
  const bool neighbours_;
  const Normals normals_;
  std::uint32_t sample_ = 0;
  double mirror_ = 1;
  std::vector<TrackFilter> filters_;
  std::vector<SpellDraws> spells_;    ///< of a model with stalls, by robot
  std::vector<std::uint32_t> drawn_;  ///< numbers that they took
  std::vector<double> x_, y_;         ///< disc centres
  std::vector<NeighbourView> near_;
  std::vector<Neighbour> who_;  ///< at the step's start
  std::vector<OtherRobot> list_;
};

}  // namespace

std::vector<RolloutMoments> rollouts(const MotionModel& model, const std::vector<RolloutStart>& robots,
                                     const TrafficGrids& initial_grids, double from_s, double to_s,
                                     std::uint32_t count, bool neighbours, std::array<std::uint32_t, 2> key) {
  std::vector<RolloutMoments> out(robots.size());
  Rollout rollout(model, robots, neighbours, key);
  for (std::uint32_t sample = 0; sample < count; ++sample) {
    rollout.start(sample);
    double now_s = from_s;
    TrafficGrids grids = initial_grids;
    for (std::uint32_t step = 1; now_s < to_s - 1e-9; ++step) {
      const double next_s = std::min(to_s, now_s + kRaster_s);
      rollout.step(step, now_s, next_s, grids);
      now_s = next_s;
    }
    rollout.add_places(to_s, out);
  }
  for (RolloutMoments& f : out) {
    f.x_mm /= count;
    f.y_mm /= count;
    f.square_mm2 = std::max(0.0, f.square_mm2 / count - f.x_mm * f.x_mm - f.y_mm * f.y_mm);
  }
  return out;
}

}  // namespace kilotwin::identify
