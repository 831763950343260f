#include "tests/identify/truth/world.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace kilotwin::truth {
namespace {

// Floor spots over 3 m; beyond, the last spot counts.
constexpr double kFloor_mm = 3000;
constexpr int kPasses = 4;
// A robot farther away does not exist: no wall moves it back.
constexpr double kFarAway_mm = 1e5;

struct Rate {
  Vec axle;
  double heading;
};

/// Velocity of the pose for wheel speeds `wheels`.
Rate rate_of(const Scene& scene, double heading, Wheels<double> wheels, const Push& push) {
  const double ahead = 0.5 * (wheels.left + wheels.right) + push.slip_mm_s.x, aside = push.slip_mm_s.y;
  const double c = std::cos(heading), s = std::sin(heading);
  return {{ahead * c - aside * s + push.drift_mm_s.x, ahead * s + aside * c + push.drift_mm_s.y},
          (wheels.right - wheels.left) / scene.wheel_base_mm + push.turn_rad_s};
}

}  // namespace

Wheels<bool> driven(Motion motion) {
  return {motion == Motion::kStraight || motion == Motion::kRight,
          motion == Motion::kStraight || motion == Motion::kLeft};
}

Vec disc_of(const Scene& scene, const Stance& stance) {
  return {stance.axle.x + scene.disc_ahead_mm * std::cos(stance.heading_rad),
          stance.axle.y + scene.disc_ahead_mm * std::sin(stance.heading_rad)};
}

View view_of(const Scene& scene, const Stance& stance, Situation situation) {
  View view{{stance.axle.x + scene.tracked_ahead_mm * std::cos(stance.heading_rad),
             stance.axle.y + scene.tracked_ahead_mm * std::sin(stance.heading_rad)},
            stance.heading_rad};
  situation.disc = disc_of(scene, stance);
  situation.heading_rad = stance.heading_rad;
  for (const Effect& effect : scene.effects) {
    if (effect.see) effect.see(situation, view);
  }
  return view;
}

Stance moved(const Scene& scene, const Individual& individual, const Stance& stance, Situation situation, double dt,
             Wheels<double> factor) {
  situation.disc = disc_of(scene, stance);
  situation.heading_rad = stance.heading_rad;
  Push push;
  for (const Effect& effect : scene.effects) {
    if (effect.push) effect.push(situation, push);
  }
  Wheels<double> wheels;
  if (situation.driven()) {
    const double speed_mm_s = situation.motion == Motion::kStraight ? scene.straight_mm_s : scene.turn_mm_s;
    const Wheels<bool> on = driven(situation.motion);
    const Wheels<double> nominal{on.left ? speed_mm_s : 0, on.right ? speed_mm_s : 0};
    wheels.left = factor.left * (nominal.left + individual.bias_mm_s.left) * push.gain.left + push.offset_mm_s.left;
    wheels.right =
        factor.right * (nominal.right + individual.bias_mm_s.right) * push.gain.right + push.offset_mm_s.right;
  }
  // Fourth-order Runge-Kutta; effects are constant within a step.
  const auto at = [&](double heading) { return rate_of(scene, heading, wheels, push); };
  const Rate a = at(stance.heading_rad);
  const Rate b = at(stance.heading_rad + 0.5 * dt * a.heading);
  const Rate c = at(stance.heading_rad + 0.5 * dt * b.heading);
  const Rate d = at(stance.heading_rad + dt * c.heading);
  return {{stance.axle.x + dt / 6 * (a.axle.x + 2 * b.axle.x + 2 * c.axle.x + d.axle.x),
           stance.axle.y + dt / 6 * (a.axle.y + 2 * b.axle.y + 2 * c.axle.y + d.axle.y)},
          stance.heading_rad + dt / 6 * (a.heading + 2 * b.heading + 2 * c.heading + d.heading)};
}

void part(const Scene& scene, std::vector<Stance>& stances, std::vector<Vec>& shift) {
  const std::size_t count = stances.size();
  shift.assign(count, {});
  std::vector<Vec> disc(count);
  for (std::size_t i = 0; i < count; ++i) disc[i] = disc_of(scene, stances[i]);
  const double reach_x = 0.5 * scene.width_mm - kDiscRadius_mm, reach_y = 0.5 * scene.height_mm - kDiscRadius_mm;
  const auto push = [&](std::size_t i, double x, double y) {
    disc[i].x += x;
    disc[i].y += y;
    shift[i].x += x;
    shift[i].y += y;
  };
  for (int pass = 0; pass < kPasses; ++pass) {
    bool any = false;
    for (std::size_t i = 0; scene.contacts && i < count; ++i) {
      for (std::size_t j = i + 1; j < count; ++j) {
        const double x = disc[j].x - disc[i].x, y = disc[j].y - disc[i].y;
        const double square = x * x + y * y;
        if (square >= 4 * kDiscRadius_mm * kDiscRadius_mm || square == 0) continue;
        const double distance = std::sqrt(square), half = 0.5 * (2 * kDiscRadius_mm - distance) / distance;
        push(i, -half * x, -half * y);
        push(j, half * x, half * y);
        any = true;
      }
    }
    for (std::size_t i = 0; scene.width_mm > 0 && i < count; ++i) {
      if (std::abs(disc[i].x) > kFarAway_mm) continue;
      push(i, std::clamp(disc[i].x, -reach_x, reach_x) - disc[i].x,
           std::clamp(disc[i].y, -reach_y, reach_y) - disc[i].y);
    }
    if (!any) break;
  }
  for (std::size_t i = 0; i < count; ++i) {
    stances[i].axle.x += shift[i].x;
    stances[i].axle.y += shift[i].y;
  }
}

Memory::Memory(const Scene& scene, int run, const std::vector<std::vector<Order>>& orders)
    : orders_(&orders),
      run_(run),
      robots_(static_cast<std::size_t>(scene.robots)),
      motions_(robots_.size(), Motion::kStop),
      spot_mm_(scene.spot_mm),
      spot_corner_(scene.spot_corner),
      spots_(2 * static_cast<int>(kFloor_mm / 2 / scene.spot_mm) + 1),
      trodden_s_(static_cast<std::size_t>(spots_ * spots_), 0),
      passages_(trodden_s_.size()) {
  take_orders();
}

std::size_t Memory::spot(Vec place) const {
  const auto index = [this](double c) {
    return std::clamp(static_cast<int>(std::floor(c / spot_mm_)) + spots_ / 2, 0, spots_ - 1);
  };
  return static_cast<std::size_t>(index(place.x - spot_corner_.x) * spots_ + index(place.y - spot_corner_.y));
}

void Memory::take_orders() {
  for (std::size_t i = 0; i < robots_.size(); ++i) {
    Robot& robot = robots_[i];
    const std::vector<Order>& orders = (*orders_)[i];
    while (robot.next < orders.size() && orders[robot.next].time_s <= time_s_ + 1e-9) {
      const Motion motion = orders[robot.next++].motion;
      if (motion == robot.motion) continue;
      if (robot.motion == Motion::kLeft || robot.motion == Motion::kRight) robot.last_turn = robot.motion;
      robot.before = robot.motion;
      robot.before_s = robot.since_s;
      robot.motion = motions_[i] = motion;
      robot.since_s = 0;
      ++robot.commands;
    }
  }
}

void Memory::go_to(double time_s, const std::vector<Vec>& discs) {
  const double dt = time_s - time_s_;
  for (std::size_t i = 0; i < robots_.size(); ++i) {
    Robot& robot = robots_[i];
    robot.since_s += dt;
    if (driven(robot.motion).left) robot.driven_s.left += dt;
    if (driven(robot.motion).right) robot.driven_s.right += dt;
    robot.since_rest_s = robot.motion == Motion::kStop ? 0 : robot.since_rest_s + dt;
    if (robot.motion == Motion::kStop) continue;
    const std::size_t at = spot(discs[i]);
    trodden_s_[at] += static_cast<float>(dt);
    Passages& passages = passages_[at];
    if (passages.last != static_cast<int>(i)) {
      passages.other_s = passages.last_s;
      passages.last = static_cast<int>(i);
    }
    passages.last_s = static_cast<float>(time_s);
  }
  time_s_ = time_s;
  take_orders();
}

double Memory::next_change_s() const {
  double next = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < robots_.size(); ++i) {
    const std::vector<Order>& orders = (*orders_)[i];
    if (robots_[i].next < orders.size()) next = std::min(next, orders[robots_[i].next].time_s);
  }
  return next;
}

Situation Memory::situation(int robot, Vec disc, double heading_rad, const std::vector<Vec>& discs) const {
  const Robot& r = robots_[static_cast<std::size_t>(robot)];
  const Passages& passages = passages_[spot(disc)];
  return {time_s_,
          run_,
          robot,
          disc,
          heading_rad,
          r.motion,
          r.before,
          r.since_s,
          r.driven_s,
          r.since_rest_s,
          trodden_s_[spot(disc)],
          &discs,
          time_s_ - static_cast<double>(passages.last == robot ? passages.other_s : passages.last_s),
          r.last_turn,
          r.before_s,
          r.commands,
          &motions_};
}

World::World(const Scene& scene, const std::vector<Individual>& individuals, Memory memory,
             std::vector<Stance> stances)
    : scene_(scene),
      individuals_(individuals),
      memory_(std::move(memory)),
      stances_(std::move(stances)),
      discs_(stances_.size()) {
  for (std::size_t i = 0; i < stances_.size(); ++i) discs_[i] = disc_of(scene_, stances_[i]);
}

void World::start_from(double time_s, const Memory& memory, const std::vector<Stance>& stances) {
  time_s_ = time_s;
  memory_ = memory;
  stances_ = stances;
  for (std::size_t i = 0; i < stances_.size(); ++i) discs_[i] = disc_of(scene_, stances_[i]);
}

void World::step(double dt, Dice* dice) {
  // f is drawn per step; shorter steps have a larger variance, so that its integral does not depend on the cuts.
  for (std::size_t i = 0; i < stances_.size(); ++i) {
    const Situation now = memory_.situation(static_cast<int>(i), discs_[i], stances_[i].heading_rad, discs_);
    Wheels<double> factor{1, 1};
    if (dice) {
      const double sd = factor_sd(scene_, now, dt);
      factor = {1 + sd * dice->normal(), 1 + sd * dice->normal()};
    }
    stances_[i] = moved(scene_, individuals_[i], stances_[i], now, dt, factor);
  }
  part(scene_, stances_, shift_);
  for (std::size_t i = 0; i < stances_.size(); ++i) discs_[i] = disc_of(scene_, stances_[i]);
  time_s_ += dt;
  memory_.go_to(time_s_, discs_);
}

void World::go_to(double time_s, Dice* dice) {
  while (time_s_ < time_s - 1e-9) {
    step(std::min({scene_.step_s, time_s - time_s_, std::max(memory_.next_change_s() - time_s_, 1e-6)}), dice);
  }
}

View World::view(int robot) const {
  const auto i = static_cast<std::size_t>(robot);
  return view_of(scene_, stances_[i], memory_.situation(robot, discs_[i], stances_[i].heading_rad, discs_));
}

}  // namespace kilotwin::truth
