// Measures the residual monitor on robots that the simulator's drive model plays: false alarms, detection delays, cost. Writes
// Markdown tables. Arguments: experiment hours without faults (default 2), replicates of a patch (default 5).
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <vector>

#include "tests/clients/monitor/virtual_arena.hpp"

namespace kilotwin::monitor {
namespace {

using testing::ArenaOptions;
using testing::VirtualArena;

constexpr double kTick_s = 0.032768;
constexpr const char* kModel = "motion { factor_variance_s: 0.001 } ";

std::vector<Alarm> play(VirtualArena& arena, double seconds) {
  std::vector<Alarm> alarms;
  for (const auto end = arena.now() + static_cast<std::int64_t>(seconds / kTick_s); arena.now() < end;) {
    arena.step();
    for (Alarm& alarm : arena.monitor().take_alarms()) alarms.push_back(std::move(alarm));
  }
  return alarms;
}

void false_alarms(double hours) {
  fmt::print(
      "## False alarms\n\n50 robots that follow the model, in a square of 3 m. Positions have 0.5 mm of noise, "
      "headings 3 degrees, 2 % of the poses are missing.\n\n"
      "| stated bound, per experiment hour | experiment hours | tested robot-hours | alarms | per experiment "
      "hour |\n|---|---|---|---|---|\n");
  double ns = 0, robot_ticks = 0;
  Totals totals;
  for (const double stated : {0.1, 100.0}) {
    ArenaOptions options;
    options.model = kModel;
    options.seed = stated < 1 ? 1 : 2;
    MonitorSettings settings;
    settings.false_alarms_per_hour = stated;
    const double length = stated < 1 ? hours : hours / 4;
    VirtualArena arena(options, settings);
    const std::vector<Alarm> alarms = play(arena, 3600 * length);
    const Totals now = arena.monitor().totals();
    fmt::print("| {} | {:g} | {:.1f} | {} | {:.2g} |\n", stated, length, now.tested_robot_hours, alarms.size(),
               static_cast<double>(alarms.size()) / length);
    std::fflush(stdout);
    if (stated > 1) continue;
    totals = now;
    ns += arena.monitor_ns();
    robot_ticks += static_cast<double>(arena.now().count()) * options.robots;
  }
  fmt::print(
      "\nWhitened innovations of the first row: variance {:.4f} along, {:.4f} across, {:.4f} of the heading; "
      "{:.1e} of the poses beyond the gate.\n\n"
      "## Cost\n\n{:.0f} ns of CPU time per robot and tick, with a pose per tick.\n\n",
      totals.white_variance[0], totals.white_variance[1], totals.white_variance[2],
      static_cast<double>(totals.outliers) / static_cast<double>(totals.samples), ns / robot_ticks);
}

struct Delays {
  std::vector<double> seconds;
  std::size_t expected = 0, named = 0, other = 0;
};

void row(const std::string& effect, const std::string& size, Delays& delays) {
  std::sort(delays.seconds.begin(), delays.seconds.end());
  const auto quantile = [&](double p) {
    const auto rank = static_cast<std::size_t>(std::ceil(p * static_cast<double>(delays.expected)));
    return rank >= 1 && rank <= delays.seconds.size() ? fmt::format("{:.2f}", delays.seconds[rank - 1])
                                                      : std::string("none");
  };
  fmt::print("| {} | {} | {} of {} | {} | {} | {} | {} |\n", effect, size, delays.seconds.size(), delays.expected,
             delays.named, quantile(0.5), quantile(0.9), delays.other);
  std::fflush(stdout);
}

/// One robot after the other loses part of a wheel's speed.
void motors(double gain) {
  constexpr std::uint32_t kRobots = 20;
  constexpr double kFirst_s = 80, kApart_s = 15;
  ArenaOptions options;
  options.robots = kRobots;
  options.side_mm = 2000;
  options.model = kModel;
  options.rests = false;
  const auto onset = [&](std::uint32_t robot) { return kFirst_s + kApart_s * robot; };
  for (std::uint32_t robot = 0; robot < kRobots; ++robot) {
    options.faults += fmt::format(
        "effect {{ name: \"f{0}\" acts_on: WHEEL_GAIN wheel: LEFT_WHEEL robot: {0} function {{ of: TIME steps {{ "
        "at: "
        "{1} value: 0 value: {2} }} }} }} ",
        robot, onset(robot), gain);
  }
  VirtualArena arena(options, {});
  std::vector<Alarm> alarms = play(arena, onset(kRobots) + 30);
  Delays delays;
  delays.expected = kRobots;
  std::vector<char> seen(kRobots, 0);
  for (const Alarm& alarm : alarms) {
    const bool of_one = alarm.robots.size() == 1 && alarm.suspect < Suspect::kCalibrationShift;
    const std::uint32_t robot = of_one ? alarm.robots[0] : 0;
    if (!of_one || alarm.time_s < onset(robot)) {
      ++delays.other;
      continue;
    }
    if (std::exchange(seen[robot], 1) != 0) continue;
    delays.seconds.push_back(alarm.time_s - onset(robot));
    const auto& or_else = alarm.alternatives;
    delays.named += alarm.suspect == Suspect::kGainLeft ||
                    std::find(or_else.begin(), or_else.end(), Suspect::kGainLeft) != or_else.end();
  }
  row("a wheel loses speed", fmt::format("{:.0f} %", 100 * gain), delays);
}

/// The camera is knocked to and fro.
void knocks(double size_mm) {
  constexpr int kKnocks = 30;
  ArenaOptions options;
  options.robots = 20;
  options.side_mm = 2000;
  options.model = kModel;
  VirtualArena arena(options, {});
  Delays delays;
  delays.expected = kKnocks;
  delays.other = play(arena, 90).size();
  for (int knock = 1; knock <= kKnocks; ++knock) {
    const double begun = arena.now_s();
    bool found = false;
    while (arena.now_s() < begun + 6) {
      arena.step({knock % 2 == 1 ? size_mm : 0, 0, 0});
      for (const Alarm& alarm : arena.monitor().take_alarms()) {
        delays.other += alarm.suspect != Suspect::kCalibrationShift || found;
        if (std::exchange(found, true)) continue;
        delays.seconds.push_back(alarm.time_s - begun);
        delays.named += alarm.suspect == Suspect::kCalibrationShift;
      }
    }
  }
  row("the camera is knocked", fmt::format("{:g} mm", size_mm), delays);
}

/// A patch of 200 mm in an arena of 1 m becomes slow.
void patches(double gain, int replicates) {
  Delays delays;
  delays.expected = static_cast<std::size_t>(replicates);
  for (int replicate = 0; replicate < replicates; ++replicate) {
    ArenaOptions options;
    options.robots = 20;
    options.side_mm = 1000;
    options.seed = 10 + static_cast<std::uint64_t>(replicate);
    options.model = kModel;
    options.rests = false;
    constexpr double kOnset_s = 80;
    options.faults = fmt::format(
        "effect {{ name: \"patch\" acts_on: WHEEL_GAIN function {{ constant: {} }} "
        "function {{ of: X steps {{ at: -100 at: 100 value: 0 value: 1 value: 0 }} }} "
        "function {{ of: Y steps {{ at: -100 at: 100 value: 0 value: 1 value: 0 }} }} "
        "function {{ of: TIME steps {{ at: {} value: 0 value: 1 }} }} }}",
        gain, kOnset_s);
    VirtualArena arena(options, {});
    bool found = false;
    while (arena.now_s() < kOnset_s + 400 && !found) {
      arena.step();
      for (const Alarm& alarm : arena.monitor().take_alarms()) {
        const bool is_patch = alarm.suspect == Suspect::kPatch && std::hypot(alarm.x_mm, alarm.y_mm) < 200;
        if (!is_patch) {
          const auto& or_else = alarm.alternatives;
          delays.other += std::find(or_else.begin(), or_else.end(), Suspect::kPatch) == or_else.end();
          continue;
        }
        found = true;
        delays.seconds.push_back(alarm.time_s - kOnset_s);
        ++delays.named;
      }
    }
  }
  row("a patch of 200 mm becomes slow", fmt::format("{:.0f} %", 100 * gain), delays);
}

}  // namespace
}  // namespace kilotwin::monitor

int main(int count, char** words) {
  using namespace kilotwin::monitor;
  const double hours = count > 1 ? std::atof(words[1]) : 2;
  const int replicates = count > 2 ? std::atoi(words[2]) : 5;
  false_alarms(hours);
  fmt::print(
      "## Detection delay\n\n20 robots, a bound of 0.1 false alarms per hour. Delay from the onset of the effect "
      "to the alarm, s.\n\n| effect | size | detected | named | median | 90 % | other alarms |\n"
      "|---|---|---|---|---|---|---|\n");
  for (const double gain : {-1.0, -0.5, -0.25}) motors(gain);
  for (const double size_mm : {1.0, 2.0, 5.0}) knocks(size_mm);
  for (const double gain : {-0.6, -0.3}) patches(gain, replicates);
  fmt::print(
      "\nA detection counts as named if the effect is the suspect or one of its alternatives. Other alarms are "
      "those of "
      "other robots, of\nother effects, or repeated. The delay of a patch includes the time until robots enter "
      "it.\n");
  return 0;
}
