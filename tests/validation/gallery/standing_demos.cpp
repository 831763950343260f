// Robots stand still and talk.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "core/base/error.hpp"
#include "core/stats/moments.hpp"
#include "tests/validation/gallery/demos.hpp"

namespace kilotwin::validation {
namespace {

constexpr std::uint32_t kOff = 0, kRed = 0x03, kBlue = 0x30, kMagenta = 0x33, kCyan = 0x3C, kWhite = 0x3F;

/// Each robot's flash nearest to the last one of robot 0 of which half a period follows: the time between the two, as a part of
/// the period. Throws RunError where a robot never flashes.
std::vector<double> phases(const DemoRun& run, double period_s) {
  const auto flashes = [&](std::size_t robot) {
    std::vector<double> times_s;
    for (const LedChange& change : run.led_changes[robot]) {
      if (change.led == kWhite) times_s.push_back(change.time_s);
    }
    if (times_s.empty()) throw RunError(fmt::format("robot {} never flashes", robot));
    return times_s;
  };
  double reference_s = 0;
  for (const double time_s : flashes(0)) {
    if (time_s <= run.duration_s - 0.5 * period_s) reference_s = time_s;
  }
  std::vector<double> all;
  for (std::size_t robot = 0; robot < run.robots(); ++robot) {
    double nearest_s = HUGE_VAL;
    for (const double time_s : flashes(robot)) {
      if (std::abs(time_s - reference_s) < std::abs(nearest_s)) nearest_s = time_s - reference_s;
    }
    all.push_back(nearest_s / period_s);
  }
  return all;
}

/// Kuramoto's order parameter: 1 where all phases agree, about 1 / sqrt(n) where they are random.
double order(const std::vector<double>& phases) {
  double x = 0, y = 0;
  for (const double phase : phases) {
    x += std::cos(2 * std::numbers::pi * phase);
    y += std::sin(2 * std::numbers::pi * phase);
  }
  return std::hypot(x, y) / static_cast<double>(phases.size());
}

void show_flashing(const DemoSettings& settings, Verdicts& verdicts, const std::string& name) {
  constexpr double kPeriod_s = 124 * 0.032768;
  const std::vector<double> all = phases(run_demo(settings, name, {}, name), kPeriod_s);
  const auto [first, last] = std::minmax_element(all.begin(), all.end());
  verdicts.at_least("order parameter at the end", "", {order(all)}, 0.99);
  verdicts.at_most("from the first to the last flash of a period", "s", {(*last - *first) * kPeriod_s}, 0.25);
  const DemoRun deaf = run_demo(settings, name, {"--set", "radio.range_mm=34"});
  verdicts.at_most("order parameter where nobody hears another", "", {order(phases(deaf, kPeriod_s))}, 0.6);
}

}  // namespace

void show_speaker_listener(const DemoSettings& settings, Verdicts& verdicts) {
  constexpr double kFar_mm = 50;
  const DemoRun run = run_demo(settings, "speaker-listener", {}, "speaker-listener");
  std::size_t within = 0, complete = 0, right = 0, dark = 0;
  for (std::size_t robot = 1; robot < run.robots(); ++robot) {
    std::set<std::uint32_t> shown;
    for (const LedChange& change : run.led_changes[robot]) {
      if (change.led != kOff) shown.insert(change.led);
    }
    const double distance_mm = run.distance_mm(0, 0, robot);
    if (distance_mm > run.range_mm) {
      dark += shown.empty() && run.received[robot] == 0 ? 1U : 0U;
      continue;
    }
    ++within;
    complete += run.received[robot] == run.sent[0] ? 1U : 0U;
    const std::set<std::uint32_t> expected =
        distance_mm > kFar_mm ? std::set{kMagenta, kCyan} : std::set{kRed, kBlue};
    right += shown == expected ? 1U : 0U;
  }
  const double listeners = static_cast<double>(run.robots() - 1);
  verdicts.at_least("messages of the speaker", "", {static_cast<double>(run.sent[0])}, 1.8 * run.duration_s);
  verdicts.near("listeners within range that heard every message", "", {static_cast<double>(complete)},
                {static_cast<double>(within)}, 0);
  verdicts.near("of them, with the two colours of their distance", "", {static_cast<double>(right)},
                {static_cast<double>(within)}, 0);
  verdicts.near("listeners out of range that stayed dark", "", {static_cast<double>(dark)},
                {listeners - static_cast<double>(within)}, 0);
}

void show_gradient(const DemoSettings& settings, Verdicts& verdicts) {
  constexpr double kUnknown = 255;
  const DemoRun run = run_demo(settings, "gradient", {}, "gradient");
  const std::vector<int> expected = run.hops_from(0, run.last());
  const std::vector<double>& hops = run.values("hops");
  double equal = 0, unreached = 0;
  for (std::size_t robot = 0; robot < run.robots(); ++robot) {
    equal += hops[robot] == (expected[robot] < 0 ? kUnknown : expected[robot]) ? 1 : 0;
    unreached += expected[robot] < 0 ? 1 : 0;
  }
  verdicts.at_least("largest number of hops", "",
                    {static_cast<double>(*std::max_element(expected.begin(), expected.end()))}, 5);
  verdicts.near("robots that show their distance in the graph of links", "", {equal},
                {static_cast<double>(run.robots())}, 0);
  verdicts.at_most("robots without a path to the source", "", {unreached}, 0.1 * static_cast<double>(run.robots()));
}

void show_leader_election(const DemoSettings& settings, Verdicts& verdicts) {
  const DemoRun run = run_demo(settings, "leader-election", {}, "leader-election");
  const std::vector<double>&own = run.values("own"), &leader = run.values("leader");
  std::vector<int> group(run.robots(), -1);
  int groups = 0, diameter = 0;
  for (std::size_t robot = 0; robot < run.robots(); ++robot) {
    const std::vector<int> hops = run.hops_from(robot, run.last());
    diameter = std::max(diameter, *std::max_element(hops.begin(), hops.end()));
    if (group[robot] >= 0) continue;
    for (std::size_t other = 0; other < run.robots(); ++other) {
      if (hops[other] >= 0) group[other] = groups;
    }
    ++groups;
  }
  double right = 0, leaders = 0;
  for (std::size_t robot = 0; robot < run.robots(); ++robot) {
    double largest = 0;
    for (std::size_t other = 0; other < run.robots(); ++other) {
      if (group[other] == group[robot]) largest = std::max(largest, own[other]);
    }
    right += leader[robot] == largest ? 1 : 0;
    leaders += run.led[robot] == kWhite ? 1 : 0;
  }
  verdicts.near("robots that follow the largest number of their group", "", {right},
                {static_cast<double>(run.robots())}, 0);
  verdicts.near("robots that lead, one per connected group", "", {leaders}, {static_cast<double>(groups)}, 0);
  double agreed_s = 0;
  for (const auto& [time_s, values] : run.variables.at("leader")) {
    if (values != leader) agreed_s = time_s;
  }
  // kilolib sends about twice per second; a hop costs at most one such period unless messages collide.
  verdicts.at_most(fmt::format("agreed after, {} hops across", diameter), "s", {agreed_s}, 1.0 * diameter);
}

void show_sync(const DemoSettings& settings, Verdicts& verdicts) { show_flashing(settings, verdicts, "sync"); }

void show_firefly(const DemoSettings& settings, Verdicts& verdicts) {
  show_flashing(settings, verdicts, "firefly");
}

void show_morphogenesis(const DemoSettings& settings, Verdicts& verdicts) {
  const auto deviation = [](const DemoRun& run) {
    stats::Moments sample;
    for (const double value : run.values("activator")) sample.add(value);
    return sample.standard_deviation();
  };
  const DemoRun run = run_demo(settings, "morphogenesis", {}, "morphogenesis");
  const std::vector<double>& activator = run.values("activator");
  double mean = 0, product = 0, square = 0, links = 0, members = 0;
  for (const double value : activator) mean += value / static_cast<double>(run.robots());
  for (std::size_t a = 0; a < run.robots(); ++a) {
    square += (activator[a] - mean) * (activator[a] - mean);
    members += activator[a] > 0.5 ? 1 : 0;
    for (std::size_t b = 0; b < run.robots(); ++b) {
      if (a == b || run.distance_mm(0, a, b) > run.range_mm) continue;
      product += (activator[a] - mean) * (activator[b] - mean);
      ++links;
    }
  }
  verdicts.at_least("standard deviation of the activator", "", {deviation(run)}, 0.5);
  verdicts.at_least("robots in spots", "", {members}, 0.1 * static_cast<double>(run.robots()));
  // Moran's I: neighbours are alike, so the pattern has spots and is not salt and pepper.
  verdicts.at_least("autocorrelation of neighbours (Moran's I)", "",
                    {product / links / (square / static_cast<double>(run.robots()))}, 0.2);
  std::set<std::size_t> changed;
  for (const auto& [time_s, values] : run.variables.at("activator")) {
    if (time_s < 0.8 * run.duration_s) continue;
    for (std::size_t robot = 0; robot < run.robots(); ++robot) {
      if ((values[robot] > 0.5) != (activator[robot] > 0.5)) changed.insert(robot);
    }
  }
  verdicts.at_most("robots that enter or leave a spot in the last fifth of the run", "",
                   {static_cast<double>(changed.size())}, 0.05 * static_cast<double>(run.robots()));
  const DemoRun equal = run_demo(settings, "morphogenesis", {"--define", "INHIBITOR_FLOW=ACTIVATOR_FLOW"});
  verdicts.at_most("standard deviation where both substances flow alike", "", {deviation(equal)}, 0.05);
}

}  // namespace kilotwin::validation
