#include "tests/validation/programs/pair.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <regex>
#include <sstream>

#include "clients/recorder/reader.hpp"
#include "core/os/files.hpp"
#include "tests/validation/runs.hpp"

namespace kilotwin::validation {
namespace {

namespace fs = std::filesystem;

std::string experiment(const PairSettings& settings, const fs::path& program, bool avr, int seed) {
  return fmt::format(
      "duration_s: {} seed: {} arena {{ width_mm: 4000 height_mm: 4000 }} motion {{ noise: false }}\n"
      "radio {{ range_mm: 120 }} light {{ {} }}\n"
      "recording {{ event: LED event: MOTION event: SENT event: RECEIVED }}\n"
      "robots {{ count: {} behaviour: \"{}\" {} layout {{ grid {{ pitch_mm: 60 }} }} }}\n",
      settings.duration_s, seed, settings.light, settings.robots, fs::absolute(program).string(),
      avr ? "avr: true" : "", settings.robots);
}

/// The first line of a log with a match of `form`.
std::string line_with(const std::string& log, const std::regex& form) {
  std::istringstream lines(log);
  for (std::string line; std::getline(lines, line);) {
    if (std::regex_search(line, form)) return line;
  }
  return "";
}

double brightness_of(std::uint32_t led) {
  return static_cast<double>((led & 3) + (led >> 2 & 3) + (led >> 4 & 3)) / 9;
}

void read_run(const fs::path& file, int robots, Outcome& outcome) {
  const std::size_t first = outcome.path_mm.size(), count = static_cast<std::size_t>(robots);
  for (auto* column : {&outcome.path_mm, &outcome.distance_mm, &outcome.brightness, &outcome.colours, &outcome.sent,
                       &outcome.received})
    column->resize(first + count, 0);
  outcome.motors.resize(first + count);
  outcome.led.resize(first + count);
  std::vector<double> x, y, first_x, first_y;
  recorder::Reader reader(file);
  while (const proto::Record* record = reader.next()) {
    if (record->has_state()) {
      const proto::StateRecord& state = record->state();
      outcome.last_tick = std::max(outcome.last_tick, state.tick());
      for (std::size_t i = 0; i < count && !x.empty(); ++i) {
        const double dx = state.x_mm(static_cast<int>(i)) - x[i], dy = state.y_mm(static_cast<int>(i)) - y[i];
        outcome.path_mm[first + i] += std::sqrt(dx * dx + dy * dy);
      }
      x.assign(state.x_mm().begin(), state.x_mm().end());
      y.assign(state.y_mm().begin(), state.y_mm().end());
      if (first_x.empty()) first_x = x, first_y = y;
    }
    if (!record->has_event()) continue;
    const proto::EventRecord& event = record->event();
    for (int n = 0; n < event.robot_size(); ++n) {
      const std::size_t i = first + event.robot(n);
      switch (event.kind()) {
        case proto::LED: outcome.led[i].push_back({event.tick(), event.value(n)}); break;
        case proto::MOTION: {
          // Full duty of both motors is a spin-up, which may lie across the end of a tick.
          constexpr std::uint32_t kSpinUp = 0xffff;
          auto& motors = outcome.motors[i];
          if (event.value(n) != kSpinUp && (motors.empty() || motors.back().value != event.value(n)))
            motors.push_back({event.tick(), event.value(n)});
          break;
        }
        case proto::SENT: ++outcome.sent[i]; break;
        case proto::RECEIVED: ++outcome.received[i]; break;
        default: break;
      }
    }
  }
  for (std::size_t i = 0; i < count; ++i) {
    outcome.distance_mm[first + i] = std::hypot(x[i] - first_x[i], y[i] - first_y[i]);
    const auto& led = outcome.led[first + i];
    outcome.colours[first + i] = static_cast<double>(led.size());
    for (std::size_t n = 0; n < led.size(); ++n) {
      const std::int64_t until = n + 1 < led.size() ? led[n + 1].tick : outcome.last_tick;
      outcome.brightness[first + i] += brightness_of(led[n].value) * static_cast<double>(until - led[n].tick) /
                                       static_cast<double>(outcome.last_tick);
    }
  }
}

}  // namespace

void run_program(const PairSettings& settings, const fs::path& program, bool avr, int first_seed, int last_seed,
                 Outcome& outcome) {
  static const std::regex kWarning("robot [0-9]+ at "), kError("error");
  outcome.robots = static_cast<std::size_t>(settings.robots);
  for (int seed = first_seed; seed <= last_seed; ++seed) {
    const fs::path base = settings.scratch / fmt::format("{}-{}-{}", program.stem().string(), avr, seed);
    const fs::path file = base.string() + ".txtpb", log = base.string() + ".log";
    std::ofstream(file) << experiment(settings, program, avr, seed);
    const bool ran = run_quietly({"timeout", "600", settings.kilotwin, "run", file.string(), "--mode", "local",
                                  "--threads", "1", "--force", "--out", base.string()},
                                 log);
    const std::string said = os::read_file(log);
    if (outcome.warning.empty()) outcome.warning = line_with(said, kWarning);
    if (!ran) {
      outcome.refusal = line_with(said, kError);
      if (outcome.refusal.empty()) outcome.refusal = said.substr(0, said.find('\n'));
      if (outcome.refusal.empty()) outcome.refusal = "it took more than ten minutes";
      return;
    }
    read_run(base / "recording.ktrec", settings.robots, outcome);
    fs::remove_all(base);
  }
}

}  // namespace kilotwin::validation
