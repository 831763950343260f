// Figures of firmware robots, as tables in Markdown (bench/firmware-robots):
//   firmware_figures agreement    six programs, native and as firmware, 120 s: agreement of motors and LED within a tick
//   firmware_figures contention   25 robots in range of each other: messages per robot, native and firmware
//   firmware_figures speed        10 robots on two threads: robot-seconds per second of CPU time, and simulated per wall time
#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/base/error.hpp"
#include "tests/services/comm/firmware/timeline.hpp"

namespace {

using namespace kilotwin;
using namespace kilotwin::firmware;
namespace fs = std::filesystem;

const std::string kSource = KILOTWIN_SOURCE_DIR;

fs::path folder() {
  static int runs = 0;
  return fs::temp_directory_path() / fmt::format("kilotwin-firmware-figures-{}", getpid()) / std::to_string(runs++);
}

std::string experiment(const std::string& program, bool avr, std::uint32_t robots, double duration_s,
                       double pitch_mm, double oscillator_sd) {
  return fmt::format(
      "duration_s: {} seed: 1 arena {{ width_mm: 4000 height_mm: 4000 }} motion {{ noise: false }}\n"
      "radio {{ oscillator_sd: {} range_mm: 400 }} recording {{ messages: true }}\n"
      "robots {{ count: {} behaviour: \"{}\" {} layout {{ grid {{ pitch_mm: {} }} }} }}\n",
      duration_s, oscillator_sd, robots, program, avr ? "avr: true" : "loop_rate: AS_ON_ROBOT", pitch_mm);
}

int show_agreement() {
  int status = 0;
  fmt::print(
      "| program | motors: same of native, firmware | LED: same of native, firmware | sent, received: native | "
      "firmware |\n"
      "|---|---|---|---|---|\n");
  for (const std::string name : {"behaviours/blink.c", "behaviours/walk.c", "behaviours/delay_walk.c",
                                 "behaviours/straight.c", "bench/firmware/talker.c", "bench/firmware/ranger.c"}) {
    const auto run = [&](bool avr) {
      return run_timeline(experiment(kSource + "/" + name, avr, 2, 120, 300, 0), folder(), 2);
    };
    const Timeline native = run(false), firmware = run(true);
    const std::int64_t end = native.totals.last.count();
    const Agreement motors = agreement(native.motors, firmware.motors, end);
    const Agreement led = agreement(native.led, firmware.led, end);
    const bool messages =
        native.totals.sent == firmware.totals.sent && native.totals.received == firmware.totals.received;
    fmt::print("| `{}` | {} of {}, {} | {} of {}, {} | {}, {} | {}, {} |\n", name, motors.same, motors.first,
               motors.second, led.same, led.first, led.second, native.totals.sent, native.totals.received,
               firmware.totals.sent, firmware.totals.received);
    if (!motors.whole() || !led.whole() || !messages) status = 1;
  }
  return status;
}

/// Two-sample Kolmogorov-Smirnov test: the distance, and its critical value at 1 %.
std::pair<double, double> kolmogorov_smirnov(std::vector<double> a, std::vector<double> b) {
  std::sort(a.begin(), a.end());
  std::sort(b.begin(), b.end());
  double distance = 0;
  std::size_t i = 0, j = 0;
  const auto n = static_cast<double>(a.size()), m = static_cast<double>(b.size());
  while (i < a.size() && j < b.size()) {
    const double x = std::min(a[i], b[j]);
    while (i < a.size() && a[i] <= x) ++i;
    while (j < b.size() && b[j] <= x) ++j;
    distance = std::max(distance, std::abs(static_cast<double>(i) / n - static_cast<double>(j) / m));
  }
  return {distance, 1.628 * std::sqrt((n + m) / (n * m))};
}

int show_contention() {
  constexpr std::uint32_t kRobots = 25;
  std::vector<double> sent[2], received[2];
  for (const int avr : {0, 1}) {
    for (int seed = 1; seed <= 4; ++seed) {
      const Timeline timeline =
          run_timeline(experiment(kSource + "/bench/firmware/still.c", avr != 0, kRobots, 60, 40, 0.005), folder(),
                       2, {fmt::format("seed={}", seed)});
      std::vector<double> out(kRobots, 0), in(kRobots, 0);
      for (const PairCount& pair : timeline.totals.pairs)
        (pair.receiver == pair.sender ? out[pair.sender] : in[pair.receiver]) += pair.count;
      sent[avr].insert(sent[avr].end(), out.begin(), out.end());
      received[avr].insert(received[avr].end(), in.begin(), in.end());
    }
  }
  fmt::print("| per robot in 60 s | native | firmware | KS distance | at most, at 99 % |\n|---|---|---|---|---|\n");
  int status = 0;
  const auto row = [&](const char* name, const std::vector<double>* samples) {
    const auto mean = [](const std::vector<double>& x) {
      double sum = 0;
      for (const double value : x) sum += value;
      return sum / static_cast<double>(x.size());
    };
    const auto [distance, critical] = kolmogorov_smirnov(samples[0], samples[1]);
    fmt::print("| {} | {:.2f} | {:.2f} | {:.3f} | {:.3f} |\n", name, mean(samples[0]), mean(samples[1]), distance,
               critical);
    if (distance > critical) status = 1;
  };
  row("messages sent", sent);
  row("messages received", received);
  return status;
}

/// CPU time of this process and of its threads, without the compilers that it starts.
double cpu_s() {
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(used.ru_utime) + seconds(used.ru_stime);
}

int show_speed() {
  constexpr std::uint32_t kRobots = 10;
  constexpr double kDuration_s = 20;
  fmt::print("| program | robot-seconds per second of CPU time | times real time |\n|---|---|---|\n");
  for (const char* const program :
       {"bench/firmware/still.c", "behaviours/delay_walk.c", "behaviours/blink.c", "behaviours/disperse.c",
        "behaviours/phototaxis.c", "behaviours/move_to_light.c", "tests/validation/programs/set/counts_loops.c",
        "tests/validation/programs/set/computes_long.c"}) {
    const std::string text = experiment(kSource + "/" + program, true, kRobots, kDuration_s, 40, 0.005) +
                             "light { source { height_mm: 60 intensity: 1500 } }\n";
    const double begun_s = cpu_s();
    const Timeline timeline = run_timeline(text, folder(), 2);
    fmt::print("| `{}` | {:.0f} | {:.1f} |\n", program, kRobots * kDuration_s / (cpu_s() - begun_s),
               kDuration_s / timeline.totals.wall_s);
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    if (argc == 2 && std::strcmp(argv[1], "agreement") == 0) return show_agreement();
    if (argc == 2 && std::strcmp(argv[1], "contention") == 0) return show_contention();
    if (argc == 2 && std::strcmp(argv[1], "speed") == 0) return show_speed();
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
  fmt::print(stderr, "usage: firmware_figures agreement|contention|speed\n");
  return 2;
}
