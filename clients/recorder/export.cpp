#include "clients/recorder/export.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <string>
#include <vector>

#include "core/base/error.hpp"
#include "core/base/ids.hpp"
#include "core/csv/csv_writer.hpp"

namespace kilotwin::recorder {
namespace {

/// Longest text of a row's numbers after its time: id, pose and LED.
constexpr std::size_t kLongestNumbers = 84;

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

/// ",GROUP," per robot; groups are numbered in the experiment's order.
std::vector<std::string> group_cells(const proto::RecordingHeader& header) {
  std::vector<std::string> cells;
  for (int group = 0; group < header.group_robots_size(); ++group)
    cells.insert(cells.end(), header.group_robots(group), fmt::format(",{},", group));
  cells.resize(header.robots(), ",0,");
  return cells;
}

/// Appends "-12.3450": value (|value| < 1e9) rounded to `decimals` places. Never "-0.0000".
template <int decimals> char* put_fixed(char* to, double value) {
  constexpr std::int64_t kUnit = [] {
    std::int64_t unit = 1;
    for (int i = 0; i < decimals; ++i) unit *= 10;
    return unit;
  }();
  const double scaled = value * static_cast<double>(kUnit);
  auto units = static_cast<std::int64_t>(scaled + (scaled < 0 ? -0.5 : 0.5));
  if (units < 0) {
    *to++ = '-';
    units = -units;
  }
  to = std::to_chars(to, to + 24, units / kUnit).ptr;
  *to++ = '.';
  std::int64_t fraction = units % kUnit;
  for (int i = decimals - 1; i >= 0; --i) {
    to[i] = static_cast<char>('0' + fraction % 10);
    fraction /= 10;
  }
  return to + decimals;
}

/// Exact simulated time of a tick in s: multiples of 125 ns, without trailing zeros.
std::string exact_seconds(Tick tick, TickLength length) {
  __extension__ using Wide = unsigned __int128;
  const Wide ns = static_cast<Wide>(tick.count()) * length.cycles() * 125;
  const auto seconds = static_cast<std::uint64_t>(ns / 1'000'000'000);
  std::string text = fmt::format("{}.{:09}", seconds, static_cast<std::uint64_t>(ns % 1'000'000'000));
  while (text.back() == '0') text.pop_back();
  if (text.back() == '.') text.pop_back();
  return text;
}

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

std::uint64_t append_rows(std::string& text, const proto::StateRecord& state, const std::string& time, Poses which,
                          const std::vector<std::string>& groups, const std::array<std::string, 256>& states) {
  const bool measured = which == Poses::kMeasured && state.measured_x_mm_size() == state.x_mm_size();
  const auto robots = static_cast<std::size_t>(state.x_mm_size());
  for (std::size_t i = 0; i < robots; ++i) {
    const int at = static_cast<int>(i);
    char numbers[kLongestNumbers];
    char* to = numbers;
    *to++ = ',';
    to = std::to_chars(to, to + 12, i).ptr;
    *to++ = ',';
    to = put_fixed<4>(to, measured ? state.measured_x_mm(at) : state.x_mm(at));
    *to++ = ',';
    to = put_fixed<4>(to, measured ? state.measured_y_mm(at) : state.y_mm(at));
    *to++ = ',';
    to = put_fixed<6>(to, measured ? state.measured_heading_rad(at) : state.heading_rad(at));
    const auto led = static_cast<unsigned char>(state.led()[i]);
    for (int channel = 0; channel < 3; ++channel) {
      *to++ = ',';
      *to++ = static_cast<char>('0' + (led >> 2 * channel & 3));
    }
    text += time;
    text.append(numbers, static_cast<std::size_t>(to - numbers));
    text += groups[i];
    text += states[static_cast<unsigned char>(state.life_cycle()[i])];
    text += '\n';
  }
  return robots;
}

std::uint64_t append_body_rows(std::string& text, const proto::StateRecord& state, const std::string& time) {
  for (int i = 0; i < state.movable_x_mm_size(); ++i) {
    char number[80];
    char* to = put_fixed<4>(number, state.movable_x_mm(i));
    *to++ = ',';
    to = put_fixed<4>(to, state.movable_y_mm(i));
    *to++ = ',';
    to = put_fixed<6>(to, state.movable_heading_rad(i));
    text += fmt::format("{},{},{}\n", time, i, std::string_view(number, static_cast<std::size_t>(to - number)));
  }
  return static_cast<std::uint64_t>(state.movable_x_mm_size());
}

/// Writes the rows of the scheduled states; `append` adds the rows of one state and returns their number.
template <class Append>
std::uint64_t export_states(Reader& recording, const std::filesystem::path& csv, double every_s,
                            const char* columns, Append append) {
  if (!(every_s >= 1e-3 && every_s <= 1e9)) {
    throw UserError(fmt::format("--every {}: out of range; expected 0.001 to 1e9 seconds", every_s));
  }
  const RecordingSchedule wanted(recording.tick_length(), every_s);
  check_interval(recording, wanted, every_s);
  CsvWriter output(csv, columns);
  Tick next = wanted.at_or_after(Tick{recording.header().first_tick()});
  std::uint64_t rows = 0;
  while (const proto::StateRecord* state = recording.next_state()) {
    const Tick tick{state->tick()};
    if (tick < next) continue;
    rows += append(output.rows(), *state, exact_seconds(tick, recording.tick_length()));
    output.flush_if_long();
    next = wanted.at_or_after(tick + 1);
  }
  output.close();
  return rows;
}

}  // namespace

std::uint64_t export_trajectories(Reader& recording, const std::filesystem::path& csv, double every_s,
                                  Poses which) {
  const std::vector<std::string> groups = group_cells(recording.header());
  std::array<std::string, 256> states;
  for (std::size_t code = 0; code < states.size(); ++code)
    states[code] = state_name(static_cast<std::uint8_t>(code));
  return export_states(recording, csv, every_s, kTrajectoryColumns.data(),
                       [&](std::string& text, const proto::StateRecord& state, const std::string& time) {
                         return append_rows(text, state, time, which, groups, states);
                       });
}

std::uint64_t export_bodies(Reader& recording, const std::filesystem::path& csv, double every_s) {
  if (recording.header().movable_size() == 0) {
    throw UserError(fmt::format("{}: no movable bodies; the experiment names none", recording.path().string()));
  }
  return export_states(recording, csv, every_s, "time_s,body,x_mm,y_mm,heading_rad", append_body_rows);
}

std::uint64_t export_messages(Reader& recording, const std::filesystem::path& csv) {
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
  CsvWriter output(csv, kMessageColumns);
  std::uint64_t written = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (i + 1 < rows.size() && pair(rows[i]) == pair(rows[i + 1])) continue;
    fmt::format_to(std::back_inserter(output.rows()), "{},{},{},{}\n", rows[i].receiver, rows[i].sender,
                   rows[i].count, rows[i].receiver == rows[i].sender ? 1 : 0);
    output.flush_if_long();
    ++written;
  }
  output.close();
  return written;
}

std::uint64_t export_radio(Reader& recording, const std::filesystem::path& csv) {
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
  CsvWriter output(csv, "robot,attempted,sent,received,collided,backed_off");
  for (int i = 0; i < radio.attempted_size(); ++i) {
    fmt::format_to(std::back_inserter(output.rows()), "{},{},{},{},{},{}\n", i, radio.attempted(i), radio.sent(i),
                   radio.received(i), radio.collided(i), radio.backed_off(i));
    output.flush_if_long();
  }
  output.close();
  return static_cast<std::uint64_t>(radio.attempted_size());
}

}  // namespace kilotwin::recorder
