#include "clients/cli/run_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <filesystem>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "clients/cli/prepare.hpp"
#include "clients/cli/shell_words.hpp"
#include "clients/recorder/observables.hpp"
#include "clients/recorder/reader.hpp"
#include "clients/recorder/summary.hpp"
#include "clients/recorder/view.hpp"
#include "clients/report/html.hpp"
#include "clients/report/plot.hpp"
#include "clients/report/templates.hpp"
#include "core/base/say.hpp"
#include "core/os/files.hpp"
#include "core/plan/effect_settings.hpp"
#include "core/plan/motion_settings.hpp"
#include "core/plan/physics_settings.hpp"
#include "core/plan/plan.hpp"
#include "core/plan/radio_settings.hpp"
#include "core/plan/senses_settings.hpp"

namespace kilotwin::cli {
namespace {

namespace fs = std::filesystem;
using html::Data;
using recorder::Summary;

/// Points of a curve on the page; of longer ones every n-th is shown.
constexpr std::size_t kMostPoints = 600;
/// Of a recorded state per robot, at most.
constexpr std::uint64_t kBytesPerRobotState = 26;
/// Two beside each other fill the page.
constexpr int kCurveWidth_px = 480, kCurveHeight_px = 300;
/// Of a larger picture, as of 100,000 robots, the page has a link.
constexpr std::uintmax_t kLargestPicture_bytes = 4'000'000;
/// Failed robots that the page lists.
constexpr std::size_t kMostFailures = 50;

using Facts = std::vector<std::pair<std::string, std::string>>;

Data list_of(const Facts& facts, const char* name = "fact", const char* value = "value") {
  Data list{Data::type::list};
  for (const auto& [of, text] : facts) {
    Data one{Data::type::object};
    one.set(name, of);
    one.set(value, text);
    list << one;
  }
  return list;
}

/// Three significant digits, and all digits before the point.
std::string figure(double value) {
  return value >= 999.5 ? fmt::format("{:.0f}", value) : fmt::format("{:.3g}", value);
}
std::string seconds(double s) { return figure(s) + " s"; }
std::string milliseconds(double s) { return figure(s * 1e3) + " ms"; }
/// "1 robot", "2 robots", "no robot".
std::string counted(std::uint64_t count, const char* noun) {
  return count == 0 ? fmt::format("no {}", noun) : fmt::format("{} {}{}", count, noun, count == 1 ? "" : "s");
}

/// "20 with disperse.c, 4 real ones".
std::string robots_in_words(const RunPlan& plan) {
  std::map<std::string, std::uint32_t> counts;
  for (std::uint32_t robot = 0; robot < plan.robots(); ++robot) {
    const std::uint32_t program = plan.program_of(robot);
    const std::string with =
        program == kNoProgram ? "" : " with " + fs::path(plan.programs()[program].path).filename().string();
    ++counts[(plan.tracked(robot) ? "real" : "simulated") + with];
  }
  std::string text;
  for (const auto& [kind, count] : counts) text += fmt::format("{}{} {}", text.empty() ? "" : ", ", count, kind);
  return text.empty() ? "none" : text;
}

Facts experiment_facts(const RunPlan& plan) {
  Facts facts{{"robots", robots_in_words(plan)},
              {"arena", plan.world.arena.described()},
              {"duration", seconds(plan.duration_s)},
              {"seed", std::to_string(plan.seed())}};
  if (!plan.world.obstacles.empty()) facts.emplace_back("obstacles", std::to_string(plan.world.obstacles.size()));
  if (plan.movables() > 0) facts.emplace_back("movable bodies", std::to_string(plan.movables()));
  return facts;
}

std::string radio_in_words(const RadioSettings& radio) {
  switch (radio.model) {
    case RadioSettings::Model::kPropagation: return "propagation, strength per pair";
    case RadioSettings::Model::kDisc: return fmt::format("disc of radius {:g} mm", radio.range_mm);
    case RadioSettings::Model::kSimple: return "of the ARGoS paper";
  }
  return "";
}

std::string physics_in_words(PhysicsSettings::Engine engine) {
  switch (engine) {
    case PhysicsSettings::Engine::kPlanar: return "planar, with contact";
    case PhysicsSettings::Engine::kKinematic: return "kinematic, without contact";
    case PhysicsSettings::Engine::kOde: return "rigid bodies in space (ODE)";
  }
  return "";
}

Facts model_facts(const RunPlan& plan) {
  Facts facts{{"physics", physics_in_words(plan.physics_settings().engine)},
              {"motion noise", plan.motion_settings().noise ? "on" : "off"},
              {"effects", std::to_string(plan.effects().size())},
              {"radio", radio_in_words(plan.radio_settings())}};
  if (plan.light_settings()) facts.emplace_back("light", "yes");
  if (plan.battery_settings()) facts.emplace_back("batteries", "yes");
  if (plan.temperature_settings()) facts.emplace_back("temperature", "yes");
  return facts;
}

Facts run_facts(const RunPlan& plan, const Summary& s) {
  Facts facts{{"mode", s.mode},
              {"tick", milliseconds(plan.tick_length.seconds())},
              {"states", fmt::format("every {:g} s", plan.recording_settings().every_s)},
              {"wall time", fmt::format("{} after {} to start", seconds(s.wall_s), seconds(s.start_s))},
              {"speed", figure(s.realtime_factor()) + " times real time"}};
  if (s.mode == "federated") {
    facts.emplace(facts.begin() + 1, "services",
                  fmt::format("{}x{} partitions, {}", s.partition_columns, s.partition_rows,
                              counted(s.hosts, "behaviours host")));
  }
  if (s.paced) {
    facts.emplace_back("pace", fmt::format("{:g}; {} ticks late, {} at most", plan.pace, s.lateness.late_ticks,
                                           milliseconds(s.lateness.worst_s)));
  }
  if (s.resumed_from_tick > 0) facts.emplace_back("resumed from", fmt::format("tick {}", s.resumed_from_tick));
  if (s.recoveries > 0)
    facts.emplace_back("recovered",
                       fmt::format("{} times, last from tick {}", s.recoveries, s.recovered_from_tick));
  return facts;
}

Data settings_of(const RunPlan& plan, const Summary& s) {
  Data groups{Data::type::list};
  for (const auto& [title, facts] : {std::pair<const char*, Facts>{"Experiment", experiment_facts(plan)},
                                     {"Models", model_facts(plan)},
                                     {"Run", run_facts(plan, s)}}) {
    Data group{Data::type::object};
    group.set("title", title);
    group.set("facts", list_of(facts));
    groups << group;
  }
  return groups;
}

void add_verdict(Data& page, const RunPlan& plan, const Summary& s) {
  std::string outcome = "Done", rest = fmt::format("{} simulated", seconds(s.simulated_s));
  if (!s.failure.empty()) {
    outcome = fmt::format("Failed at {} of {}:", recorder::time_text(s.simulated_s),
                          recorder::time_text(plan.duration_s));
    rest = s.failure;
  } else if (s.ticks < plan.last_tick.count()) {
    outcome = "Ended early:";
    rest += fmt::format(" of {}", seconds(plan.duration_s));
  } else {
    outcome += ":";
  }
  rest += fmt::format("; {} of {} failed; state hash {:016x}", counted(s.robots_failed, "robot"),
                      s.robots + s.cells, s.state_hash);
  page.set("outcome", outcome);
  page.set("verdict", rest);
  if (!s.failure.empty() || s.robots_failed > 0) page.set("bad", Data{Data::type::bool_true});
}

Plot curve(const std::string& name, const std::string& unit, const std::vector<double>& time_s,
           const std::vector<double>& value) {
  Plot plot;
  plot.x_name = "time";
  plot.x_unit = "s";
  plot.y_name = name;
  plot.y_unit = unit;
  plot.width_px = kCurveWidth_px;
  plot.height_px = kCurveHeight_px;
  PlotSeries& series = plot.series.emplace_back();
  const std::size_t step = (time_s.size() + kMostPoints - 1) / kMostPoints;
  for (std::size_t i = 0; i < time_s.size(); i += step) {
    series.x.push_back(time_s[i]);
    series.y.push_back(value[i]);
  }
  series.points = false;
  return plot;
}

/// Curves of all states, or of every n-th one so that at most `most_robot_states` are read. Then `step` > 1.
recorder::ObservableCurves observe_some(const recorder::RunDirectory& directory, std::uint64_t most_robot_states,
                                        std::size_t& step) {
  recorder::Reader recording(directory.recording());
  step = 1;
  if (fs::file_size(directory.recording()) / kBytesPerRobotState <= most_robot_states)
    return recorder::observe(recording);
  recorder::StateIndex index(directory.recording());
  static_cast<void>(index.update());
  const std::uint64_t robot_states = index.states().size() * recording.header().robots();
  step = static_cast<std::size_t>((robot_states + most_robot_states - 1) / most_robot_states);
  return step <= 1 ? recorder::observe(recording) : recorder::observe_every(recording, index, step);
}

/// Curves over time, or why there are none.
void add_curves(Data& page, const recorder::RunDirectory& directory, std::uint64_t most_robot_states) {
  if (!Gnuplot::installed()) {
    page.set("curves_note", "No curves: gnuplot is not installed. scripts/setup installs it.");
    return;
  }
  std::size_t step = 1;
  const recorder::ObservableCurves curves = observe_some(directory, most_robot_states, step);
  if (step > 1)
    page.set("curves_note",
             fmt::format("The recording is long: the curves are of one state in {}. kilotwin export RUN "
                         "--report FILE draws them of all states.",
                         step));
  if (curves.time_s.size() < 2) {
    page.set("curves_note", "No curves: the recording has fewer than two states.");
    return;
  }
  Gnuplot gnuplot;
  std::vector<std::string> captions;
  const auto add = [&](const Plot& plot, const std::string& caption) {
    add_plot(gnuplot, plot);
    captions.push_back(caption);
  };
  for (const recorder::OwnCurve& own : curves.own)
    add(curve(own.name, "", curves.time_s, own.value), own.name + ", an observable of the experiment");
  add(curve("mean square displacement", "mm²", curves.time_s, curves.of(recorder::Observable::kMsd)),
      "Mean square displacement from the first state");
  Data figures{Data::type::list};
  const std::vector<Gnuplot::Drawn> drawn = gnuplot.draw();
  for (std::size_t i = 0; i < drawn.size(); ++i) {
    Data figure{Data::type::object};
    figure.set("image", drawn[i].error.empty() ? html::image(drawn[i].svg, captions[i])
                                               : std::string("<p>This plot could not be drawn.</p>"));
    figure.set("caption", captions[i]);
    figures << figure;
  }
  page.set("figures", figures);
}

void add_failures(Data& page, const Summary& s) {
  if (s.failures.empty()) return;
  const std::size_t shown = std::min(s.failures.size(), kMostFailures);
  html::Table table({"robot", "time", "what happened, and where"});
  for (std::size_t i = 0; i < shown; ++i) {
    table.row({std::to_string(s.failures[i].robot), recorder::time_text(s.failures[i].time_s),
               html::escaped(s.failures[i].text)});
  }
  Data failures{Data::type::object};
  failures.set("lead", fmt::format("{} of {} failed{}.", counted(s.robots_failed, "robot"), s.robots + s.cells,
                                   shown < s.robots_failed
                                       ? fmt::format("; the first {} are listed, more are in summary.json", shown)
                                       : ""));
  failures.set("table", table.text());
  page.set("failures", failures);
}

void add_messages(Data& page, const Summary& s) {
  if (s.messages.attempted == 0 && s.messages.received == 0) {
    page.set("messages", "No robot tried to send.");
    return;
  }
  const std::uint64_t heard = s.messages.received + s.messages.collided;
  page.set("messages",
           fmt::format(
               "{} sent of {} attempted. {} received. {} receptions lost to collisions ({:.3g} %).",
               s.messages.sent, s.messages.attempted, s.messages.received, s.messages.collided,
               heard == 0 ? 0.0 : 100.0 * static_cast<double>(s.messages.collided) / static_cast<double>(heard)));
  if (s.per_robot.robots == 0) return;
  html::Table table({"per robot", "least", "mean", "most"});
  for (const auto& [name, spread] :
       {std::pair<const char*, Summary::PerRobot::Spread>{"attempted", s.per_robot.attempted},
        {"sent", s.per_robot.sent},
        {"received", s.per_robot.received},
        {"lost to collisions", s.per_robot.collided},
        {"given up, because another was sending", s.per_robot.backed_off}}) {
    table.row({name, std::to_string(spread.least), figure(static_cast<double>(spread.sum) / s.per_robot.robots),
               std::to_string(spread.most)});
  }
  page.set("messages_table", table.text());
}

void add_station(Data& page, const Summary& s) {
  if (s.station.plugins.empty()) return;
  const StationTotals& t = s.station;
  Facts facts;
  for (const StationTotals::Plugin& plugin : t.plugins)
    facts.emplace_back("plugin " + plugin.name, plugin.failure.empty() ? "no failure" : plugin.failure);
  facts.emplace_back("overhead packets", std::to_string(t.packets));
  facts.emplace_back("messages to single robots", std::to_string(t.robot_messages));
  facts.emplace_back("broadcasts", std::to_string(t.broadcasts));
  facts.emplace_back("never sent", fmt::format("{} replaced by newer ones, {} too wide", t.replaced, t.too_wide));
  facts.emplace_back("queueing delay", fmt::format("mean {}, 99 % below {}, at most {}", seconds(t.mean_delay_s),
                                                   seconds(t.p99_delay_s), seconds(t.max_delay_s)));
  Data station{Data::type::object};
  station.set("facts", list_of(facts));
  page.set("station", station);
}

void add_tracking(Data& page, const Summary& s) {
  if (!s.tracked) return;
  const TrackingTotals& t = s.tracking;
  Facts facts{{"membership", fmt::format("{} joined, {} left, {} lost", t.joined, t.left, t.lost)},
              {"from arrival to effect",
               fmt::format("{} (p50), {} (p99)", milliseconds(t.effect_p50_s), milliseconds(t.effect_p99_s))},
              {"restarted estimates", std::to_string(t.jumps)},
              {"messages heard of real robots", std::to_string(t.heard)}};
  if (!s.monitor.empty()) {
    const auto monitor = nlohmann::json::parse(s.monitor);
    facts.emplace_back("monitor", fmt::format("{} alarms, in alarms.txt",
                                              monitor.value("alarms", nlohmann::json::array()).size()));
  }
  html::Table table({"tracker", "frames", "missing", "refused", "restarts", "clock offset", "exposure to sending"});
  for (const TrackerReport& one : t.trackers) {
    table.row({html::escaped(one.source), std::to_string(one.frames), std::to_string(one.dropped),
               std::to_string(one.refused), std::to_string(one.restarts), seconds(one.offset_s),
               fmt::format("{} (p50), {} (p99)", milliseconds(one.own_p50_s), milliseconds(one.own_p99_s))});
  }
  Data tracking{Data::type::object};
  tracking.set("facts", list_of(facts));
  tracking.set("table", t.trackers.empty() ? "" : table.text());
  page.set("tracking", tracking);
}

/// Adds the table of times that federates computed, published and waited.
void add_federates(Data& page, const Summary& s) {
  if (s.federates.empty()) return;
  html::Table table({"federate", "computes", "publishes", "waits", "share of waiting"});
  const auto waiting = [](const FederateTime& one) {
    const double all_s = one.step_s + one.exchange_s + one.wait_s;
    return all_s > 0 ? one.wait_s / all_s : 0;
  };
  const FederateTime* busiest = s.federates.data();
  for (const FederateTime& one : s.federates) {
    if (waiting(one) < waiting(*busiest)) busiest = &one;
    table.row({html::escaped(one.name), seconds(one.step_s), seconds(one.exchange_s), seconds(one.wait_s),
               fmt::format("{:.0f} %", 100 * waiting(one))});
  }
  // The rule of the page, clients/view/page/work.ts.
  const bool held_up = s.federates.size() > 1 && waiting(*busiest) < 0.5;
  const std::string verdict = held_up ? fmt::format("{} held up the others: it waited for {:.0f} % of its time.",
                                                    busiest->name, 100 * waiting(*busiest))
                                      : "Nobody held up the run: all federates waited most of their time.";
  Data federates{Data::type::object};
  federates.set("lead", fmt::format("Wall time per federate. {}{}", verdict,
                                    s.paced ? " They waited for the pace too." : ""));
  federates.set("table", table.text());
  page.set("federates", federates);
}

void add_costs(Data& page, const Summary& s) {
  const Summary::Cost& c = s.cost_ns_per_robot_tick;
  std::vector<std::pair<const char*, double>> parts{{"behaviours", c.behaviours}, {"physics", c.physics},
                                                    {"radio", c.radio},           {"station", c.station},
                                                    {"exchange", c.exchange},     {"recording", c.recording}};
  std::stable_sort(parts.begin(), parts.end(), [](const auto& a, const auto& b) { return a.second > b.second; });
  page.set("cost", fmt::format("CPU time per robot and tick: {} ns. In total {} of CPU time, {} MiB of memory.",
                               figure(c.total()), seconds(s.cpu_s), figure(s.peak_memory_mib)));
  std::vector<html::Bar> bars;
  for (const auto& [subject, ns] : parts) {
    if (ns > 0)
      bars.push_back({subject, "after", ns, fmt::format("{} ns, {:.0f} %", figure(ns), 100 * ns / c.total())});
  }
  page.set("costs", html::bars(bars, c.total()));
  add_federates(page, s);
}

Facts next_commands(const recorder::RunDirectory& directory, const RunPlan& plan, const Summary& s) {
  const auto in = [&](const char* file) { return shell_word((directory.path() / file).string()); };
  const std::string run = shell_word(directory.path().string());
  Facts next;
  if (!s.failure.empty() && fs::exists(directory.path() / "checkpoints"))
    next.emplace_back("Continue from the last checkpoint",
                      fmt::format("kilotwin run {} --resume {}", in("experiment.txtpb"), run));
  if (!s.failures.empty() && !plan.firmware(s.failures[0].robot))
    next.emplace_back("Debug the first robot that failed",
                      fmt::format("kilotwin debug {} --robot {}", in("experiment.txtpb"), s.failures[0].robot));
  next.emplace_back("Watch it in a browser", "kilotwin view " + run);
  next.emplace_back("Make a table of all tracks", fmt::format("kilotwin export {} --trajectories tracks.csv", run));
  next.emplace_back("Make a movie", fmt::format("kilotwin movie {} -o run.mp4", run));
  next.emplace_back("Verify every tick", fmt::format("kilotwin replay {} --verify", run));
  next.emplace_back("Ask how much is chance",
                    fmt::format("kilotwin sweep {} --seeds 1..20", in("experiment.txtpb")));
  return next;
}

Facts provenance_facts(const Summary& s) {
  std::string words;
  for (const std::string& word : s.provenance.command_line) words += (words.empty() ? "" : " ") + shell_word(word);
  return {{"command line", words},
          {"date", s.provenance.date},
          {"version", s.provenance.build},
          {"machine", fmt::format("{}, {} cores", s.provenance.host, s.provenance.cores)}};
}

/// `most_robot_states`: of longer recordings its curves are of every n-th state.
std::string page_of(const recorder::RunDirectory& directory, std::uint64_t most_robot_states) {
  const Summary s = recorder::read_summary(directory.summary());
  const RunPlan plan(directory.read_manifest());
  Data page{Data::type::object};
  page.set("name", s.name);
  page.set("date", s.provenance.date);
  add_verdict(page, plan, s);
  if (fs::exists(directory.picture())) {
    if (fs::file_size(directory.picture()) <= kLargestPicture_bytes)
      page.set("picture", html::image(os::read_file(directory.picture()), "start, paths and end of all robots",
                                      html::Ground::kOwn));
    else
      page.set("large_picture", directory.picture().filename().string());
  }
  if (fs::exists(directory.animation())) page.set("animation", directory.animation().filename().string());
  page.set("settings", settings_of(plan, s));
  add_curves(page, directory, most_robot_states);
  add_failures(page, s);
  add_messages(page, s);
  add_station(page, s);
  add_tracking(page, s);
  add_costs(page, s);
  page.set("next", list_of(next_commands(directory, plan, s), "what", "command"));
  page.set("facts", list_of(provenance_facts(s)));
  page.set("experiment", os::read_file(directory.experiment()));
  return html::page("Kilotwin: run of " + s.name, html::rendered(html::templates::kRun, page));
}

}  // namespace

std::string run_report(const recorder::RunDirectory& directory) {
  return page_of(directory, std::numeric_limits<std::uint64_t>::max());
}

void write_run_report(const recorder::RunDirectory& directory, std::uint64_t most_robot_states) {
  if (!fs::exists(directory.summary())) return;
  try {
    os::write_file(directory.report(), page_of(directory, most_robot_states));
  } catch (const std::exception& error) {
    warn(fmt::format("kilotwin: no report.html: {}", error.what()));
  }
}

}  // namespace kilotwin::cli
