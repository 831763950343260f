#include "tests/identify/truth/play.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "tests/identify/truth/dice.hpp"
#include "tests/identify/truth/world.hpp"

namespace kilotwin::truth {
namespace {

/// Times are whole milliseconds.
double stamped(double time_s) { return std::round(time_s * 1000) / 1000; }

std::vector<Order> draw_orders(const Scene& scene, double duration_s, Dice& dice) {
  std::vector<Order> orders;
  double time_s = 0;
  bool straight = dice.uniform() < 0.5;
  while (time_s < duration_s) {
    Motion motion = Motion::kStraight;
    double lasts_s = dice.between(scene.straight_low_s, scene.straight_high_s);
    if (dice.uniform() < scene.stop_share) {
      motion = Motion::kStop;
      lasts_s = dice.between(scene.stop_low_s, scene.stop_high_s);
    } else if (!straight) {
      motion = dice.uniform() < scene.left_share ? Motion::kLeft : Motion::kRight;
      lasts_s = dice.between(scene.turn_low_s, scene.turn_high_s);
    }
    if (motion != Motion::kStop) straight = !straight;
    if (orders.empty() || orders.back().motion != motion) orders.push_back({time_s, motion});
    time_s = stamped(time_s + lasts_s);
  }
  return orders;
}

/// Random positions without overlaps.
std::vector<Stance> draw_stances(const Scene& scene, Dice& dice) {
  const double width = scene.width_mm > 0 ? scene.width_mm - 80 : 900,
               height = scene.width_mm > 0 ? scene.height_mm - 80 : 900;
  std::vector<Stance> stances;
  std::vector<Vec> discs;
  while (stances.size() < static_cast<std::size_t>(scene.robots)) {
    const Stance stance{{dice.between(-0.5, 0.5) * width, dice.between(-0.5, 0.5) * height},
                        dice.between(-std::numbers::pi, std::numbers::pi)};
    const Vec disc = disc_of(scene, stance);
    const bool apart = std::all_of(discs.begin(), discs.end(), [&](Vec other) {
      return std::hypot(other.x - disc.x, other.y - disc.y) > 2.2 * kDiscRadius_mm;
    });
    if (!apart) continue;
    stances.push_back(stance);
    discs.push_back(disc);
  }
  return stances;
}

struct Gap {
  double from_s, until_s;
};

Run play_run(const Scene& scene, const std::vector<Individual>& individuals, int number, double duration_s,
             Dice& dice) {
  Run run;
  run.number = number;
  run.duration_s = duration_s;
  std::vector<Gap> gaps;
  for (int robot = 0; robot < scene.robots; ++robot) {
    run.orders.push_back(draw_orders(scene, duration_s, dice));
    const double from_s = dice.uniform() < scene.gap_share ? dice.between(0, duration_s - 10) : duration_s + 1;
    gaps.push_back({from_s, from_s + 10});
  }
  World world(scene, individuals, Memory(scene, number, run.orders), draw_stances(scene, dice));
  run.marks.resize(static_cast<std::size_t>(scene.robots));
  std::vector<std::vector<Sample>> tracks(static_cast<std::size_t>(scene.robots));
  double sample_s = 0, mark_s = 0;
  while (true) {
    const double next_s = std::min(sample_s, mark_s);
    if (next_s > duration_s + 1e-9) break;
    world.go_to(next_s, &dice);
    for (int robot = 0; robot < scene.robots; ++robot) {
      const auto i = static_cast<std::size_t>(robot);
      const View view = world.view(robot);
      if (next_s == mark_s) run.marks[i].push_back(view);
      if (next_s != sample_s) continue;
      Vec noise{dice.normal(), dice.normal()};
      const double heading_noise = dice.normal();
      if (scene.coarse > 0 && dice.uniform() < scene.coarse) noise = {kCoarse * noise.x, kCoarse * noise.y};
      if (dice.uniform() < scene.missing || (next_s > gaps[i].from_s && next_s < gaps[i].until_s)) continue;
      tracks[i].push_back(
          {number,
           robot,
           next_s,
           {view.point.x + scene.tracker_sd_mm * noise.x, view.point.y + scene.tracker_sd_mm * noise.y},
           std::remainder(view.heading_rad + scene.heading_sd_rad * heading_noise, 2 * std::numbers::pi)});
    }
    if (next_s == mark_s) mark_s += kMarkInterval_s;
    if (next_s == sample_s)
      sample_s = stamped(sample_s + scene.sample_s * (1 + scene.jitter * dice.between(-1, 1)));
  }
  for (const std::vector<Sample>& track : tracks) run.samples.insert(run.samples.end(), track.begin(), track.end());
  return run;
}

void apply(const Fault& fault, Run& run, Dice& dice) {
  const auto within = [&](const Sample& s) { return s.time_s >= fault.from_s && s.time_s < fault.until_s; };
  switch (fault.kind) {
    case Fault::Kind::kSwapped:
      for (Sample& s : run.samples) {
        if (s.time_s < fault.from_s) continue;
        if (s.robot == fault.robot)
          s.robot = fault.other;
        else if (s.robot == fault.other)
          s.robot = fault.robot;
      }
      break;
    case Fault::Kind::kClock:
      for (Sample& s : run.samples) s.time_s = stamped(s.time_s * fault.amount);
      break;
    case Fault::Kind::kDuplicate: {
      std::vector<Sample> copies;
      for (Sample s : run.samples) {
        if (s.robot != fault.robot) continue;
        s.robot = fault.other;
        s.point.x += 0.2 * dice.normal();
        s.point.y += 0.2 * dice.normal();
        copies.push_back(s);
      }
      run.samples.insert(run.samples.end(), copies.begin(), copies.end());
      run.orders.resize(std::max(run.orders.size(), static_cast<std::size_t>(fault.other) + 1));
      run.orders[static_cast<std::size_t>(fault.other)] = run.orders[static_cast<std::size_t>(fault.robot)];
      break;
    }
    case Fault::Kind::kOutliers:
      for (Sample& s : run.samples) {
        const double angle = dice.between(-std::numbers::pi, std::numbers::pi), distance = dice.between(15, 300);
        if (dice.uniform() >= fault.amount) continue;
        s.point.x += distance * std::cos(angle);
        s.point.y += distance * std::sin(angle);
      }
      break;
    case Fault::Kind::kFrozen: {
      const Sample* held = nullptr;
      for (Sample& s : run.samples) {
        if (s.robot != fault.robot) continue;
        if (!within(s)) continue;
        if (held) {
          s.point = held->point;
          s.heading_rad = held->heading_rad;
        } else {
          held = &s;
        }
      }
      break;
    }
  }
  std::stable_sort(run.samples.begin(), run.samples.end(), [](const Sample& a, const Sample& b) {
    return a.robot != b.robot ? a.robot < b.robot : a.time_s < b.time_s;
  });
}

}  // namespace

Motion motion_at(const std::vector<Order>& orders, double time_s) {
  Motion motion = Motion::kStop;
  for (const Order& order : orders) {
    if (order.time_s > time_s + 1e-9) break;
    motion = order.motion;
  }
  return motion;
}

Play play(const Scene& scene, std::uint64_t seed) {
  Dice dice(seed);
  Play out;
  out.seed = seed;
  for (int i = 0; i < scene.robots; ++i) {
    const auto bias = [&] { return scene.bias_mean_mm_s + scene.bias_sd_mm_s * dice.normal(); };
    const double left = bias(), right = bias();
    out.individuals.push_back({{left, right}});
  }
  for (int i = 0; i < scene.train_runs; ++i) {
    out.train.push_back(play_run(scene, out.individuals, i, scene.train_s, dice));
  }
  for (int i = 0; i < scene.test_runs; ++i) {
    out.test.push_back(play_run(scene, out.individuals, scene.train_runs + i, scene.test_s, dice));
  }
  for (const Fault& fault : scene.faults) {
    for (Run& run : out.train) {
      if (run.number == fault.run) apply(fault, run, dice);
    }
  }
  return out;
}

}  // namespace kilotwin::truth
