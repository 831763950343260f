#include <fmt/format.h>

#include <algorithm>
#include <tuple>

#include "clients/recorder/export.hpp"
#include "clients/recorder/ordered_records.hpp"
#include "core/base/error.hpp"

namespace kilotwin::recorder {
namespace {

const char* name_of(proto::RecordedEvent kind) {
  switch (kind) {
    case proto::LED: return "led";
    case proto::MOTION: return "motion";
    case proto::STATE: return "state";
    case proto::SENT: return "sent";
    case proto::RECEIVED: return "received";
    case proto::STATION: return "station";
    case proto::FAILURE: return "failure";
  }
  return "unknown";
}

/// One event: entry `index` of a record.
struct Event {
  const proto::EventRecord* record = nullptr;
  int index = 0;
  std::int64_t cycles = 0;  ///< since the start
  [[nodiscard]] std::uint32_t robot() const { return record->robot_size() == 0 ? 0 : record->robot(index); }
};

/// The events of a tick by time, kind and robot.
std::vector<Event> sorted(const std::vector<proto::EventRecord>& records, Tick tick, TickLength length) {
  std::vector<Event> events;
  for (const proto::EventRecord& record : records) {
    const int count = std::max(record.robot_size(), record.value_size());
    for (int i = 0; i < count; ++i) {
      const std::int64_t offset = record.offset_cycles_size() == 0 ? 0 : record.offset_cycles(i);
      events.push_back({&record, i, tick.count() * std::int64_t{length.cycles()} + offset});
    }
  }
  std::stable_sort(events.begin(), events.end(), [](const Event& a, const Event& b) {
    return std::tuple(a.cycles, a.record->kind(), a.robot()) < std::tuple(b.cycles, b.record->kind(), b.robot());
  });
  return events;
}

constexpr unsigned bit(proto::RecordedEvent kind) { return 1u << kind; }
constexpr unsigned kAll = ~0u, kOfRobots = ~bit(proto::STATION);

/// A column, the kinds of events that it says something about, and its cell of an event of such a kind.
struct EventColumn {
  Column column;
  unsigned kinds;
  void (*put)(Table& table, const Event& event, const std::vector<std::uint32_t>& groups);
};

std::uint32_t value_of(const Event& event) { return event.record->value(event.index); }

/// Bits `shift` and above of an event's value.
template <unsigned shift, unsigned mask>
void put_bits(Table& table, const Event& event, const std::vector<std::uint32_t>&) {
  table.integer(value_of(event) >> shift & mask);
}

std::vector<EventColumn> all_columns() {
  using Groups = std::vector<std::uint32_t>;
  return {
      {{"time_s", "s", CellType::kTime},
       kAll,
       [](Table& table, const Event& event, const Groups&) { table.time(Tick{event.cycles}, TickLength{1}); }},
      {{"event", "", CellType::kText},
       kAll,
       [](Table& table, const Event& event, const Groups&) { table.text(name_of(event.record->kind())); }},
      {{"robot", "", CellType::kInteger},
       kOfRobots,
       [](Table& table, const Event& event, const Groups&) { table.integer(event.robot()); }},
      {{"group", "", CellType::kInteger},
       kOfRobots,
       [](Table& table, const Event& event, const Groups& groups) { table.integer(groups[event.robot()]); }},
      {{"led_r", "", CellType::kInteger}, bit(proto::LED), put_bits<0, 3>},
      {{"led_g", "", CellType::kInteger}, bit(proto::LED), put_bits<2, 3>},
      {{"led_b", "", CellType::kInteger}, bit(proto::LED), put_bits<4, 3>},
      {{"motor_left", "", CellType::kInteger}, bit(proto::MOTION), put_bits<0, 0xff>},
      {{"motor_right", "", CellType::kInteger}, bit(proto::MOTION), put_bits<8, 0xff>},
      {{"state", "", CellType::kText},
       bit(proto::STATE),
       [](Table& table, const Event& event, const Groups&) {
         table.text(state_name(static_cast<std::uint8_t>(value_of(event))));
       }},
      {{"sender", "", CellType::kInteger},
       bit(proto::RECEIVED),
       [](Table& table, const Event& event, const Groups&) { table.integer(event.record->sender(event.index)); }},
      {{"distance_mm", "mm", CellType::kNumber, 3},
       bit(proto::RECEIVED),
       [](Table& table, const Event& event, const Groups&) {
         table.number(static_cast<double>(event.record->distance_mm(event.index)));
       }},
      {{"text", "", CellType::kText},
       bit(proto::FAILURE) | bit(proto::STATION),
       [](Table& table, const Event& event, const Groups&) {
         const std::string& text = event.record->text(event.index);
         // Digits alone would be read as a number.
         table.text(event.record->kind() == proto::STATION ? "0x" + text : text);
       }}};
}

/// The kinds as bits. Throws UserError if the run did not record one of them.
unsigned bits_of(const std::vector<proto::RecordedEvent>& kinds, const Reader& recording) {
  if (kinds.empty()) return kAll;
  const auto& recorded = recording.header().event();
  unsigned bits = 0;
  for (const proto::RecordedEvent kind : kinds) {
    // Failures are always recorded.
    if (kind != proto::FAILURE && std::find(recorded.begin(), recorded.end(), kind) == recorded.end())
      throw UserError(fmt::format("{}: no events {}; run again with recording {{ event: {} }} in the experiment",
                                  recording.path().string(), name_of(kind), proto::RecordedEvent_Name(kind)));
    bits |= bit(kind);
  }
  return bits;
}

const char* motion_of(std::uint32_t value) {
  const bool left = (value & 0xff) != 0, right = (value >> 8 & 0xff) != 0;
  return left && right ? "straight" : left ? "left" : right ? "right" : "stop";
}

/// Whether these are the duties of a calibrated motion, or of none.
bool are_calibrated(std::uint32_t value, const CalibratedDuties& robot) {
  const std::uint32_t left = value & 0xff, right = value >> 8 & 0xff;
  if (left != 0 && right != 0) return left == robot.straight_left && right == robot.straight_right;
  return (left == 0 || left == robot.turn_left) && (right == 0 || right == robot.turn_right);
}

}  // namespace

std::optional<proto::RecordedEvent> event_kind(std::string_view name) {
  for (int kind = proto::RecordedEvent_MIN; kind <= proto::RecordedEvent_MAX; ++kind) {
    if (proto::RecordedEvent_IsValid(kind) && name == name_of(static_cast<proto::RecordedEvent>(kind)))
      return static_cast<proto::RecordedEvent>(kind);
  }
  return std::nullopt;
}

std::uint64_t export_events(Reader& recording, const std::filesystem::path& file,
                            const std::vector<proto::RecordedEvent>& kinds, const TableMetadata& metadata) {
  const unsigned wanted = bits_of(kinds, recording);
  std::vector<EventColumn> chosen;
  std::vector<Column> columns;
  for (EventColumn& column : all_columns()) {
    if ((column.kinds & wanted) == 0) continue;
    columns.push_back(column.column);
    chosen.push_back(std::move(column));
  }
  const std::vector<std::uint32_t> groups = groups_of(recording.header());
  const auto table = open_table(file, std::move(columns), metadata);
  OrderedRecords ordered(recording, OrderedRecords::kEvents);
  while (ordered.next()) {
    for (const Event& event : sorted(ordered.records().events, ordered.tick(), recording.tick_length())) {
      const unsigned kind = bit(event.record->kind());
      if ((kind & wanted) == 0) continue;
      for (const EventColumn& column : chosen) {
        if ((column.kinds & kind) != 0)
          column.put(*table, event, groups);
        else
          table->missing();
      }
      table->end_row();
    }
  }
  table->close();
  return table->rows();
}

ExportedCommands export_commands(Reader& recording, const std::filesystem::path& file,
                                 const std::vector<CalibratedDuties>& calibrated, const TableMetadata& metadata) {
  const auto& kinds = recording.header().event();
  if (std::find(kinds.begin(), kinds.end(), proto::MOTION) == kinds.end()) {
    throw UserError(
        fmt::format("{}: no changes of motion; run again with recording {{ event: MOTION }} in the experiment",
                    recording.path().string()));
  }
  const auto table = open_table(file,
                                {{"run", "", CellType::kText},
                                 {"robot", "", CellType::kInteger},
                                 {"time_s", "s", CellType::kTime},
                                 {"motion", "", CellType::kText}},
                                metadata);
  const std::string run = fmt::format("{}-{}", recording.header().name(), recording.header().seed());
  std::vector<const char*> last(recording.header().robots(), nullptr);
  std::vector<std::uint8_t> drives_otherwise(recording.header().robots(), 0);
  OtherDuties other;
  OrderedRecords ordered(recording, OrderedRecords::kEvents);
  const auto compare = [&](const Event& event) {
    const std::uint32_t robot = event.robot(), value = value_of(event);
    if (robot >= calibrated.size() || are_calibrated(value, calibrated[robot])) return;
    if (other.changes++ == 0) {
      other.robot = robot;
      other.left = value & 0xff;
      other.right = value >> 8 & 0xff;
      other.time_s = recording.tick_length().seconds_at(ordered.tick());
    }
    if (drives_otherwise[robot] == 0) ++other.robots;
    drives_otherwise[robot] = 1;
  };
  while (ordered.next()) {
    for (const Event& event : sorted(ordered.records().events, ordered.tick(), recording.tick_length())) {
      if (event.record->kind() != proto::MOTION) continue;
      compare(event);
      const char* const motion = motion_of(value_of(event));
      if (last[event.robot()] == motion) continue;
      last[event.robot()] = motion;
      table->text(run);
      table->integer(event.robot());
      table->time(ordered.tick(), recording.tick_length());
      table->text(motion);
      table->end_row();
    }
  }
  table->close();
  return {table->rows(), other};
}

}  // namespace kilotwin::recorder
