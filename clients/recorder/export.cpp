#include "clients/recorder/export.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "clients/recorder/latest_variables.hpp"
#include "clients/recorder/ordered_records.hpp"
#include "core/base/error.hpp"
#include "core/base/ids.hpp"
#include "core/observations/variable_sampler.hpp"

namespace kilotwin::recorder {
namespace {

/// The multiple of the recorded interval that is nearest to `requested_s`.
std::string suggested_interval(double recorded_s, double requested_s) {
  return fmt::format("{:.10g}", recorded_s * std::max(1.0, std::round(requested_s / recorded_s)));
}

/// Throws UserError if the recording's schedule has no state within one tick after a time of the export. Both schedules are
/// periodic, so a thousand times suffice.
void check_interval(const Reader& recording, const RecordingSchedule& wanted, double every_s) {
  const double recorded_s = recording.header().every_s();
  const RecordingSchedule recorded(recording.tick_length(), recorded_s);
  for (std::int64_t number = 1; number <= 1000; ++number) {
    const Tick tick = wanted.tick(number);
    if (recorded.at_or_after(tick) - tick <= 1) continue;
    throw UserError(fmt::format(
        "--every {:.10g}: not a multiple of the recorded interval; {} holds a state every {:.10g} s, so take {}",
        every_s, recording.path().string(), recorded_s, suggested_interval(recorded_s, every_s)));
  }
}

void append_rows(Table& table, const proto::StateRecord& state, Tick tick, TickLength length, Poses which,
                 const std::vector<std::uint32_t>& groups, const std::array<std::string, 256>& states,
                 const LatestVariables& variables) {
  const bool measured = which == Poses::kMeasured && state.measured_x_mm_size() == state.x_mm_size();
  const auto robots = static_cast<std::size_t>(state.x_mm_size());
  for (std::size_t i = 0; i < robots; ++i) {
    const int at = static_cast<int>(i);
    table.time(tick, length);
    table.integer(at);
    table.number(measured ? state.measured_x_mm(at) : state.x_mm(at));
    table.number(measured ? state.measured_y_mm(at) : state.y_mm(at));
    table.number(measured ? state.measured_heading_rad(at) : state.heading_rad(at));
    const auto led = static_cast<unsigned char>(state.led()[i]);
    for (int channel = 0; channel < 3; ++channel) table.integer(led >> 2 * channel & 3);
    table.integer(groups[i]);
    const auto life_cycle = static_cast<std::uint8_t>(state.life_cycle()[i]);
    table.text(states[life_cycle]);
    table.integer(life_cycle == static_cast<std::uint8_t>(LifeCycle::kFailed) ? 1 : 0);
    variables.put(table, i);
    table.end_row();
  }
}

void append_body_rows(Table& table, const proto::StateRecord& state, Tick tick, TickLength length) {
  for (int i = 0; i < state.movable_x_mm_size(); ++i) {
    table.time(tick, length);
    table.integer(i);
    table.number(state.movable_x_mm(i));
    table.number(state.movable_y_mm(i));
    table.number(state.movable_heading_rad(i));
    table.end_row();
  }
}

/// Calls `take` with each recorded state, by time, after `variables` has taken all values until then.
template <class Take> void each_state(Reader& recording, LatestVariables& variables, Take take) {
  if (variables.empty()) {
    while (const proto::StateRecord* state = recording.next_state()) take(*state);
    return;
  }
  OrderedRecords ordered(recording, OrderedRecords::kStates | OrderedRecords::kVariables);
  while (ordered.next()) {
    variables.take(ordered.records().variables);
    if (ordered.records().state) take(*ordered.records().state);
  }
}

/// Writes the rows of the scheduled states; `append` adds the rows of one state. The columns of `variables` follow `columns`.
template <class Append>
std::uint64_t export_states(Reader& recording, const std::filesystem::path& file, double every_s,
                            std::vector<Column> columns, LatestVariables variables, const TableMetadata& metadata,
                            Append append) {
  if (!(every_s >= 1e-3 && every_s <= 1e9)) {
    throw UserError(fmt::format("--every {}: out of range; expected 0.001 to 1e9 seconds", every_s));
  }
  const RecordingSchedule wanted(recording.tick_length(), every_s);
  check_interval(recording, wanted, every_s);
  for (Column& column : variables.columns()) columns.push_back(std::move(column));
  const auto table = open_table(file, std::move(columns), metadata);
  Tick next = wanted.at_or_after(Tick{recording.header().first_tick()});
  each_state(recording, variables, [&](const proto::StateRecord& state) {
    const Tick tick{state.tick()};
    if (tick < next) return;
    append(*table, state, tick, variables);
    next = wanted.at_or_after(tick + 1);
  });
  table->close();
  return table->rows();
}

/// The recorded variables that `wanted` accepts by their names.
template <class Wanted> LatestVariables variables_of(const proto::RecordingHeader& header, Wanted wanted) {
  std::vector<std::size_t> chosen;
  for (int i = 0; i < header.variable_size(); ++i) {
    if (wanted(header.variable(i).name())) chosen.push_back(static_cast<std::size_t>(i));
  }
  return {header, std::move(chosen)};
}

const Column kTime{"time_s", "s", CellType::kTime};
const Column kX{"x_mm", "mm", CellType::kNumber, 4}, kY{"y_mm", "mm", CellType::kNumber, 4},
    kHeading{"heading_rad", "rad", CellType::kNumber, 6};

}  // namespace

std::string state_name(std::uint8_t life_cycle) {
  switch (static_cast<LifeCycle>(life_cycle)) {
    case LifeCycle::kSleeping: return "sleeping";
    case LifeCycle::kIdle: return "idle";
    case LifeCycle::kBattery: return "battery";
    case LifeCycle::kSetup: return "setup";
    case LifeCycle::kRunning: return "running";
    case LifeCycle::kCharging: return "charging";
    case LifeCycle::kMoving: return "moving";
    case LifeCycle::kAbsent: return "absent";
    case LifeCycle::kFlat: return "flat";
    case LifeCycle::kFailed: return "failed";
  }
  return fmt::format("{}", life_cycle);
}

std::vector<std::uint32_t> groups_of(const proto::RecordingHeader& header) {
  std::vector<std::uint32_t> groups;
  for (int group = 0; group < header.group_robots_size(); ++group) {
    const std::size_t room = header.robots() - std::min<std::size_t>(groups.size(), header.robots());
    groups.insert(groups.end(), std::min<std::size_t>(room, header.group_robots(group)),
                  static_cast<std::uint32_t>(group));
  }
  groups.resize(header.robots(), 0);
  return groups;
}

std::uint64_t export_trajectories(Reader& recording, const std::filesystem::path& file, double every_s, Poses which,
                                  const TableMetadata& metadata) {
  const std::vector<std::uint32_t> groups = groups_of(recording.header());
  std::array<std::string, 256> states;
  for (std::size_t code = 0; code < states.size(); ++code)
    states[code] = state_name(static_cast<std::uint8_t>(code));
  const std::vector<Column> columns{kTime,
                                    {"robot", "", CellType::kInteger},
                                    kX,
                                    kY,
                                    kHeading,
                                    {"led_r", "", CellType::kInteger},
                                    {"led_g", "", CellType::kInteger},
                                    {"led_b", "", CellType::kInteger},
                                    {"group", "", CellType::kInteger},
                                    {"state", "", CellType::kText},
                                    {"failed", "", CellType::kInteger}};
  const auto is_battery = [](const std::string& name) { return name == kBatteryVariable; };
  return export_states(
      recording, file, every_s, columns, variables_of(recording.header(), is_battery), metadata,
      [&](Table& table, const proto::StateRecord& state, Tick tick, const LatestVariables& variables) {
        append_rows(table, state, tick, recording.tick_length(), which, groups, states, variables);
      });
}

std::uint64_t export_pogosim(Reader& recording, const std::filesystem::path& file, double every_s,
                             const TableMetadata& metadata) {
  const proto::RecordingHeader& header = recording.header();
  const std::vector<std::uint32_t> groups = groups_of(header);
  const auto category = [&](std::uint32_t group) {
    return header.group_robots_size() < 2 ? std::string("robots") : fmt::format("robots-{}", group);
  };
  const double corner_x = header.arena_width_mm() / 2, corner_y = header.arena_height_mm() / 2;
  const std::vector<Column> columns{
      {"time", "s", CellType::kTime},           {"robot_category", "", CellType::kText},
      {"robot_id", "", CellType::kInteger},     {"x", "mm", CellType::kNumber, 4},
      {"y", "mm", CellType::kNumber, 4},        {"angle", "rad", CellType::kNumber, 6},
      {"pogobot_ticks", "", CellType::kInteger}};
  for (const proto::VariableColumn& variable : header.variable()) {
    if (std::any_of(columns.begin(), columns.end(), [&](const Column& own) { return own.name == variable.name(); }))
      throw UserError(
          fmt::format("--pogosim: the recorded variable {} has the name of a column of pogosim's tables; rename "
                      "it in the program, or take --variables",
                      variable.name()));
  }
  TableMetadata about = metadata;
  about.emplace_back("arena_width_mm", fmt::format("{}", header.arena_width_mm()));
  about.emplace_back("arena_height_mm", fmt::format("{}", header.arena_height_mm()));
  return export_states(
      recording, file, every_s, columns, variables_of(header, [](const std::string&) { return true; }), about,
      [&](Table& table, const proto::StateRecord& state, Tick tick, const LatestVariables& variables) {
        for (int i = 0; i < state.x_mm_size(); ++i) {
          const auto robot = static_cast<std::size_t>(i);
          table.time(tick, recording.tick_length());
          table.text(category(groups[robot]));
          table.integer(i);
          table.number(state.x_mm(i) + corner_x);
          table.number(state.y_mm(i) + corner_y);
          table.number(state.heading_rad(i));
          table.integer(tick.count());
          variables.put(table, robot);
          table.end_row();
        }
      });
}

std::uint64_t export_bodies(Reader& recording, const std::filesystem::path& file, double every_s,
                            const TableMetadata& metadata) {
  if (recording.header().movable_size() == 0) {
    throw UserError(fmt::format("{}: no movable bodies; the experiment names none", recording.path().string()));
  }
  return export_states(recording, file, every_s, {kTime, {"body", "", CellType::kInteger}, kX, kY, kHeading},
                       LatestVariables(recording.header(), {}), metadata,
                       [&](Table& table, const proto::StateRecord& state, Tick tick, const LatestVariables&) {
                         append_body_rows(table, state, tick, recording.tick_length());
                       });
}

std::uint64_t export_messages(Reader& recording, const std::filesystem::path& file, const TableMetadata& metadata) {
  const auto refuse = [&](std::string_view why) {
    return UserError(fmt::format("{}: no message counts; {}", recording.path().string(), why));
  };
  if (!recording.header().messages()) throw refuse("run again with --set recording.messages=true");
  struct Row {
    std::uint32_t receiver, sender, count;
  };
  std::vector<Row> rows;
  bool found = false;
  while (const proto::Record* record = recording.next()) {
    if (!record->has_messages()) continue;
    found = true;
    const proto::MessagesRecord& messages = record->messages();
    for (int i = 0; i < messages.receiver_size(); ++i) {
      rows.push_back({messages.receiver(i), messages.sender(i), messages.count(i)});
    }
  }
  if (!found) throw refuse("the run did not come to the end where it writes them");
  // The last of several counts of a pair holds. Sorting keeps the order of equal pairs, so the last one is printed.
  const auto pair = [](const Row& row) { return std::pair(row.receiver, row.sender); };
  std::stable_sort(rows.begin(), rows.end(), [&](const Row& a, const Row& b) { return pair(a) < pair(b); });
  const auto table = open_table(file,
                                {{"receiver", "", CellType::kInteger},
                                 {"sender", "", CellType::kInteger},
                                 {"count", "", CellType::kInteger},
                                 {"sent_if_receiver_is_sender", "", CellType::kInteger}},
                                metadata);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (i + 1 < rows.size() && pair(rows[i]) == pair(rows[i + 1])) continue;
    for (const std::uint32_t cell : {rows[i].receiver, rows[i].sender, rows[i].count}) table->integer(cell);
    table->integer(rows[i].receiver == rows[i].sender ? 1 : 0);
    table->end_row();
  }
  table->close();
  return table->rows();
}

std::uint64_t export_radio(Reader& recording, const std::filesystem::path& file, const TableMetadata& metadata) {
  proto::RadioRecord radio;
  bool found = false;
  while (const proto::Record* record = recording.next()) {
    if (!record->has_radio()) continue;
    found = true;
    radio = record->radio();
  }
  if (!found) {
    throw UserError(
        fmt::format("{}: no counts of the robots' radios; the run did not come to the end where it writes them",
                    recording.path().string()));
  }
  std::vector<Column> columns;
  for (const char* name : {"robot", "attempted", "sent", "received", "collided", "backed_off"})
    columns.push_back({name, "", CellType::kInteger});
  const auto table = open_table(file, std::move(columns), metadata);
  for (int i = 0; i < radio.attempted_size(); ++i) {
    table->integer(i);
    for (const std::uint32_t count :
         {radio.attempted(i), radio.sent(i), radio.received(i), radio.collided(i), radio.backed_off(i)})
      table->integer(count);
    table->end_row();
  }
  table->close();
  return table->rows();
}

}  // namespace kilotwin::recorder
