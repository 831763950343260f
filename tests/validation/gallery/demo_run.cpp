#include "tests/validation/gallery/demo_run.hpp"

#include <fmt/format.h>

#include <cmath>
#include <deque>

#include "clients/recorder/reader.hpp"
#include "core/base/error.hpp"
#include "core/experiment/load.hpp"
#include "core/os/files.hpp"
#include "tests/validation/runs.hpp"

namespace kilotwin::validation {
namespace {

namespace fs = std::filesystem;

void add_events(const proto::EventRecord& event, double time_s, DemoRun& run) {
  for (int n = 0; n < event.robot_size(); ++n) {
    const std::size_t robot = event.robot(n);
    switch (event.kind()) {
      case proto::LED: run.led_changes[robot].push_back({time_s, event.value(n)}); break;
      case proto::SENT: ++run.sent[robot]; break;
      case proto::RECEIVED: ++run.received[robot]; break;
      default: break;
    }
  }
}

void add_values(const proto::VariableRecord& record, const std::string& name, double time_s, DemoRun& run) {
  auto& series = run.variables[name];
  if (series.empty() || series.back().first != time_s)
    series.push_back({time_s, std::vector<double>(run.sent.size(), std::nan(""))});
  for (int n = 0; n < record.robot_size(); ++n) {
    series.back().second[record.robot(n)] =
        record.integer_size() > 0 ? static_cast<double>(record.integer(n)) : record.number(n);
  }
}

DemoRun read_demo(const fs::path& file) {
  DemoRun run;
  recorder::Reader reader(file);
  const std::size_t robots = reader.header().robots();
  run.led_changes.resize(robots);
  run.sent.resize(robots);
  run.received.resize(robots);
  const auto seconds = [&](std::int64_t tick) { return reader.tick_length().seconds_at(Tick{tick}); };
  while (const proto::Record* record = reader.next()) {
    if (record->has_state()) {
      const proto::StateRecord& state = record->state();
      run.time_s.push_back(seconds(state.tick()));
      run.x_mm.emplace_back(state.x_mm().begin(), state.x_mm().end());
      run.y_mm.emplace_back(state.y_mm().begin(), state.y_mm().end());
      run.led.assign(state.led().begin(), state.led().end());
    } else if (record->has_event()) {
      add_events(record->event(), seconds(record->event().tick()), run);
    } else if (record->has_variable()) {
      const proto::VariableRecord& variable = record->variable();
      add_values(variable, reader.header().variable(static_cast<int>(variable.variable())).name(),
                 seconds(variable.tick()), run);
    }
  }
  if (run.time_s.empty()) throw RunError(fmt::format("{} holds no state", file.string()));
  run.duration_s = run.time_s.back();
  return run;
}

}  // namespace

double DemoRun::distance_mm(std::size_t state, std::size_t a, std::size_t b) const {
  return std::hypot(x_mm[state][a] - x_mm[state][b], y_mm[state][a] - y_mm[state][b]);
}

const std::vector<double>& DemoRun::values(const std::string& variable) const {
  const auto found = variables.find(variable);
  if (found == variables.end() || found->second.empty())
    throw RunError(fmt::format("the recording holds no variable {}", variable));
  return found->second.back().second;
}

std::vector<int> DemoRun::hops_from(std::size_t robot, std::size_t state) const {
  std::vector<int> hops(robots(), -1);
  hops[robot] = 0;
  std::deque<std::size_t> next{robot};
  while (!next.empty()) {
    const std::size_t from = next.front();
    next.pop_front();
    for (std::size_t to = 0; to < hops.size(); ++to) {
      if (hops[to] >= 0 || distance_mm(state, from, to) > range_mm) continue;
      hops[to] = hops[from] + 1;
      next.push_back(to);
    }
  }
  return hops;
}

DemoRun run_demo(const DemoSettings& settings, const std::string& name, const std::vector<std::string>& words,
                 const std::string& picture) {
  static int runs = 0;
  const fs::path out = settings.scratch / fmt::format("{}-{}", name, ++runs), log = out.string() + ".log";
  std::vector<std::string> all{"timeout", "300",   settings.kilotwin, "run", settings.folder / (name + ".txtpb"),
                               "--mode",  "local", "--threads",       "1",   "--out",
                               out};
  all.insert(all.end(), words.begin(), words.end());
  if (!run_quietly(all, log))
    throw RunError(fmt::format("kilotwin run {} failed; it said: {}", name, os::read_file(log)));
  DemoRun run = read_demo(out / "recording.ktrec");
  run.range_mm = load_experiment(out / "experiment.txtpb").experiment.radio().range_mm();
  if (!picture.empty() && !settings.pictures.empty()) {
    fs::create_directories(settings.pictures);
    fs::copy_file(out / "picture.svg", settings.pictures / (picture + ".svg"),
                  fs::copy_options::overwrite_existing);
  }
  fs::remove_all(out);
  return run;
}

}  // namespace kilotwin::validation
