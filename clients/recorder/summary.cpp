#include "clients/recorder/summary.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "clients/recorder/film.hpp"
#include "core/base/error.hpp"
#include "core/os/files.hpp"

namespace kilotwin::recorder {
namespace {

using Json = nlohmann::ordered_json;

std::uint64_t parsed_hash(const std::string& digits) {
  std::uint64_t value = 0;
  const char* const last = digits.data() + digits.size();
  const auto [end, error] = std::from_chars(digits.data(), last, value, 16);
  if (digits.size() != 16 || error != std::errc{} || end != last)
    throw std::invalid_argument("state_hash has 16 hex digits");
  return value;
}

std::pair<std::uint32_t, std::uint32_t> parsed_partitions(const std::string& text) {
  std::uint32_t columns = 0, rows = 0;
  const char* const last = text.data() + text.size();
  const auto first = std::from_chars(text.data(), last, columns);
  if (first.ec == std::errc{} && first.ptr != last && *first.ptr == 'x') {
    const auto second = std::from_chars(first.ptr + 1, last, rows);
    if (second.ec == std::errc{} && second.ptr == last) return {columns, rows};
  }
  throw std::invalid_argument("partitions is COLUMNSxROWS");
}

/// "1 robot", "2 robots", "no robot".
std::string counted(std::uint64_t count, std::string_view noun) {
  if (count == 0) return fmt::format("no {}", noun);
  return fmt::format("{} {}{}", count, noun, count == 1 ? "" : "s");
}

/// Three significant digits, never in exponential form.
std::string short_number(double value) {
  const int decimals = value >= 99.95 ? 0 : value >= 9.995 ? 1 : 2;
  return fmt::format("{:.{}f}", value, decimals);
}

std::string percentage(std::uint64_t part, std::uint64_t whole) {
  return fmt::format("{:.3g} %", whole == 0 ? 0.0 : 100.0 * static_cast<double>(part) / static_cast<double>(whole));
}

Json spread_json(const Summary::PerRobot::Spread& spread, std::uint32_t robots) {
  return Json{{"least", spread.least},
              {"mean", robots == 0 ? 0.0 : static_cast<double>(spread.sum) / robots},
              {"most", spread.most}};
}

Json station_json(const StationTotals& station) {
  Json plugins = Json::array();
  for (const StationTotals::Plugin& plugin : station.plugins)
    plugins.push_back(Json{{"name", plugin.name}, {"failure", plugin.failure}});
  const double rate = station.sending_s > 0 ? static_cast<double>(station.robot_messages) / station.sending_s : 0;
  return Json{{"packets", station.packets},
              {"robot_messages", station.robot_messages},
              {"broadcasts", station.broadcasts},
              {"robot_messages_per_s", rate},
              {"replaced", station.replaced},
              {"too_wide", station.too_wide},
              {"queueing_delay_s",
               Json{{"mean", station.mean_delay_s}, {"p99", station.p99_delay_s}, {"max", station.max_delay_s}}},
              {"plugins", plugins}};
}

}  // namespace

void Summary::PerRobot::add(const RadioCount& radio) {
  const auto widen = [this](Spread& spread, std::uint32_t count) {
    spread.least = robots == 0 ? count : std::min(spread.least, count);
    spread.most = std::max(spread.most, count);
    spread.sum += count;
  };
  widen(attempted, radio.attempted);
  widen(sent, radio.sent);
  widen(received, radio.received);
  widen(collided, radio.collided);
  widen(backed_off, radio.backed_off);
  ++robots;
}

double Summary::realtime_factor() const {
  const std::int64_t from = std::max(resumed_from_tick, recovered_from_tick);
  if (!(wall_s > 0) || ticks <= from) return 0;
  return simulated_s * static_cast<double>(ticks - from) / static_cast<double>(ticks) / wall_s;
}

namespace {

Json failures_json(const std::vector<Summary::Failure>& failures) {
  Json json = Json::array();
  for (std::size_t i = 0; i < std::min(failures.size(), Summary::kMostFailures); ++i) {
    json.push_back(Json{{"robot", failures[i].robot}, {"time_s", failures[i].time_s}, {"what", failures[i].text}});
  }
  return json;
}

Json tracking_json(const TrackingTotals& t) {
  Json trackers = Json::array();
  for (const TrackerReport& tracker : t.trackers) {
    trackers.push_back(
        Json{{"source", tracker.source},
             {"frames", tracker.frames},
             {"dropped", tracker.dropped},
             {"refused", tracker.refused},
             {"restarts", tracker.restarts},
             {"offset_s", tracker.offset_s},
             {"drift_ppm", tracker.drift_ppm},
             {"exposure_to_sent_ms", Json{{"p50", tracker.own_p50_s * 1e3}, {"p99", tracker.own_p99_s * 1e3}}},
             {"queueing_ms", Json{{"p50", tracker.way_p50_s * 1e3}, {"p99", tracker.way_p99_s * 1e3}}}});
  }
  const auto ms = [](double p50_s, double p99_s) { return Json{{"p50", p50_s * 1e3}, {"p99", p99_s * 1e3}}; };
  return Json{{"exposure_to_effect_ms", ms(t.exposed_p50_s, t.exposed_p99_s)},
              {"arrival_to_effect_ms", ms(t.effect_p50_s, t.effect_p99_s)},
              {"arrival_to_publication_ms", ms(t.wait_p50_s, t.wait_p99_s)},
              {"publication_to_effect_ms", ms(t.step_p50_s, t.step_p99_s)},
              {"heard_messages", t.heard},
              {"joined", t.joined},
              {"left", t.left},
              {"lost", t.lost},
              {"jumps", t.jumps},
              {"bodies_without_space", t.bodies_without_space},
              {"trackers", trackers}};
}

Json federates_json(const std::vector<FederateTime>& federates) {
  Json json = Json::array();
  for (const FederateTime& one : federates)
    json.push_back(
        Json{{"name", one.name}, {"step_s", one.step_s}, {"exchange_s", one.exchange_s}, {"wait_s", one.wait_s}});
  return json;
}

std::vector<FederateTime> federates_of(const Json& json) {
  std::vector<FederateTime> federates;
  for (const Json& one : json) {
    federates.push_back({one.at("name").get<std::string>(), one.at("step_s").get<double>(),
                         one.at("exchange_s").get<double>(), one.at("wait_s").get<double>()});
  }
  return federates;
}

Summary::PerRobot per_robot_of(const Json& json, std::uint32_t robots) {
  const auto spread = [&](const char* name) {
    const Json one = json.value(name, Json::object());
    return Summary::PerRobot::Spread{one.value("least", 0u), one.value("most", 0u),
                                     static_cast<std::uint64_t>(std::llround(one.value("mean", 0.0) * robots))};
  };
  return {
      robots, spread("attempted"), spread("sent"), spread("received"), spread("collided"), spread("backed_off")};
}

std::vector<Summary::Failure> failures_of(const Json& json) {
  std::vector<Summary::Failure> failures;
  for (const Json& one : json) {
    failures.push_back(
        {one.at("robot").get<std::uint32_t>(), one.at("time_s").get<double>(), one.at("what").get<std::string>()});
  }
  return failures;
}

StationTotals station_of(const Json& json) {
  const Json delay = json.value("queueing_delay_s", Json::object());
  StationTotals station;
  station.packets = json.value("packets", std::uint64_t{0});
  station.robot_messages = json.value("robot_messages", std::uint64_t{0});
  station.broadcasts = json.value("broadcasts", std::uint64_t{0});
  station.replaced = json.value("replaced", std::uint64_t{0});
  station.too_wide = json.value("too_wide", std::uint64_t{0});
  if (const double rate = json.value("robot_messages_per_s", 0.0); rate > 0)
    station.sending_s = static_cast<double>(station.robot_messages) / rate;
  station.mean_delay_s = delay.value("mean", 0.0);
  station.p99_delay_s = delay.value("p99", 0.0);
  station.max_delay_s = delay.value("max", 0.0);
  for (const Json& plugin : json.at("plugins"))
    station.plugins.push_back({plugin.at("name").get<std::string>(), plugin.at("failure").get<std::string>()});
  return station;
}

/// The percentiles {p50, p99} of a field in ms, as s.
std::pair<double, double> percentiles_s(const Json& json, const char* name) {
  const Json both = json.value(name, Json::object());
  return {both.value("p50", 0.0) / 1e3, both.value("p99", 0.0) / 1e3};
}

TrackingTotals tracking_of(const Json& json) {
  TrackingTotals t;
  std::tie(t.effect_p50_s, t.effect_p99_s) = percentiles_s(json, "arrival_to_effect_ms");
  std::tie(t.wait_p50_s, t.wait_p99_s) = percentiles_s(json, "arrival_to_publication_ms");
  std::tie(t.step_p50_s, t.step_p99_s) = percentiles_s(json, "publication_to_effect_ms");
  t.heard = json.value("heard_messages", std::uint64_t{0});
  t.joined = json.value("joined", std::uint64_t{0});
  t.left = json.value("left", std::uint64_t{0});
  t.lost = json.value("lost", std::uint64_t{0});
  t.jumps = json.value("jumps", std::uint64_t{0});
  t.bodies_without_space = json.value("bodies_without_space", std::uint64_t{0});
  for (const Json& one : json.value("trackers", Json::array())) {
    TrackerReport& tracker = t.trackers.emplace_back();
    tracker.source = one.value("source", "");
    tracker.frames = one.value("frames", std::uint64_t{0});
    tracker.dropped = one.value("dropped", std::uint64_t{0});
    tracker.refused = one.value("refused", std::uint64_t{0});
    tracker.restarts = one.value("restarts", 0u);
    tracker.offset_s = one.value("offset_s", 0.0);
    tracker.drift_ppm = one.value("drift_ppm", 0.0);
    std::tie(tracker.own_p50_s, tracker.own_p99_s) = percentiles_s(one, "exposure_to_sent_ms");
    std::tie(tracker.way_p50_s, tracker.way_p99_s) = percentiles_s(one, "queueing_ms");
  }
  return t;
}

/// Fields of summary.json beyond the contract, which may be missing.
void read_further_fields(const Json& json, Summary& s) {
  const Json none = Json::object();
  s.hosts = json.value("hosts", 1u);
  s.resumed_from_tick = json.value("resumed_from_tick", std::int64_t{0});
  s.recovered_from_tick = json.value("recovered_from_tick", std::int64_t{0});
  s.cpu_s = json.value("cpu_s", 0.0);
  s.peak_memory_mib = json.value("peak_memory_mib", 0.0);
  s.failure = json.value("failure", "");
  if (json.contains("messages_per_robot")) s.per_robot = per_robot_of(json.at("messages_per_robot"), s.robots);
  s.failures = failures_of(json.value("failures", Json::array()));
  if (const auto observables = json.find("observables"); observables != json.end()) {
    for (const auto& [name, value] : observables->items())
      s.observables.emplace_back(name, value.is_number() ? value.get<double>() : std::nan(""));
  }
  if (const auto station = json.find("station"); station != json.end()) s.station = station_of(*station);
  s.paced = json.contains("late_ticks");
  s.lateness.late_ticks = json.value("late_ticks", std::uint64_t{0});
  s.lateness.worst_s = json.value("worst_lateness_ms", 0.0) / 1e3;
  s.tracked = json.contains("tracking");
  if (s.tracked) s.tracking = tracking_of(json.at("tracking"));
  if (const auto monitor = json.find("monitor"); monitor != json.end()) s.monitor = monitor->dump();
  const Json moved = json.value("moved_mm", none);
  s.moved_mm = {moved.value("mean", 0.0), moved.value("max", 0.0)};
  const Json cost = json.value("cost_ns_per_robot_tick", none);
  s.cost_ns_per_robot_tick = {cost.value("behaviours", 0.0), cost.value("physics", 0.0),
                              cost.value("radio", 0.0),      cost.value("station", 0.0),
                              cost.value("exchange", 0.0),   cost.value("recording", 0.0)};
  if (const auto federates = json.find("federates"); federates != json.end())
    s.federates = federates_of(*federates);
  s.provenance = {json.value("version", ""), json.value("build", ""),
                  json.value("date", ""),    json.value("command_line", std::vector<std::string>{}),
                  json.value("host", ""),    json.value("cores", 0u)};
}

}  // namespace

void write_summary(const Summary& s, const std::filesystem::path& file) {
  Json json{
      {"name", s.name},
      {"seed", s.seed},
      {"mode", s.mode},
      {"partitions", fmt::format("{}x{}", s.partition_columns, s.partition_rows)},
      {"hosts", s.hosts},
      {"robots", s.robots},
      {"ticks", s.ticks},
      {"resumed_from_tick", s.resumed_from_tick},
      {"recovered_from_tick", s.recovered_from_tick},
      {"simulated_s", s.simulated_s},
      {"start_s", s.start_s},
      {"wall_s", s.wall_s},
      {"realtime_factor", s.realtime_factor()},
      {"cpu_s", s.cpu_s},
      {"peak_memory_mib", s.peak_memory_mib},
      {"state_hash", fmt::format("{:016x}", s.state_hash)},
      {"messages", Json{{"attempted", s.messages.attempted},
                        {"sent", s.messages.sent},
                        {"received", s.messages.received},
                        {"collided", s.messages.collided}}},
      {"messages_per_robot", Json{{"attempted", spread_json(s.per_robot.attempted, s.per_robot.robots)},
                                  {"sent", spread_json(s.per_robot.sent, s.per_robot.robots)},
                                  {"received", spread_json(s.per_robot.received, s.per_robot.robots)},
                                  {"collided", spread_json(s.per_robot.collided, s.per_robot.robots)},
                                  {"backed_off", spread_json(s.per_robot.backed_off, s.per_robot.robots)}}},
      {"robots_failed", s.robots_failed},
      {"failures", failures_json(s.failures)},
      {"recoveries", s.recoveries},
      {"moved_mm", Json{{"mean", s.moved_mm.mean}, {"max", s.moved_mm.max}}},
      {"cost_ns_per_robot_tick", Json{{"behaviours", s.cost_ns_per_robot_tick.behaviours},
                                      {"physics", s.cost_ns_per_robot_tick.physics},
                                      {"radio", s.cost_ns_per_robot_tick.radio},
                                      {"station", s.cost_ns_per_robot_tick.station},
                                      {"exchange", s.cost_ns_per_robot_tick.exchange},
                                      {"recording", s.cost_ns_per_robot_tick.recording}}},
      {"version", s.provenance.version},
      {"build", s.provenance.build},
      {"date", s.provenance.date},
      {"command_line", s.provenance.command_line},
      {"host", s.provenance.host},
      {"cores", s.provenance.cores},
  };
  if (!s.failure.empty()) json["failure"] = s.failure;
  for (const auto& [name, value] : s.observables) json["observables"][name] = value;
  if (!s.federates.empty()) json["federates"] = federates_json(s.federates);
  if (!s.station.plugins.empty()) json["station"] = station_json(s.station);
  if (s.paced) {
    json["late_ticks"] = s.lateness.late_ticks;
    json["worst_lateness_ms"] = s.lateness.worst_s * 1e3;
  }
  if (s.tracked) json["tracking"] = tracking_json(s.tracking);
  if (s.cells > 0) json["cells"] = s.cells;
  if (s.per_robot.robots == 0) json.erase("messages_per_robot");
  if (!s.monitor.empty()) json["monitor"] = Json::parse(s.monitor);
  os::write_file(file, json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
}

Summary read_summary(const std::filesystem::path& file) {
  const std::string text = os::read_file(file);
  try {
    const Json json = Json::parse(text);
    Summary s;
    json.at("name").get_to(s.name);
    json.at("seed").get_to(s.seed);
    json.at("mode").get_to(s.mode);
    std::tie(s.partition_columns, s.partition_rows) = parsed_partitions(json.at("partitions").get<std::string>());
    json.at("robots").get_to(s.robots);
    s.cells = json.value("cells", 0u);
    json.at("ticks").get_to(s.ticks);
    json.at("simulated_s").get_to(s.simulated_s);
    json.at("start_s").get_to(s.start_s);
    json.at("wall_s").get_to(s.wall_s);
    s.state_hash = parsed_hash(json.at("state_hash").get<std::string>());
    const Json& messages = json.at("messages");
    messages.at("attempted").get_to(s.messages.attempted);
    messages.at("sent").get_to(s.messages.sent);
    messages.at("received").get_to(s.messages.received);
    messages.at("collided").get_to(s.messages.collided);
    json.at("robots_failed").get_to(s.robots_failed);
    json.at("recoveries").get_to(s.recoveries);
    read_further_fields(json, s);
    return s;
  } catch (const std::exception& error) {
    throw UserError(fmt::format("{}: not a summary; expected the summary.json of a run directory ({})",
                                file.string(), error.what()));
  }
}

std::string summary_text(const Summary& s, const std::string& place) {
  std::string text;
  const auto line = [&text](std::string_view label, const std::string& rest) {
    text += fmt::format("  {:<10}{}\n", label, rest);
  };
  const std::string cells = s.cells > 0 ? fmt::format(" and {}", counted(s.cells, "cell")) : "";
  text += fmt::format("{}, seed {}: {}{}, {} simulated s ({} ticks)\n", s.name, s.seed, counted(s.robots, "robot"),
                      cells, short_number(s.simulated_s), s.ticks);
  std::string how = fmt::format("{} s of wall time, {} times real time, after {} s to start",
                                short_number(s.wall_s), short_number(s.realtime_factor()), short_number(s.start_s));
  if (s.resumed_from_tick > 0) how += fmt::format("; resumed from tick {}", s.resumed_from_tick);
  line("took", how);
  std::string where = s.mode;
  if (s.mode == "federated") {
    where += fmt::format(": {}x{} {}, {}", s.partition_columns, s.partition_rows,
                         s.partition_columns * s.partition_rows == 1 ? "partition" : "partitions",
                         counted(s.hosts, "host"));
  }
  if (s.recoveries > 0)
    where += fmt::format("; went back to a checkpoint {}",
                         s.recoveries == 1 ? "once" : fmt::format("{} times", s.recoveries));
  line("mode", where);
  line("moved", fmt::format("{} mm from start to end on average, {} mm at most", short_number(s.moved_mm.mean),
                            short_number(s.moved_mm.max)));
  line("messages", fmt::format("{} sent of {} attempted; {} received, {} ({}) lost to collisions", s.messages.sent,
                               s.messages.attempted, s.messages.received, s.messages.collided,
                               percentage(s.messages.collided, s.messages.received + s.messages.collided)));
  line("failed", counted(s.robots_failed, "robot"));
  for (const auto& [name, value] : s.observables)
    line("observed", std::isnan(value) ? name + " has no value" : fmt::format("{} = {:.6g}", name, value));
  for (const StationTotals::Plugin& plugin : s.station.plugins) {
    if (!plugin.failure.empty()) line("failed", fmt::format("plugin {}: {}", plugin.name, plugin.failure));
  }
  if (s.paced && s.lateness.late_ticks > 0) {
    line("late", fmt::format("{} of {} ticks began behind the pace, {} ms at most", s.lateness.late_ticks, s.ticks,
                             short_number(s.lateness.worst_s * 1e3)));
  }
  if (s.tracked) {
    line("tracked",
         fmt::format("{} joined, {} left, {} lost; samples act after {} ms (p50), {} ms (p99)", s.tracking.joined,
                     s.tracking.left, s.tracking.lost, short_number(s.tracking.effect_p50_s * 1e3),
                     short_number(s.tracking.effect_p99_s * 1e3)));
  }
  const Summary::Cost& c = s.cost_ns_per_robot_tick;
  std::vector<std::pair<std::string_view, double>> parts{{"behaviours", c.behaviours}, {"physics", c.physics},
                                                         {"radio", c.radio},           {"station", c.station},
                                                         {"exchange", c.exchange},     {"recording", c.recording}};
  std::stable_sort(parts.begin(), parts.end(), [](const auto& a, const auto& b) { return a.second > b.second; });
  std::string cost = fmt::format("{} ns per robot and tick", short_number(c.total()));
  for (std::size_t i = 0; i < parts.size() && parts[i].second > 0; ++i) {
    cost += fmt::format("{} {} {}", i == 0 ? ":" : ",", parts[i].first, short_number(parts[i].second));
  }
  line("cost", cost);
  line("used",
       fmt::format("{} s of CPU time, {} MiB of memory", short_number(s.cpu_s), short_number(s.peak_memory_mib)));
  line("hash", fmt::format("{:016x}", s.state_hash));
  const bool moves = s.robots + s.cells <= Film::kMostRobots;
  line("results", fmt::format("{}: report.html, summary.json, picture.svg, {}recording.ktrec", place,
                              moves ? "animation.svg, " : ""));
  return text;
}

}  // namespace kilotwin::recorder
