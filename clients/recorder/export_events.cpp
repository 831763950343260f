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

template <class... Cells> void put_integers(Table& table, bool there, Cells... cells) {
  (..., (there ? table.integer(static_cast<std::int64_t>(cells)) : table.missing()));
}

void put_row(Table& table, const Event& event, const std::vector<std::uint32_t>& groups) {
  const proto::EventRecord& record = *event.record;
  const proto::RecordedEvent kind = record.kind();
  const std::uint32_t value = record.value_size() == 0 ? 0 : record.value(event.index);
  table.time(Tick{event.cycles}, TickLength{1});
  table.text(name_of(kind));
  put_integers(table, kind != proto::STATION, event.robot(), groups[event.robot()]);
  put_integers(table, kind == proto::LED, value & 3, value >> 2 & 3, value >> 4 & 3);
  put_integers(table, kind == proto::MOTION, value & 0xff, value >> 8 & 0xff);
  if (kind == proto::STATE)
    table.text(state_name(static_cast<std::uint8_t>(value)));
  else
    table.missing();
  if (kind == proto::RECEIVED) {
    table.integer(record.sender(event.index));
    table.number(static_cast<double>(record.distance_mm(event.index)));
  } else {
    table.missing();
    table.missing();
  }
  if (record.text_size() != 0)
    table.text(record.text(event.index));
  else
    table.missing();
  table.end_row();
}

const char* motion_of(std::uint32_t value) {
  const bool left = (value & 0xff) != 0, right = (value >> 8 & 0xff) != 0;
  return left && right ? "straight" : left ? "left" : right ? "right" : "stop";
}

}  // namespace

std::uint64_t export_events(Reader& recording, const std::filesystem::path& file, const TableMetadata& metadata) {
  std::vector<Column> columns{{"time_s", "s", CellType::kTime}, {"event", "", CellType::kText}};
  for (const char* name : {"robot", "group", "led_r", "led_g", "led_b", "motor_left", "motor_right"})
    columns.push_back({name, "", CellType::kInteger});
  columns.push_back({"state", "", CellType::kText});
  columns.push_back({"sender", "", CellType::kInteger});
  columns.push_back({"distance_mm", "mm", CellType::kNumber, 3});
  columns.push_back({"text", "", CellType::kText});
  const std::vector<std::uint32_t> groups = groups_of(recording.header());
  const auto table = open_table(file, std::move(columns), metadata);
  OrderedRecords ordered(recording, OrderedRecords::kEvents);
  while (ordered.next()) {
    for (const Event& event : sorted(ordered.records().events, ordered.tick(), recording.tick_length()))
      put_row(*table, event, groups);
  }
  table->close();
  return table->rows();
}

std::uint64_t export_commands(Reader& recording, const std::filesystem::path& file, const TableMetadata& metadata) {
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
  OrderedRecords ordered(recording, OrderedRecords::kEvents);
  while (ordered.next()) {
    for (const Event& event : sorted(ordered.records().events, ordered.tick(), recording.tick_length())) {
      if (event.record->kind() != proto::MOTION) continue;
      const char* const motion = motion_of(event.record->value(event.index));
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
  return table->rows();
}

}  // namespace kilotwin::recorder
