#include "tests/clients/identify/kilogrid/plain_floor.hpp"

#include <algorithm>
#include <cmath>
#include <random>

namespace kilotwin::kilogrid::test {
namespace {

constexpr double kWidth = 1000, kHeight = 2000, kCell = 50, kStep_s = 0.1, kRobot = 16.5;
constexpr double kSpeed = 11.3, kTurnSpeed = 27, kBase = 25, kAxle = 9.2, kBias = 1.2, kPerSecond = 0.13;

struct Point {
  double x, y, heading, left_bias, right_bias, factor, heard, report_s, clock;
  int motion = 0;                                             // 1 straight, 2 left, 3 right
  double until_s = -1, wall_until_s = -1, turn_until_s = -1;  // of the walk, of the avoidance
  int walk = 0, avoid = 0;  // 0 start, 1 straight or turning, 2 turning or escaping
  bool avoiding = false;
  double sum = 0, reading = 0, before = 0;
  int readings = 0;
  bool fresh = false, at_wall = false;
  double held_s = 0, spell_s = 0, spell_rad_s = 0;
  int near = 0;
};

class Play {
 public:
  Play(Truth truth, std::size_t robots, double duration_s, std::uint64_t seed)
      : truth_(truth), duration_s_(duration_s), chance_(seed) {
    run_.name = "plain";
    run_.duration_s = duration_s;
    run_.tracks.resize(robots);
    for (std::size_t i = 0; i < robots; ++i) {
      run_.tracks[i].robot = static_cast<std::uint32_t>(i);
      Point p{};
      p.x = 150 + 700 * uniform();
      p.y = 150 + 1700 * uniform();
      p.heading = 6.283185307 * uniform();
      p.left_bias = kBias * normal();
      p.right_bias = kBias * normal();
      p.factor = truth == Truth::kTwoKindsOfRobots && i % 3 == 0 ? 0.55 : 1;
      p.heard = std::clamp(0.75 + 0.3 * normal(), 0.05, 1.0);
      p.clock = 2.064 * (1 + 0.005 * normal());
      p.report_s = p.clock * uniform();
      points_.push_back(p);
    }
  }

  FloorRun go() {
    for (double now_s = 0; now_s < duration_s_; now_s += kStep_s) {
      if (truth_ == Truth::kSlowInCrowds) count_near();
      for (std::size_t i = 0; i < points_.size(); ++i) {
        Point& p = points_[i];
        hear_boundary(p, now_s);
        p.avoiding ? avoid(p, now_s) : stroll(p, now_s);
        move(p, now_s);
        report(p, now_s, run_.tracks[i]);
      }
      part();
    }
    return std::move(run_);
  }

 private:
  double uniform() { return std::uniform_real_distribution<>(0, 1)(chance_); }
  double normal() { return std::normal_distribution<>(0, 1)(chance_); }
  /// Whole seconds of |N(mean, sd)|; the program counts 31 ticks per second.
  double seconds(double mean, double sd) { return std::floor(std::abs(mean + sd * normal())) * 31 * 0.032768; }

  void stroll(Point& p, double now_s) {
    if (now_s <= p.until_s) return;
    if (p.walk == 1) {
      p.walk = 2;
      p.motion = uniform() < 0.5 ? 2 : 3;
      p.until_s = now_s + seconds(0.5, 3);
    } else {
      p.walk = 1;
      p.motion = 1;
      p.until_s = now_s + seconds(15, 1.5);
    }
  }

  void hear_boundary(Point& p, double now_s) {
    if (uniform() > 1.5 * kStep_s) return;
    const auto middle = [](double v, double end) {
      return (std::floor(std::clamp(v, 1.0, end - 1) / kCell) + 0.5) * kCell;
    };
    const double x = middle(p.x, kWidth), y = middle(p.y, kHeight);
    const double away = std::min({std::hypot(p.x - x, p.y - 25), std::hypot(p.x - x, p.y - (kHeight - 25)),
                                  std::hypot(p.x - 25, p.y - y), std::hypot(p.x - (kWidth - 25), p.y - y)}) +
                        15 * normal();
    if (away > 38) return;
    p.avoiding = true;
    p.wall_until_s = now_s + 32 * 0.032768;
    p.sum += 1000 - away;
    if (++p.readings < 4) return;
    p.before = p.reading;
    p.reading = p.sum;
    p.readings = 0;
    p.sum = 0;
    p.fresh = true;
  }

  void avoid(Point& p, double now_s) {
    if (now_s > p.wall_until_s) {
      p.avoiding = false;
      p.avoid = 0;
      return;
    }
    const bool fresh = p.fresh;
    if (p.avoid == 0 || (p.avoid == 1 && now_s > p.turn_until_s)) {
      p.motion = p.avoid == 0 ? (uniform() < 0.5 ? 2 : 3) : 5 - p.motion;
      p.turn_until_s = now_s + 234 * 0.032768;
      p.avoid = 1;
      p.readings = 0;
      p.sum = p.reading = p.before = 0;
      return;
    }
    p.fresh = false;
    if (!fresh) return;
    if (p.avoid == 1 && p.before > p.reading) {
      p.motion = 1;
      p.avoid = 2;
    } else if (p.avoid == 2 && p.before < p.reading) {
      p.avoid = 0;
    }
  }

  /// Robots are solid: overlapping robots are separated.
  void part() {
    for (std::size_t i = 0; i < points_.size(); ++i) {
      for (std::size_t k = 0; k < i; ++k) {
        Point &a = points_[i], &b = points_[k];
        const double x = a.x - b.x, y = a.y - b.y, square = x * x + y * y;
        if (square >= 4 * kRobot * kRobot || square == 0) continue;
        const double give = kRobot / std::sqrt(square) - 0.5;
        a.x += give * x;
        a.y += give * y;
        b.x -= give * x;
        b.y -= give * y;
      }
    }
  }

  void count_near() {
    for (Point& p : points_) p.near = -1;  // itself
    for (Point& p : points_) {
      for (const Point& other : points_) p.near += std::hypot(p.x - other.x, p.y - other.y) < 90 ? 1 : 0;
    }
  }

  double speed_there(const Point& p, double now_s) const {
    if (truth_ == Truth::kSlowerAtHalfTime) return now_s > duration_s_ / 2 ? 0.75 : 1;
    if (truth_ == Truth::kDeadPatch) {
      const double a = (p.x - 350) / 300, b = (p.y - 800) / 600;
      return a * a + b * b < 1 ? 0.5 : 1;
    }
    if (truth_ == Truth::kTired) return 1 - 0.35 * std::sqrt(now_s / duration_s_);
    if (truth_ == Truth::kSlowCorner) return std::hypot(p.x, p.y) < 600 ? 0.4 : 1;
    if (truth_ == Truth::kSlowInCrowds) return p.near >= 2 ? 0.5 : 1;
    return p.factor;
  }

  double spell(Point& p) {
    p.spell_s -= kStep_s;
    if (p.spell_s < 0) {
      p.spell_s = 40 + 80 * uniform();
      const double kind = uniform();
      p.spell_rad_s = kind < 0.5 ? 0 : kind < 0.75 ? 0.12 : -0.12;
    }
    return p.spell_rad_s;
  }

  void move(Point& p, double now_s) {
    const double wall = std::min({p.x, kWidth - p.x, p.y, kHeight - p.y});
    if (truth_ == Truth::kCaughtByWalls) {
      if (wall < 45 && !p.at_wall && uniform() < 0.25) p.held_s = 40 + 160 * uniform();
      p.at_wall = wall < 45 || (p.at_wall && wall < 70);
      p.held_s -= kStep_s;
      if (p.held_s > 0) return;
    }
    if (p.motion == 0) return;
    const double k = speed_there(p, now_s), spread = std::sqrt(kPerSecond / kStep_s);
    double left = p.motion == 1 ? kSpeed : p.motion == 3 ? kTurnSpeed : 0;
    double right = p.motion == 1 ? kSpeed : p.motion == 2 ? kTurnSpeed : 0;
    left = (left + p.left_bias) * (1 + spread * normal()) * k;
    right = (right + p.right_bias) * (1 + spread * normal()) * k;
    // The point between the legs moves along the mean of both headings.
    double turn = (right - left) / kBase * kStep_s;
    if (truth_ == Truth::kTurningSpells) turn += spell(p) * kStep_s;
    const double drift = truth_ == Truth::kDriftInTheMiddle ? 1.5 * std::sin(3.14159265 * p.x / kWidth) : 0;
    const double way = (left + right) / 2 * kStep_s;
    const double legs_x = p.x - kAxle * std::cos(p.heading) + way * std::cos(p.heading + turn / 2);
    const double legs_y = p.y - kAxle * std::sin(p.heading) + way * std::sin(p.heading + turn / 2);
    p.heading += turn;
    p.x = std::clamp(legs_x + kAxle * std::cos(p.heading), kRobot, kWidth - kRobot);
    p.y = std::clamp(legs_y + kAxle * std::sin(p.heading) + drift * kStep_s, kRobot, kHeight - kRobot);
  }

  void report(Point& p, double now_s, FloorTrack& track) {
    if (now_s < p.report_s) return;
    p.report_s += p.clock;
    for (int column = 0; column < 10; ++column) {
      for (int row = 0; row < 20; ++row) {
        // One of the four cells of a module is polled.
        const auto cell = static_cast<int>(4 * uniform()) % 4;
        const double x = (2 * column + cell % 2 + 0.5) * kCell, y = (2 * row + cell / 2 + 0.5) * kCell;
        if (std::abs(x - p.x) > 80 || std::abs(y - p.y) > 80) continue;
        if (std::hypot(x - p.x, y - p.y) > 49 + 2 * normal() || uniform() > p.heard) continue;
        track.time_s.push_back(std::floor(now_s));
        track.x_mm.push_back(x);
        track.y_mm.push_back(y);
      }
    }
  }

  Truth truth_;
  double duration_s_;
  std::mt19937_64 chance_;
  FloorRun run_;
  std::vector<Point> points_;
};

}  // namespace

FloorRun play(Truth truth, std::size_t robots, double duration_s, std::uint64_t seed) {
  return Play(truth, robots, duration_s, seed).go();
}

}  // namespace kilotwin::kilogrid::test
