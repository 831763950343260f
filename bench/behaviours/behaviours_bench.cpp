// Cost of robots' programs in their host: ns per robot and tick on one core, context switch included, and memory. Programs return
// from loop(), block in delay(), wait busily, or compute for longer than a tick. Each figure is the fastest of several rounds
// of one second of simulated time. Prints a table in Markdown: bench/execution.
// Usage: behaviours_bench [ROBOTS [CASE [ROUNDS]]]     default: 1000 robots, all cases whose name contains CASE, 30 rounds
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "core/os/files.hpp"
#include "idl/manifest.pb.h"
#include "services/behaviours/compiler.hpp"
#include "services/behaviours/engine.hpp"

namespace {

using namespace kilotwin;
using namespace kilotwin::behaviours;
namespace fs = std::filesystem;

struct Case {
  const char* name;
  std::string source;  ///< a file, or a text with setup, loop and declarations
  bool once_per_tick = false;
};

std::string with_main(const std::string& text) {
  return "#include <kilolib.h>\nvolatile int32_t sink;\nstatic uint8_t received, heard;\n" + text +
         "\nstatic void setup(void) {}\n"
         "static void rx(message_t* m, distance_measurement_t* d) { ++heard; if (m->type == 99) received = 1; }\n"
         "int main(void) { kilo_init(); kilo_message_rx = rx; kilo_start(setup, loop); return 0; }\n";
}

/// Radio frames of a crowd: a message per robot and tick on average, an attempt in every 16th tick, RUN at the start.
RadioFrame air(Tick tick, std::uint32_t robots, bool run) {
  RadioFrame frame;
  frame.tick = tick;
  frame.kilo_ticks.assign(robots, 1);
  IrMessage message{};
  message[9] = run ? 0x88 : 0;
  frame.messages.push_back(message);
  for (std::uint32_t r = 0; r < robots; ++r) {
    const bool turn = (r + static_cast<std::uint32_t>(tick.count())) % 16 == 0;
    if (turn) frame.ask.push_back(r);
    if ((r + static_cast<std::uint32_t>(tick.count())) % 16 == 2) frame.sent.push_back(r);
    const bool hears = run || (r * 7 + static_cast<std::uint32_t>(tick.count()) * 3) % 4 != 0;
    if (!hears) continue;
    frame.reception_robot.push_back(r);
    frame.reception_message.push_back(0);
    frame.reception_high_gain.push_back(500);
    frame.reception_low_gain.push_back(400);
  }
  return frame;
}

void measure(const Case& one, std::uint32_t robots, int rounds, const fs::path& folder) {
  const bool is_file = one.source.ends_with(".c");
  const fs::path source = is_file ? fs::path(one.source) : folder / "program.c";
  if (!is_file) os::write_file(source, with_main(one.source));
  const CompiledProgram compiled = compile({source});
  fs::create_directories(folder / "programs");
  fs::copy_file(compiled.file, folder / "programs" / (compiled.sha256 + ".so"),
                fs::copy_options::overwrite_existing);
  proto::Manifest manifest;
  manifest.set_run(1);
  manifest.add_group_program(0);
  proto::RobotGroup& group = *manifest.mutable_experiment()->add_robots();
  group.set_count(robots);
  if (one.once_per_tick) group.set_loop_rate(proto::RobotGroup::ONCE_PER_TICK);
  proto::Program& program = *manifest.add_program();
  program.set_path(source.filename());
  program.set_sha256(compiled.sha256);
  for (std::uint32_t r = 0; r < robots; ++r) {
    manifest.add_x_mm(40.0 * r);
    manifest.add_y_mm(0);
    manifest.add_heading_rad(0);
  }
  const RunPlan plan(manifest);
  BehavioursEngine engine(plan, HostId{0}, ProgramSet::load(plan, folder));
  Tick tick;
  for (; tick.count() < 3; ++tick) engine.step(tick, air(tick, robots, true));
  constexpr int kTicks = 30;
  double best_ns = 1e30;
  for (int round = 0; round < rounds; ++round) {
    double ns = 0;
    for (int k = 0; k < kTicks; ++k, ++tick) {
      const RadioFrame frame = air(tick, robots, false);
      const auto begun = std::chrono::steady_clock::now();
      engine.step(tick, frame);
      ns += std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - begun).count();
    }
    best_ns = std::min(best_ns, ns / kTicks / robots);
  }
  std::printf("| %s | %.3g | %.1f |\n", one.name, best_ns,
              static_cast<double>(engine.memory_octets()) / 1024.0 / robots);
}

}  // namespace

int main(int count, char** words) {
  const std::uint32_t robots = count > 1 ? static_cast<std::uint32_t>(std::atoi(words[1])) : 1000;
  const int rounds = count > 3 ? std::atoi(words[3]) : 30;
  std::string folder = (fs::temp_directory_path() / "kilotwin-bench-XXXXXX").string();
  if (mkdtemp(folder.data()) == nullptr) return 1;
  const std::string own = std::string(KILOTWIN_BEHAVIOURS) + "/disperse.c";
  std::printf("| program | ns per robot and tick | KiB per robot |\n|---|---|---|\n");
  for (const Case& one :
       {Case{"`disperse.c`, `loop()` as on the robot, the default", own},
        Case{"`disperse.c`, `loop()` once per tick", own, true},
        Case{"an empty `loop()`", "static void loop(void) {}"},
        Case{"`delay(60000);`", "static void loop(void) { delay(60000); }"},
        Case{"`while (!received);`", "static void loop(void) { while (!received); }"},
        Case{"`while (kilo_ticks < t);`", "static void loop(void) { while (kilo_ticks < 1000000); }"},
        Case{"`while (!received) ++n;`", "static void loop(void) { while (!received) ++sink; }"},
        Case{"computes without end",
             "static void loop(void) { for (;;) { sink = sink * 3 + 1; set_color(sink); } }"}}) {
    if (count > 2 && std::string(one.name).find(words[2]) == std::string::npos) continue;
    measure(one,
            one.name == std::string("computes without end") || one.name == std::string("`while (!received) ++n;`")
                ? std::min(robots, 100u)
                : robots,
            rounds, folder);
  }
  fs::remove_all(folder);
  return 0;
}
