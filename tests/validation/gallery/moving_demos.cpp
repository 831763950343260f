// Robots move by what they hear or see.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/stats/moments.hpp"
#include "tests/validation/gallery/demos.hpp"

namespace kilotwin::validation {
namespace {

/// Turns of robot `walker` around a point, anticlockwise, over all states.
double turns_around(const DemoRun& run, std::size_t walker, double x_mm, double y_mm) {
  double turns = 0, before = 0;
  for (std::size_t k = 0; k < run.time_s.size(); ++k) {
    const double angle = std::atan2(run.y_mm[k][walker] - y_mm, run.x_mm[k][walker] - x_mm);
    if (k > 0) turns += std::remainder(angle - before, 2 * std::numbers::pi) / (2 * std::numbers::pi);
    before = angle;
  }
  return turns;
}

/// Distance to the nearest other robot.
double nearest_mm(const DemoRun& run, std::size_t state, std::size_t robot) {
  double nearest = HUGE_VAL;
  for (std::size_t other = 0; other < run.robots(); ++other) {
    if (other != robot) nearest = std::min(nearest, run.distance_mm(state, robot, other));
  }
  return nearest;
}

/// Adds how near and how far a robot stays from the nearest other one after `from_s`.
void add_band(const DemoRun& run, std::size_t walker, double from_s, double least_mm, double most_mm,
              Verdicts& verdicts) {
  double least = HUGE_VAL, most = 0;
  stats::Moments mean;
  for (std::size_t k = 0; k < run.time_s.size(); ++k) {
    if (run.time_s[k] < from_s) continue;
    const double distance_mm = nearest_mm(run, k, walker);
    least = std::min(least, distance_mm);
    most = std::max(most, distance_mm);
    mean.add(distance_mm);
  }
  verdicts.near("mean distance to the nearest robot", "mm", {mean.mean()}, {0.5 * (least_mm + most_mm)},
                0.25 * (most_mm - least_mm));
  verdicts.at_least("least distance", "mm", {least}, least_mm);
  verdicts.at_most("largest distance", "mm", {most}, most_mm);
}

/// Largest gap between a robot and the one ahead of it in a state.
double widest_gap_mm(const DemoRun& run, std::size_t state) {
  double widest = 0;
  for (std::size_t robot = 1; robot < run.robots(); ++robot)
    widest = std::max(widest, run.distance_mm(state, robot, robot - 1));
  return widest;
}

/// When a gap of the chain first exceeds the range; the run's end if none does.
double broke_s(const DemoRun& run) {
  for (std::size_t k = 0; k < run.time_s.size(); ++k) {
    if (widest_gap_mm(run, k) > run.range_mm) return run.time_s[k];
  }
  return run.duration_s;
}

}  // namespace

void show_orbit(const DemoSettings& settings, Verdicts& verdicts) {
  const DemoRun run = run_demo(settings, "orbit", {}, "orbit");
  add_band(run, 1, 20, 45, 75, verdicts);
  verdicts.at_least("turns around the star, anticlockwise", "", {turns_around(run, 1, 0, 0)}, 2);
}

void show_edge_follow(const DemoSettings& settings, Verdicts& verdicts) {
  const DemoRun run = run_demo(settings, "edge-follow", {}, "edge-follow");
  add_band(run, 0, 20, 38, 72, verdicts);
  verdicts.at_least("turns around the group, anticlockwise", "", {turns_around(run, 0, 0, 0)}, 1);
}

void show_disperse(const DemoSettings& settings, Verdicts& verdicts) {
  constexpr double kNear_mm = 60;
  const DemoRun run = run_demo(settings, "disperse", {}, "disperse");
  stats::Moments first, last;
  double alone = 0;
  for (std::size_t robot = 0; robot < run.robots(); ++robot) {
    first.add(nearest_mm(run, 0, robot));
    last.add(nearest_mm(run, run.last(), robot));
    alone += nearest_mm(run, run.last(), robot) > kNear_mm ? 1 : 0;
  }
  verdicts.near("mean distance to the nearest robot at the start", "mm", {first.mean()}, {40}, 0.001);
  verdicts.at_least("mean distance to the nearest robot at the end", "mm", {last.mean()}, kNear_mm);
  verdicts.at_least("robots farther than 60 mm from all others", "", {alone},
                    0.9 * static_cast<double>(run.robots()));
}

void show_phototaxis(const DemoSettings& settings, Verdicts& verdicts) {
  constexpr double kAtLamp_mm = 200;
  const auto at_lamp = [](const DemoRun& run, std::size_t state) {
    double count = 0;
    for (std::size_t robot = 0; robot < run.robots(); ++robot)
      count += std::hypot(run.x_mm[state][robot], run.y_mm[state][robot]) < kAtLamp_mm ? 1 : 0;
    return count;
  };
  const DemoRun run = run_demo(settings, "phototaxis", {}, "phototaxis");
  verdicts.at_most("robots within 200 mm of the lamp at the start", "", {at_lamp(run, 0)}, 5);
  verdicts.at_least("robots within 200 mm of the lamp at the end", "", {at_lamp(run, run.last())}, 18);
  // Further ways to seek the same lamp, some of which take longer.
  for (const auto& [program, duration_s] :
       {std::pair<std::string, int>{"move_to_light.c", 600}, {"scan_and_go.c", 600}, {"climb_to_light.c", 300}}) {
    const std::string behaviour = (settings.folder / "../../behaviours" / program).string();
    const DemoRun other =
        run_demo(settings, "phototaxis", {"--behaviour", behaviour, "--duration", std::to_string(duration_s)});
    verdicts.at_least(fmt::format("the same with `{}`, {} s", program, duration_s), "",
                      {at_lamp(other, other.last())}, 18);
  }
}

void show_follow(const DemoSettings& settings, Verdicts& verdicts) {
  constexpr int kSeeds = 3;
  // Runs of `kSeeds` seeds where robots wait as `wait` says.
  const auto runs = [&](int wait, const std::vector<std::string>& words) {
    std::vector<DemoRun> all;
    for (int seed = 1; seed <= kSeeds; ++seed) {
      std::vector<std::string> own{"--define", fmt::format("WAIT={}", wait), "--seed", std::to_string(seed)};
      own.insert(own.end(), words.begin(), words.end());
      const bool first = seed == 1 && words.empty() && wait != 1;
      all.push_back(run_demo(settings, "follow", own,
                             !first      ? ""
                             : wait == 2 ? "follow"
                                         : "follow-without-waiting"));
    }
    return all;
  };
  const std::vector<DemoRun> waits = runs(2, {});
  double widest = 0, shortest = HUGE_VAL;
  for (const DemoRun& run : waits) {
    for (std::size_t k = 0; k < run.time_s.size(); ++k) widest = std::max(widest, widest_gap_mm(run, k));
    const std::size_t tail = run.robots() - 1;
    shortest = std::min(shortest, std::hypot(run.x_mm[run.last()][tail] - run.x_mm[0][tail],
                                             run.y_mm[run.last()][tail] - run.y_mm[0][tail]));
  }
  verdicts.at_most(fmt::format("widest gap, {} seeds; the range is {:g} mm", kSeeds, waits[0].range_mm), "mm",
                   {widest}, 0.9 * waits[0].range_mm);
  verdicts.at_least("way of the last robot, at least", "mm", {shortest}, 100);
  const auto broken = [](const std::vector<DemoRun>& all) {
    return static_cast<double>(
        std::count_if(all.begin(), all.end(), [](const DemoRun& run) { return broke_s(run) < run.duration_s; }));
  };
  const auto latest_s = [](const std::vector<DemoRun>& all) {
    double latest = 0;
    for (const DemoRun& run : all) latest = std::max(latest, broke_s(run));
    return latest;
  };
  verdicts.at_least("chains that break if both of a pair may move at once (WAIT=1)", "", {broken(runs(1, {}))}, 1);
  verdicts.at_most("nobody waits (WAIT=0): all chains broken after", "s", {latest_s(runs(0, {}))}, 60);
  verdicts.at_most("the same without noise of motion", "s", {latest_s(runs(0, {"--set", "motion.noise=false"}))},
                   60);
}

}  // namespace kilotwin::validation
