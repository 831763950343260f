#include "clients/view/recorded_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "clients/recorder/summary.hpp"
#include "clients/recorder/tracker_records.hpp"
#include "clients/view/flights.hpp"
#include "clients/view/recently_used.hpp"
#include "clients/view/robot_log.hpp"
#include "clients/view/watched_plan.hpp"
#include "clients/view/work.hpp"
#include "core/base/error.hpp"
#include "core/base/pose.hpp"
#include "core/logs/robot_logs.hpp"
#include "idl/manifest.pb.h"

namespace kilotwin::view {
namespace fs = std::filesystem;
namespace {

using recorder::StateIndex;

/// A place that a tracker stated is shown for so long. Records that one answer reads at most.
constexpr double kPlaceHolds_s = 1;
constexpr std::size_t kMostSamples = 128;
/// Inputs that one answer reads at most, and marks of a time line.
constexpr std::size_t kMostInputs = 4000, kMostMarks = 500;
constexpr std::size_t kMostWholeRuns = 64;

fs::path recording_of(const fs::path& run) {
  return recorder::RunDirectory::open(run, recorder::RunDirectory::Needs::kRecording).recording();
}

/// The experiment as far as the header describes it, for recordings without their run directory.
proto::Experiment experiment_of(const proto::RecordingHeader& header) {
  proto::Experiment experiment;
  if (header.has_arena()) {
    *experiment.mutable_arena() = header.arena();
  } else {
    experiment.mutable_arena()->set_width_mm(header.arena_width_mm());
    experiment.mutable_arena()->set_height_mm(header.arena_height_mm());
  }
  *experiment.mutable_obstacle() = header.obstacle();
  *experiment.mutable_movable() = header.movable();
  *experiment.mutable_light() = header.light();
  *experiment.mutable_recording()->mutable_event() = header.event();
  *experiment.mutable_station()->mutable_environment() = header.environment();
  for (const std::uint32_t count : header.group_robots()) experiment.add_robots()->set_count(count);
  return experiment;
}

std::vector<bool> firmware_of(const proto::Manifest& manifest) {
  std::vector<bool> firmware;
  for (const std::uint32_t program : manifest.group_program()) {
    firmware.push_back(program < static_cast<std::uint32_t>(manifest.program_size()) &&
                       manifest.program(static_cast<int>(program)).firmware());
  }
  return firmware;
}

std::span<const std::uint8_t> octets(const std::string& bytes) {
  return {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()};
}

}  // namespace

RecordedRun::RecordedRun(const fs::path& run) : reader_(recording_of(run)), index_(reader_.path()) {
  index_.update();
  if (index_.states().empty())
    throw UserError(fmt::format("{}: has no state yet; expected a run that has begun", reader_.path().string()));
  const fs::path manifest = reader_.path().parent_path() / "manifest.pb";
  auto experiment = std::make_unique<proto::Experiment>(experiment_of(reader_.header()));
  if (fs::exists(manifest)) {
    const auto directory = recorder::RunDirectory::open(run, recorder::RunDirectory::Needs::kManifest);
    const proto::Manifest resolved = directory.read_manifest();
    // A recording under another name may lie in the directory of another run.
    if (resolved.run() == reader_.header().run()) {
      *experiment = resolved.experiment();
      firmware_ = firmware_of(resolved);
      federated_ = resolved.mode() == "federated";
      logs_of_ = directory.path();
      plan_ = plan_of(*experiment, &resolved);
    }
  }
  grid_ = grid_of(*experiment);
  if (!plan_) plan_ = plan_of(*experiment);
  experiment_ = std::move(experiment);
}

RecordedRun::~RecordedRun() = default;

std::string RecordedRun::text() const {
  const std::lock_guard lock(mutex_);
  const proto::RecordingHeader& header = reader_.header();
  RunOutline outline;
  outline.name = header.name();
  outline.run = header.run();
  outline.seed = header.seed();
  outline.tick_s = reader_.tick_length().seconds();
  outline.first_tick = index_.states().front().tick;
  outline.last_tick = index_.states().back().tick;
  outline.robots = header.robots();
  outline.states = index_.states().size();
  outline.firmware = firmware_;
  outline.federated = federated_;
  if (federated_ && plan_) outline.ghost_margin_mm = ghost_margin_mm(*plan_);
  return run_text(outline, *experiment_);
}

std::size_t RecordedRun::states() const {
  const std::lock_guard lock(mutex_);
  return index_.states().size();
}

std::string RecordedRun::grown() {
  const std::lock_guard lock(mutex_);
  const std::size_t before = index_.states().size();
  index_.update();
  if (index_.states().size() == before) return {};
  return fmt::format("{{\"type\":\"extent\",\"lastTick\":{},\"states\":{}}}", index_.states().back().tick,
                     index_.states().size());
}

/// Valid until the next call; nullptr where the file is damaged there.
const proto::Record* RecordedRun::record_at(std::uint64_t offset) {
  reader_.go_to(offset);
  return reader_.next();
}

const proto::StateRecord* RecordedRun::state(std::size_t number) {
  const proto::Record* const record = record_at(index_.states()[number].offset);
  return record != nullptr && record->has_state() ? &record->state() : nullptr;
}

std::string RecordedRun::frame_at(std::int64_t tick, std::uint32_t request) {
  const std::lock_guard lock(mutex_);
  const std::size_t number = index_.at_or_before(tick);
  const proto::StateRecord* const at = state(number);
  if (at == nullptr) return {};
  FrameColumns columns;
  columns.x_mm = recorder::values(at->x_mm());
  columns.y_mm = recorder::values(at->y_mm());
  columns.heading_rad = recorder::values(at->heading_rad());
  columns.led = octets(at->led());
  columns.life_cycle = octets(at->life_cycle());
  columns.movable_x_mm = recorder::values(at->movable_x_mm());
  columns.movable_y_mm = recorder::values(at->movable_y_mm());
  columns.movable_heading_rad = recorder::values(at->movable_heading_rad());
  const std::vector<StateIndex::Entry>& states = index_.states();
  const std::int64_t next = number + 1 < states.size() ? states[number + 1].tick : at->tick();
  return encode_frame({request, at->tick(), next}, columns, grid_);
}

std::uint64_t RecordedRun::floors_version(std::int64_t tick) {
  const std::lock_guard lock(mutex_);
  const auto& floors = index_.floors();
  return static_cast<std::uint64_t>(
      std::count_if(floors.begin(), floors.end(), [tick](const auto& entry) { return entry.tick <= tick; }));
}

std::string RecordedRun::floors_at(std::int64_t tick) {
  const std::lock_guard lock(mutex_);
  std::map<std::uint32_t, proto::FloorRecord> newest;  // by environment
  // Backwards: most environments paint often, and only their newest floor counts.
  const auto environments = static_cast<std::size_t>(std::max(1, experiment_->station().environment_size()));
  for (auto entry = index_.floors().rbegin(); entry != index_.floors().rend(); ++entry) {
    if (entry->tick > tick) continue;
    if (newest.size() == environments) break;
    const proto::Record* const record = record_at(entry->offset);
    if (record != nullptr && record->has_floor())
      newest.try_emplace(record->floor().environment(), record->floor());
  }
  std::vector<proto::FloorRecord> list;
  list.reserve(newest.size());
  for (auto& [environment, floor] : newest) list.push_back(std::move(floor));
  return floors_text(list);
}

std::string RecordedRun::light(std::int64_t tick) {
  const std::lock_guard lock(mutex_);
  if (!light_) light_.emplace(plan_);
  const proto::StateRecord* const at = state(index_.at_or_before(tick));
  return at == nullptr ? std::string()
                       : light_->text(tick, recorder::values(at->x_mm()), recorder::values(at->y_mm()));
}

std::string RecordedRun::trail(std::uint32_t robot, std::int64_t tick) {
  const std::lock_guard lock(mutex_);
  if (robot >= reader_.header().robots()) return notice_text(fmt::format("There is no robot {}.", robot));
  return curves_.trail(robot, tick);
}

/// Robots whose messages it received shortly before.
std::set<std::uint32_t> RecordedRun::heard_lately(std::uint32_t robot, std::int64_t tick) {
  const auto shortly = static_cast<std::int64_t>(kLately_s / reader_.tick_length().seconds());
  std::set<std::uint32_t> senders;
  static_cast<void>(each_event_back(proto::RECEIVED, tick - shortly, tick, [&](const proto::EventRecord& event) {
    for (int i = 0; i < std::min(event.robot_size(), event.sender_size()); ++i)
      if (event.robot(i) == robot) senders.insert(event.sender(i));
    return true;
  }));
  return senders;
}

/// Counts of the radio and of pairs of robots, as a JSON object.
std::string RecordedRun::of_whole_run(std::uint32_t robot) {
  nlohmann::json text = nlohmann::json::object();
  const auto i = static_cast<int>(robot);
  if (index_.radio()) {
    const proto::Record* const record = record_at(*index_.radio());
    if (record != nullptr && record->has_radio() && i < record->radio().attempted_size()) {
      const proto::RadioRecord& radio = record->radio();
      const auto at = [i](const auto& column) { return i < column.size() ? column[i] : 0u; };
      text = {{"attempted", at(radio.attempted())},
              {"sent", at(radio.sent())},
              {"received", at(radio.received())},
              {"collided", at(radio.collided())},
              {"backedOff", at(radio.backed_off())}};
    }
  }
  if (index_.messages()) {
    const proto::Record* const record = record_at(*index_.messages());
    if (record != nullptr && record->has_messages()) {
      const proto::MessagesRecord& messages = record->messages();
      std::map<std::uint32_t, std::uint32_t> heard, heard_by;
      for (int k = 0; k < messages.receiver_size(); ++k) {
        if (messages.receiver(k) == messages.sender(k)) continue;
        if (messages.receiver(k) == robot) heard[messages.sender(k)] += messages.count(k);
        if (messages.sender(k) == robot) heard_by[messages.receiver(k)] += messages.count(k);
      }
      text["heard"] = partners(heard);
      text["heardBy"] = partners(heard_by);
    }
  }
  return text.dump();
}

std::string RecordedRun::robot(std::uint32_t robot, std::int64_t tick) { return this->robot(robot, tick, {}); }

std::string RecordedRun::robot(std::uint32_t robot, std::int64_t tick,
                               const std::optional<std::set<std::uint32_t>>& lately) {
  const std::lock_guard lock(mutex_);
  if (robot >= reader_.header().robots()) return notice_text(fmt::format("There is no robot {}.", robot));
  nlohmann::json text{{"type", "robot"}, {"robot", robot}, {"tick", tick}};
  const MessageCounts counts = messages_.until(robot, tick);
  text["whole"] = counts.whole;
  if (counts.sent) text["sent"] = *counts.sent;
  if (counts.received) {
    text["received"] = *counts.received;
    text["heard"] = partners(counts.heard);
    text["lately"] = lately ? *lately : heard_lately(robot, tick);
  }
  // Of the whole run, once it has ended; all pairs of robots are read for it.
  WholeRun& known = recently_used(
      whole_runs_, kMostWholeRuns, [robot](const WholeRun& one) { return one.robot == robot; },
      WholeRun{robot, {}});
  if (known.text.empty() && index_.ended()) known.text = of_whole_run(robot);
  if (!known.text.empty()) text["run"] = nlohmann::json::parse(known.text);
  return text.dump();
}

std::string RecordedRun::plots() {
  const std::lock_guard lock(mutex_);
  return curves_.list();
}

std::string RecordedRun::plot(std::uint32_t number, std::optional<std::uint32_t> robot) {
  const std::lock_guard lock(mutex_);
  return curves_.plot(number, robot);
}

std::string RecordedRun::program(std::uint32_t robot, std::int64_t tick) {
  const std::lock_guard lock(mutex_);
  const proto::RecordingHeader& header = reader_.header();
  if (robot >= header.robots()) return notice_text(fmt::format("There is no robot {}.", robot));
  ProgramText text;
  text.robot = robot;
  text.tick = tick;
  for (int v = 0; v < header.variable_size(); ++v)
    text.variables.emplace_back(header.variable(v).name(),
                                curves_.value(static_cast<std::uint32_t>(v), robot, tick));
  if (!logs_of_.empty()) {
    // A tick's lines are stamped with its time, to the millisecond.
    text.log =
        log_until(RobotLogs::file_in(logs_of_, robot), reader_.tick_length().seconds_at(Tick{tick}) + 0.0005);
  }
  return program_text(text);
}

std::string RecordedRun::outside(std::int64_t tick) {
  const std::lock_guard lock(mutex_);
  return outside_text(tick, {places_at(tick), packets_until(tick), alarms_until(tick)});
}

std::vector<std::string> RecordedRun::alarms_until(std::int64_t tick) const {
  if (logs_of_.empty()) return {};
  return view::alarms_until(logs_of_ / "alarms.txt", reader_.tick_length().seconds_at(Tick{tick}));
}

/// Of each tracked robot, the last place that a tracker stated shortly before.
std::vector<TrackedPlace> RecordedRun::places_at(std::int64_t tick) {
  const std::vector<StateIndex::Entry>& all = index_.trackers();
  const auto shortly = static_cast<std::int64_t>(kPlaceHolds_s / reader_.tick_length().seconds());
  const TrackingSettings none;
  const std::vector<TrackerSettings>& trackers = (plan_ ? plan_->tracking_settings() : none).trackers;
  std::map<std::uint32_t, TrackedPlace> places;
  auto at = std::upper_bound(all.begin(), all.end(), tick,
                             [](std::int64_t wanted, const auto& entry) { return wanted < entry.tick; });
  for (std::size_t read = 0; at != all.begin() && read < kMostSamples; ++read) {
    if ((--at)->tick < tick - shortly) break;
    const proto::Record* const record = record_at(at->offset);
    if (record == nullptr || !record->has_tracker()) continue;
    try {
      add_places(trackers, recorder::from_record(record->tracker()), places);
    } catch (const UserError&) {
      // A damaged sample shows no robots.
    }
  }
  std::vector<TrackedPlace> list;
  list.reserve(places.size());
  for (const auto& [robot, place] : places) list.push_back(place);
  return list;
}

/// All packets of the station where they are recorded, else those of outsiders.
std::vector<ShownPacket> RecordedRun::packets_until(std::int64_t tick) {
  const auto seconds = [this](std::int64_t at, std::uint32_t offset_cycles) {
    return reader_.tick_length().seconds_at(Tick{at}) + offset_cycles / kNominalClockHz;
  };
  std::vector<ShownPacket> newest_first;
  const auto& kinds = reader_.header().event();
  const bool all_packets = std::find(kinds.begin(), kinds.end(), proto::STATION) != kinds.end();
  const std::vector<StateIndex::Entry>& entries = all_packets ? index_.events(proto::STATION) : index_.inputs();
  std::size_t read = 0;
  for (auto at = entries.rbegin(); at != entries.rend() && newest_first.size() < kMostPackets; ++at) {
    if (at->tick > tick) continue;
    if (++read > kMostSamples) break;
    const proto::Record* const record = record_at(at->offset);
    if (record == nullptr) continue;
    if (record->has_event()) {
      const proto::EventRecord& event = record->event();
      for (int i = std::min({event.value_size(), event.text_size(), event.offset_cycles_size()}); i-- > 0;) {
        if (const auto message = message_of(event.text(i)))
          newest_first.push_back(
              {seconds(event.tick(), event.offset_cycles(i)), static_cast<std::uint8_t>(event.value(i)), *message});
      }
    } else if (record->has_input() && record->input().kind() == proto::InputRecord::OVERHEAD_INPUT) {
      const proto::InputRecord& input = record->input();
      if (const auto packet = packet_of(input.packet()))
        newest_first.push_back({seconds(input.tick(), input.packet_offset_cycles()),
                                static_cast<std::uint8_t>(packet->command), packet->message});
    }
  }
  if (newest_first.size() > kMostPackets) newest_first.resize(kMostPackets);
  return {newest_first.rbegin(), newest_first.rend()};
}

/// Calls take(event) for the records of a kind from a tick back to another one, until it returns false. An event's record is of the
/// tick in which the packet ended. False: there are more.
template <class Take>
bool RecordedRun::each_event_back(std::uint32_t kind, std::int64_t from, std::int64_t tick, const Take& take) {
  const std::vector<StateIndex::Entry>& all = index_.events(kind);
  auto at = std::upper_bound(all.begin(), all.end(), tick,
                             [](std::int64_t wanted, const auto& entry) { return wanted < entry.tick; });
  for (std::size_t read = 0; at != all.begin(); ++read) {
    if ((--at)->tick < from) return true;
    if (read == kMostSamples) return false;
    const proto::Record* const record = record_at(at->offset);
    if (record != nullptr && record->has_event() && !take(record->event())) return false;
  }
  return true;
}

std::string RecordedRun::flights(std::int64_t from, std::int64_t tick) {
  const std::lock_guard lock(mutex_);
  // Each kind reads its own records, so that many of one kind hide none of the other.
  constexpr std::array kKinds{proto::RECEIVED, proto::SENT};
  std::array<std::vector<Flight>, kKinds.size()> of;
  bool whole = true;
  for (std::size_t k = 0; k < kKinds.size(); ++k) {
    whole &= each_event_back(kKinds[k], from, tick, [&](const proto::EventRecord& event) {
      add_flights(event, reader_.tick_length(), of[k]);
      return of[k].size() <= kMostFlights;
    });
    std::erase_if(of[k], [from, tick](const Flight& flight) {
      return !(flight.tick > static_cast<double>(from) && flight.tick <= static_cast<double>(tick));
    });
  }
  std::vector<Flight> flights;
  const std::size_t least = kMostFlights / kKinds.size();
  for (std::size_t k = 0; k < kKinds.size(); ++k) {
    const std::size_t others = std::min(of[1 - k].size(), least);
    const std::size_t count = std::min(of[k].size(), kMostFlights - others);
    whole &= count == of[k].size();
    flights.insert(flights.end(), of[k].begin(), of[k].begin() + static_cast<std::ptrdiff_t>(count));
  }
  return flights_text({from, tick, static_cast<double>(tick), whole}, flights);
}

std::string RecordedRun::work() {
  const std::lock_guard lock(mutex_);
  const fs::path summary = logs_of_ / "summary.json";
  if (work_.empty() && !logs_of_.empty() && fs::exists(summary)) {
    try {
      work_ = work_text(recorder::read_summary(summary));
    } catch (const UserError&) {
      // It is being written, or is none.
    }
  }
  return work_.empty() ? work_text(/*live=*/false, {}) : work_;
}

std::string RecordedRun::marks() {
  const std::lock_guard lock(mutex_);
  const std::vector<StateIndex::Entry>& inputs = index_.inputs();
  for (std::size_t read = 0; inputs_read_ < inputs.size() && read < kMostInputs; ++read) {
    const proto::Record* const record = record_at(inputs[inputs_read_++].offset);
    if (record == nullptr || !record->has_input() || record->input().kind() != proto::InputRecord::RELOCATION)
      continue;
    const proto::InputRecord& input = record->input();
    if (marks_.size() == kMostMarks) continue;
    marks_.push_back({input.tick(), fmt::format("{} {} placed at {:.0f}, {:.0f} mm, heading {:.0f}\u00b0",
                                                input.movable() ? "object" : "robot", input.robot(), input.x_mm(),
                                                input.y_mm(), input.heading_rad() * 180 / kPi)});
  }
  return marks_text(marks_, inputs_read_ == inputs.size());
}

std::string RecordedRun::steer(const Request&) { return "A recorded run cannot be steered."; }

}  // namespace kilotwin::view
