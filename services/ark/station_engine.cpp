#include "services/ark/station_engine.hpp"

#include <algorithm>
#include <utility>

#include "core/base/error.hpp"
#include "core/base/state_hash.hpp"
#include "core/math/elementary.h"
#include "core/plan/station_settings.hpp"
#include "core/plan/tracking_settings.hpp"
#include "idl/checkpoint.pb.h"

namespace kilotwin::ark {
namespace {

constexpr std::uint8_t kRunMessage = 0x88;  // kilolib's message types: RUN
constexpr std::uint8_t kStopType = 250;     // of ARK's broadcasts
constexpr double kArkSecondsPerPacket = 0.05, kShortestPerRobot_s = 1.0;
/// From the start of one copy of a message on the air to that of the next (measured on the overhead controller).
constexpr double kCopyPeriod_s = 0.010409;
/// Speed in the direction of the heading that robots at rest are said to have, mm/s.
constexpr double kLeastSpeed_mm = 1e-3;

OverheadPacket run_packet() {
  OverheadPacket packet{OverheadCommand::kRepeat, {}};
  packet.message.back() = kRunMessage;
  return packet;
}

double robot_interval_s(const StationSettings& setting, std::uint32_t robots) {
  const double rule_s =
      std::max(kShortestPerRobot_s, robots * kArkSecondsPerPacket / static_cast<double>(kArkSlots));
  return setting.robot_interval_s.value_or(rule_s);
}

/// The senders that put messages into the queue.
std::vector<EnvironmentSettings> places_of(const StationSettings& setting, const SimulatedHearing& hearing) {
  std::vector<EnvironmentSettings> places = setting.environments;
  if (hearing.any()) places.emplace_back();
  return places;
}

std::uint64_t word_of(const OverheadPacket& packet, std::size_t from) {
  std::uint64_t word = 0;
  for (std::size_t i = from; i < std::min(from + 8, packet.message.size()); ++i)
    word = word << 8 | packet.message[i];
  return word;
}

/// The least whole number of cycles that is not shorter.
std::int64_t cycles_of(double seconds) {
  const double cycles = seconds * kNominalClockHz;
  const auto whole = static_cast<std::int64_t>(cycles);
  return whole + static_cast<std::int64_t>(static_cast<double>(whole) < cycles);
}

/// Whether a multiple of `every_s` lies in (before, now].
bool is_due(double before_s, double now_s, double every_s) {
  return every_s > 0 && (before_s < 0 || kt_floor(now_s / every_s) > kt_floor(before_s / every_s));
}

}  // namespace

StationEngine::StationEngine(const RunPlan& plan, const std::filesystem::path& run_directory)
    : plan_(plan),
      setting_(plan.station_settings()),
      run_directory_(run_directory),
      start_ends_(plan.tick_length.at_or_after(setting_.start_broadcast_s)),
      is_limited_(setting_.packet_interval_s > 0),
      packet_interval_(cycles_of(is_limited_ ? setting_.packet_interval_s : kCopyPeriod_s)),
      hearing_(plan),
      queue_(plan.robots(), places_of(setting_, hearing_), cycles_of(robot_interval_s(setting_, plan.robots()))),
      tracked_(plan),
      packets_{run_packet()},
      next_packet_(begin_of(start_ends_) + begin_of(plan.tick_length.at_or_after(setting_.packet_interval_s))),
      measurement_(plan) {
  if (setting_.environments.empty()) return;
  if (setting_.camera) camera_.emplace(plan, *setting_.camera);
  seen_.resize(plan.robots());
  see_initial_poses();
  plugins_.resize(setting_.environments.size());
  for (std::uint32_t i = 0; i < plugins_.size(); ++i) set_up(i, false);
  outputs_of_set_up_ = std::move(outputs_);
}

void StationEngine::see_initial_poses() {
  SwarmView start(plan_.robots(), plan_.movables(), plan_.memory.size());
  start.tick = Tick{0};
  for (std::uint32_t robot = 0; robot < plan_.robots(); ++robot) {
    const Pose pose = plan_.initial_pose(robot);
    start.x_mm[robot] = pose.x_mm;
    start.y_mm[robot] = pose.y_mm;
    start.heading_rad[robot] = pose.heading_rad;
    if (plan_.tracked(robot) && !plan_.tracking_settings().present_at_start)
      start.life_cycle[robot] = static_cast<std::uint8_t>(LifeCycle::kAbsent);
  }
  seen_.x_mm = start.x_mm;
  seen_.y_mm = start.y_mm;
  see(start);
}

void StationEngine::see(const SwarmView& swarm) {
  if (measurement_.any()) measurement_.measure(swarm, measured_);
  if (camera_) return camera_->step(swarm, measurement_.any() ? &measured_ : nullptr);
  const auto& x_mm = measurement_.any() ? measured_.x_mm : swarm.x_mm;
  const auto& y_mm = measurement_.any() ? measured_.y_mm : swarm.y_mm;
  const auto& heading_rad = measurement_.any() ? measured_.heading_rad : swarm.heading_rad;
  for (std::uint32_t robot = 0; robot < plan_.robots(); ++robot) {
    const bool was_seen = seen_.seen[robot] != 0;
    seen_.seen[robot] = is_absent(swarm, robot) ? 0 : 1;
    if (seen_.seen[robot] == 0) continue;
    const double dx_mm = x_mm[robot] - seen_.x_mm[robot], dy_mm = y_mm[robot] - seen_.y_mm[robot];
    const double moved_mm = was_seen ? __builtin_sqrt(dx_mm * dx_mm + dy_mm * dy_mm) : 0;
    const double speed_mm = std::max(kLeastSpeed_mm, moved_mm / plan_.tick_length.seconds());
    seen_.x_mm[robot] = x_mm[robot];
    seen_.y_mm[robot] = y_mm[robot];
    seen_.heading_rad[robot] = heading_rad[robot];
    seen_.vx_mm[robot] = speed_mm * kt_cos(heading_rad[robot]);
    seen_.vy_mm[robot] = speed_mm * kt_sin(heading_rad[robot]);
    seen_.led[robot] = led_class(swarm.led[robot]);
  }
}

station::Request StationEngine::request(station::Call call, Tick at) const {
  station::Request request;
  request.call = call;
  request.tick = at.count();
  request.time_s = plan_.tick_length.seconds_at(at);
  const SeenRobots& seen = this->seen();
  request.robots.resize(plan_.robots());
  for (std::uint32_t robot = 0; robot < plan_.robots(); ++robot) {
    station::SeenRobot& it = request.robots[robot];
    it.x_mm = seen.x_mm[robot];
    it.y_mm = seen.y_mm[robot];
    it.vx_mm = seen.vx_mm[robot];
    it.vy_mm = seen.vy_mm[robot];
    if (it.vx_mm * it.vx_mm + it.vy_mm * it.vy_mm < kLeastSpeed_mm * kLeastSpeed_mm) {
      it.vx_mm = kLeastSpeed_mm * kt_cos(seen.heading_rad[robot]);
      it.vy_mm = kLeastSpeed_mm * kt_sin(seen.heading_rad[robot]);
    }
    it.colour = static_cast<station::lightColour>(seen.led[robot]);
    it.seen = seen.seen[robot] != 0;
  }
  return request;
}

/// A paced run cannot stand still for a plugin: real robots drive on.
PluginPatience StationEngine::patience_with(const EnvironmentSettings& setting) {
  PluginPatience patience;
  if (plan_.pace > 0) patience.step_wall_s = PluginPatience::kPacedStep_s;
  patience.while_waiting = [this, &setting] {
    if (tell_) tell_(setting.name);
  };
  return patience;
}

void StationEngine::set_up(std::uint32_t environment, bool resumed) {
  const EnvironmentSettings& setting = setting_.environments[environment];
  Plugin& plugin = plugins_[environment];
  plugin = {};
  plugin.host = make_plugin_host(setting, setting_.host_sha256, run_directory_, patience_with(setting));
  station::Request request = this->request(station::Call::kSetup, now_);
  request.resumed = resumed;
  request.seed = plan_.seed();
  request.index = environment;
  request.width_mm = 2 * plan_.world.arena.half_width_mm();
  request.height_mm = 2 * plan_.world.arena.half_height_mm();
  request.parameters = setting.parameters;
  station::Reply reply = plugin.host->ask(request);
  if (!reply.failure.empty() && !reply.crashed)
    throw UserError("the station's plugin " + setting.name + ": " + reply.failure);
  plugin.interval_ms = reply.interval_ms;
  take(environment, std::move(reply), now_);
}

void StationEngine::run_plugins(Tick from) {
  for (std::uint32_t i = 0; i < plugins_.size(); ++i) {
    Plugin& plugin = plugins_[i];
    if (!plugin.failure.empty() || plugin.complete) continue;
    const double interval_s = plugin.interval_ms * 1e-3;
    const double now_s = static_cast<double>(plugin.services) * interval_s;
    if (plan_.tick_length.at_or_after(now_s) > from) continue;
    // An interval below a tick runs once per tick.
    ++plugin.services;
    while (plan_.tick_length.at_or_after(static_cast<double>(plugin.services) * interval_s) <= from)
      ++plugin.services;
    station::Request request = this->request(station::Call::kStep, from);
    request.log = is_due(now_s - interval_s, now_s, setting_.log_every_s);
    request.paint = is_due(now_s - interval_s, now_s, setting_.floor_every_s);
    take(i, plugin.host->ask(request), now_);
  }
}

void StationEngine::pass_on_hearing(const SwarmView& swarm) {
  const auto place = static_cast<std::uint32_t>(setting_.environments.size());
  for (const ArkMessage& message : hearing_.heard(swarm)) queue_.put(place, message, begin_of(now_));
}

void StationEngine::take(std::uint32_t environment, station::Reply reply, Tick now) {
  Plugin& plugin = plugins_[environment];
  PluginOutput output;
  output.environment = environment;
  if (!reply.failure.empty()) {
    plugin.failure = reply.failure;
    plugin.host.reset();
    output.failure = reply.failure;
    output.ends_run = setting_.environments[environment].ends_run;
    outputs_.push_back(std::move(output));
    return;
  }
  plugin.word = reply.word;
  plugin.complete = reply.complete;
  for (const station::Sent& sent : reply.sent) {
    if (!sent.to_all) {
      queue_.put(environment, {sent.id, sent.type, sent.data}, begin_of(now));
      continue;
    }
    IrMessage message{};
    std::copy(sent.octets.begin(), sent.octets.end(), message.begin());
    message.back() = sent.type;
    // The station stops a repetition by itself; ARK's STOP only ends it a packet earlier.
    if (sent.type != kStopType) queue_.put_broadcast(message);
  }
  output.log_rows = std::move(reply.rows);
  output.reports = std::move(reply.reports);
  if (reply.painted) output.floor = std::move(reply.floor);
  if (!output.log_rows.empty() || !output.reports.empty() || output.floor) outputs_.push_back(std::move(output));
}

void StationEngine::push(const OverheadPacket& packet, Cycles t) {
  packets_.push_back(packet.at(static_cast<std::uint32_t>(t - begin_of(now_))));
}

void StationEngine::send_own() {
  if (now_ == start_ends_ && repeating_) {
    push({OverheadCommand::kStop, {}}, begin_of(now_));
    repeating_ = false;
  } else if (uses_queue() && next_packet_ < begin_of(now_ + 1)) {
    send_waiting();
  }
}

void StationEngine::send_waiting() {
  const Cycles end = begin_of(now_ + 1);
  Cycles t = std::max(next_packet_, begin_of(now_));
  while (t < end) {
    const auto message = queue_.take(t);
    if (!message && !repeating_) {
      // The air is free until somebody's turn comes.
      t = std::max(t + 1, queue_.earliest().value_or(end));
      continue;
    }
    const auto command = is_limited_ ? OverheadCommand::kRepeat : OverheadCommand::kOnce;
    push(message ? OverheadPacket{command, *message} : OverheadPacket{}, t);
    repeating_ = message && is_limited_;
    t = next_packet_ = t + packet_interval_;
  }
}

void StationEngine::step(Tick from, const Inputs& inputs) {
  KILOTWIN_DEMAND(from == now_);
  ++now_;
  tracked_.commit(inputs.memberships);
  outputs_ = std::exchange(outputs_of_set_up_, {});
  if (!plugins_.empty()) {
    see(inputs.swarm);
    run_plugins(from);
  }
  if (hearing_.any()) pass_on_hearing(inputs.swarm);
  packets_.assign(inputs.external.begin(), inputs.external.end());
  if (packets_.empty()) return send_own();
  std::stable_sort(packets_.begin(), packets_.end(), [](const OverheadPacket& a, const OverheadPacket& b) {
    return a.offset_cycles() < b.offset_cycles();
  });
  // The station must not stop an external packet; the next own packet overrides it, an interval later.
  repeating_ = false;
  next_packet_ = std::max(next_packet_, begin_of(now_) + packets_.back().offset_cycles() + packet_interval_);
}

void StationEngine::emit(OverheadFrame& frame) const {
  frame.tick = now_;
  frame.packets.assign(packets_.begin(), packets_.end());
}

std::uint64_t StationEngine::hash_part() const {
  constexpr std::uint64_t kNoTurn = 0;
  const Cycles tick = begin_of(Tick{1});
  std::uint64_t sum =
      entity_hash(HashDomain::kStation, 0,
                  {kNoTurn, static_cast<std::uint64_t>(next_packet_ / tick),
                   static_cast<std::uint64_t>(next_packet_ % tick) << 1 | static_cast<std::uint64_t>(repeating_),
                   packets_.size()});
  for (std::uint32_t i = 0; i < packets_.size(); ++i) {
    sum += entity_hash(HashDomain::kStation, 1 + i,
                       {static_cast<std::uint64_t>(packets_[i].command), word_of(packets_[i], 0),
                        word_of(packets_[i], 8) | std::uint64_t{packets_[i].offset_cycles()} << 16});
    if (packets_[i].is_short()) continue;
    constexpr std::uint32_t kRest = 1u << 29;
    std::uint64_t rest = 0;
    for (const std::uint8_t octet : packets_[i].rest) rest = hash_mix(rest, octet);
    sum += entity_hash(HashDomain::kStation, kRest + i, {rest});
  }
  sum += tracked_.hash_part();
  // Apart from the packets, of which there are few.
  constexpr std::uint32_t kQueue = 1u << 30, kCameraModel = kQueue + 1, kEnvironments = 1u << 31;
  if (uses_queue()) sum += entity_hash(HashDomain::kStation, kQueue, {queue_.word()});
  if (camera_) sum += entity_hash(HashDomain::kStation, kCameraModel, {camera_->word()});
  for (std::uint32_t i = 0; i < plugins_.size(); ++i) {
    const Plugin& plugin = plugins_[i];
    const std::uint64_t flags = (plugin.failure.empty() ? 0u : 1u) | (plugin.complete ? 2u : 0u);
    sum += entity_hash(HashDomain::kStation, kEnvironments + i,
                       {plugin.word, static_cast<std::uint64_t>(plugin.services), flags});
  }
  return sum;
}

}  // namespace kilotwin::ark
