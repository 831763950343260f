#include "tests/identify/truth/oracle.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "tests/identify/truth/dice.hpp"
#include "tests/identify/truth/world.hpp"

namespace kilotwin::truth {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Number of heading hypotheses without measured headings.
constexpr int kDirections = 18;
// Hypotheses with a lower relative likelihood are pruned.
constexpr double kHopeless = 25;

Vector3d vector_of(const Stance& s) { return {s.axle.x, s.axle.y, s.heading_rad}; }
Stance stance_of(const Vector3d& v) { return {{v.x(), v.y()}, v.z()}; }

/// A Gaussian component of the pose distribution, and its log weight.
struct Guess {
  Vector3d mean;
  Matrix3d covariance;
  double log_weight = 0;
};

/// Distribution of one robot's pose: a Gaussian mixture, the most likely component first.
class Belief {
 public:
  Belief(const Scene& scene, const Individual& individual) : scene_(scene), individual_(individual) {}

  bool known() const { return !guesses_.empty(); }
  Stance best() const { return stance_of(guesses_.front().mean); }

  void go_on(const Situation& now, double dt) {
    const double sd = factor_sd(scene_, now, dt);
    for (Guess& guess : guesses_) {
      const auto step = [&](const Vector3d& from, Wheels<double> factor) {
        return vector_of(moved(scene_, individual_, stance_of(from), now, dt, factor));
      };
      Matrix3d state;
      const Vector3d nudge{0.05, 0.05, 1e-3};
      for (int k = 0; k < 3; ++k) {
        Vector3d more = guess.mean, less = guess.mean;
        more[k] += nudge[k];
        less[k] -= nudge[k];
        state.col(k) = (step(more, {1, 1}) - step(less, {1, 1})) / (2 * nudge[k]);
      }
      // A small step, so that a discontinuity does not look like a slope.
      state = state.cwiseMin(Matrix3d::Identity() + Matrix3d::Constant(0.5 + 20 * dt));
      state = state.cwiseMax(Matrix3d::Identity() - Matrix3d::Constant(0.5 + 20 * dt));
      const Vector3d mean = step(guess.mean, {1, 1});
      const Vector3d left = step(guess.mean, {1 + sd, 1}) - mean, right = step(guess.mean, {1, 1 + sd}) - mean;
      guess.mean = mean;
      guess.covariance =
          state * guess.covariance * state.transpose() + left * left.transpose() + right * right.transpose();
      guess.covariance.diagonal() += Vector3d{1e-6, 1e-6, 1e-9};
    }
  }

  /// After a push by a robot or a wall: the displacement depends on the exact poses.
  void shift(Vec by) {
    const double spread = 0.3 * std::hypot(by.x, by.y);
    for (Guess& guess : guesses_) {
      guess.mean += Vector3d{by.x, by.y, 0};
      guess.covariance.diagonal() += Vector3d{spread * spread, spread * spread, 0};
    }
  }

  void see(const Sample& sample, const Situation& now) {
    if (!known()) start(sample);
    for (Guess& guess : guesses_) update(guess, sample, now);
    std::sort(guesses_.begin(), guesses_.end(),
              [](const Guess& a, const Guess& b) { return a.log_weight > b.log_weight; });
    const double best = guesses_.front().log_weight;
    while (guesses_.back().log_weight < best - kHopeless) guesses_.pop_back();
    for (Guess& guess : guesses_) guess.log_weight -= best;
  }

  Stance draw(Dice& dice) const {
    double sum = 0;
    for (const Guess& guess : guesses_) sum += std::exp(guess.log_weight);
    double left = sum * dice.uniform();
    const Guess* chosen = &guesses_.front();
    for (const Guess& guess : guesses_) {
      left -= std::exp(guess.log_weight);
      if (left > 0) continue;
      chosen = &guess;
      break;
    }
    const Matrix3d root = chosen->covariance.llt().matrixL();
    const Vector3d normal{dice.normal(), dice.normal(), dice.normal()};
    return stance_of(chosen->mean + root * normal);
  }

 private:
  void start(const Sample& sample) {
    const int count = scene_.heading ? 1 : kDirections;
    for (int k = 0; k < count; ++k) {
      const double heading =
          scene_.heading ? sample.heading_rad : -std::numbers::pi + 2 * std::numbers::pi * (k + 0.5) / count;
      const double sd = scene_.heading ? 0.3 : 2 * std::numbers::pi / count / 2;
      const Vec ahead{std::cos(heading), std::sin(heading)};
      Guess guess{{sample.point.x - scene_.tracked_ahead_mm * ahead.x,
                   sample.point.y - scene_.tracked_ahead_mm * ahead.y, heading},
                  Vector3d{400, 400, sd * sd}.asDiagonal(),
                  0};
      guesses_.push_back(guess);
    }
  }

  void update(Guess& guess, const Sample& sample, const Situation& now) const {
    const auto look = [&](const Vector3d& at) {
      const View view = view_of(scene_, stance_of(at), now);
      return Vector3d{view.point.x, view.point.y, view.heading_rad};
    };
    Matrix3d slope;
    const Vector3d nudge{0.05, 0.05, 1e-3};
    for (int k = 0; k < 3; ++k) {
      Vector3d more = guess.mean, less = guess.mean;
      more[k] += nudge[k];
      less[k] -= nudge[k];
      slope.col(k) = (look(more) - look(less)) / (2 * nudge[k]);
    }
    const double position = scene_.tracker_sd_mm * scene_.tracker_sd_mm + 1e-6;
    const double heading = scene_.heading ? scene_.heading_sd_rad * scene_.heading_sd_rad + 1e-8 : 1e6;
    const Matrix3d noise = Vector3d{position, position, heading}.asDiagonal();
    const Vector3d expected = look(guess.mean);
    Vector3d surprise{sample.point.x - expected.x(), sample.point.y - expected.y(),
                      scene_.heading ? std::remainder(sample.heading_rad - expected.z(), 2 * std::numbers::pi) : 0};
    const Matrix3d spread = slope * guess.covariance * slope.transpose() + noise;
    const Matrix3d gain = guess.covariance * slope.transpose() * spread.inverse();
    guess.log_weight -= 0.5 * (surprise.dot(spread.inverse() * surprise) + std::log(spread.determinant()));
    guess.mean += gain * surprise;
    const Matrix3d rest = Matrix3d::Identity() - gain * slope;
    guess.covariance = rest * guess.covariance * rest.transpose() + gain * noise * gain.transpose();
  }

  const Scene& scene_;
  const Individual& individual_;
  std::vector<Guess> guesses_;
};

/// Distributions of all robots of a run over time.
class Watch {
 public:
  Watch(const Scene& scene, const std::vector<Individual>& individuals, const Run& run)
      : scene_(scene),
        run_(run),
        memory_(scene, run.number, run.orders),
        stances_(individuals.size()),
        discs_(individuals.size()) {
    for (const Individual& individual : individuals) beliefs_.emplace_back(scene, individual);
    for (const Sample& sample : run.samples) seen_.push_back(&sample);
    std::stable_sort(seen_.begin(), seen_.end(),
                     [](const Sample* a, const Sample* b) { return a->time_s < b->time_s; });
    take_in();
  }

  void go_to(double time_s) {
    while (time_s_ < time_s - 1e-9) {
      const double next_seen =
          next_ < seen_.size() ? seen_[next_]->time_s : std::numeric_limits<double>::infinity();
      const double until = std::min({time_s, next_seen, memory_.next_change_s(), time_s_ + scene_.step_s});
      step(std::max(until - time_s_, 1e-6));
    }
  }

  const std::vector<Belief>& beliefs() const { return beliefs_; }
  const Memory& memory() const { return memory_; }

 private:
  void step(double dt) {
    for (std::size_t i = 0; i < beliefs_.size(); ++i) {
      if (beliefs_[i].known()) {
        beliefs_[i].go_on(memory_.situation(static_cast<int>(i), discs_[i], stances_[i].heading_rad, discs_), dt);
      }
    }
    look();
    part(scene_, stances_, shift_);
    for (std::size_t i = 0; i < beliefs_.size(); ++i) {
      if (shift_[i].x != 0 || shift_[i].y != 0) beliefs_[i].shift(shift_[i]);
    }
    look();
    time_s_ += dt;
    memory_.go_to(time_s_, discs_);
    take_in();
  }

  void take_in() {
    for (; next_ < seen_.size() && seen_[next_]->time_s <= time_s_ + 1e-9; ++next_) {
      const Sample& sample = *seen_[next_];
      const auto i = static_cast<std::size_t>(sample.robot);
      beliefs_[i].see(sample, memory_.situation(sample.robot, discs_[i], stances_[i].heading_rad, discs_));
    }
    look();
  }

  /// Robots without a sample are placed far away from everything.
  void look() {
    for (std::size_t i = 0; i < beliefs_.size(); ++i) {
      stances_[i] = beliefs_[i].known() ? beliefs_[i].best() : Stance{{1e6 + 1e3 * static_cast<double>(i), 1e6}, 0};
      discs_[i] = disc_of(scene_, stances_[i]);
    }
  }

  const Scene& scene_;
  const Run& run_;
  Memory memory_;
  std::vector<Belief> beliefs_;
  std::vector<const Sample*> seen_;
  std::size_t next_ = 0;
  std::vector<Stance> stances_;
  std::vector<Vec> discs_, shift_;
  double time_s_ = 0;
};

}  // namespace

std::vector<Prediction> predict(const Scene& truth, const std::vector<Individual>& individuals, const Run& run,
                                double horizon_s, int samples, std::uint64_t seed) {
  Scene scene = truth;
  std::erase_if(scene.effects, [](const Effect& effect) { return effect.by_chance; });
  Dice dice(seed);
  Watch watch(scene, individuals, run);
  const std::size_t robots = individuals.size();
  std::vector<Prediction> out;
  std::vector<Stance> stances(robots);
  for (double time_s = 10; time_s <= run.duration_s + 1e-9; time_s += kMarkInterval_s) {
    if (time_s < horizon_s) continue;
    watch.go_to(time_s - horizon_s);
    std::vector<Vec> sum(robots);
    for (int sample = 0; sample < samples; ++sample) {
      for (std::size_t i = 0; i < robots; ++i) {
        const Belief& belief = watch.beliefs()[i];
        stances[i] = belief.known() ? belief.draw(dice) : Stance{{1e6 + 1e3 * static_cast<double>(i), 1e6}, 0};
      }
      World world(scene, individuals, watch.memory(), stances);
      world.start_from(time_s - horizon_s, watch.memory(), stances);
      world.go_to(time_s, &dice);
      for (std::size_t i = 0; i < robots; ++i) {
        const View view = world.view(static_cast<int>(i));
        sum[i].x += view.point.x;
        sum[i].y += view.point.y;
      }
    }
    const auto mark = static_cast<std::size_t>(std::lround(time_s / kMarkInterval_s));
    for (std::size_t i = 0; i < robots; ++i) {
      if (!watch.beliefs()[i].known()) continue;
      out.push_back({run.number,
                     static_cast<int>(i),
                     time_s,
                     {sum[i].x / samples, sum[i].y / samples},
                     run.marks[i][mark].point});
    }
  }
  return out;
}

double rmse_mm(const std::vector<Prediction>& predictions) {
  double sum = 0;
  for (const Prediction& p : predictions) {
    const double x = p.predicted.x - p.truth.x, y = p.predicted.y - p.truth.y;
    sum += x * x + y * y;
  }
  return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(predictions.size(), 1)));
}

}  // namespace kilotwin::truth
