#include "clients/recorder/export.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string>
#include <vector>

#include "clients/recorder/file.hpp"
#include "core/base/error.hpp"

namespace kilotwin::recorder {
namespace {

constexpr std::size_t kWriteAbove_bytes = 1 << 20;

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

/// Simulated time of a tick in s without rounding: cycles of 125 ns, zeros at the end left out.
std::string exact_seconds(Tick tick, TickLength length) {
  __extension__ using Wide = unsigned __int128;
  const Wide ns = static_cast<Wide>(tick.count()) * length.cycles() * 125;
  const auto seconds = static_cast<std::uint64_t>(ns / 1'000'000'000);
  std::string text = fmt::format("{}.{:09}", seconds, static_cast<std::uint64_t>(ns % 1'000'000'000));
  while (text.back() == '0') text.pop_back();
  if (text.back() == '.') text.pop_back();
  return text;
}

/// A readable multiple of the recorded interval, the nearest to what was asked for.
std::string suggested_interval(double recorded_s, double asked_s) {
  return fmt::format("{:.10g}", recorded_s * std::max(1.0, std::round(asked_s / recorded_s)));
}

/// Whether the recording's schedule has a state within one tick after each wanted time. Both repeat, so that a
/// thousand of them tell.
void check_interval(const Reader& recording, const RecordingSchedule& wanted, double every_s) {
  const double recorded_s = recording.header().every_s();
  const RecordingSchedule recorded(recording.tick_length(), recorded_s);
  for (std::int64_t number = 1; number <= 1000; ++number) {
    const Tick tick = wanted.tick(number);
    if (recorded.at_or_after(tick) - tick <= 1) continue;
    throw UserError(fmt::format(
        "--every {:.10g}: no multiple of the recorded interval; {} holds a state every {:.10g} s, so take {}",
        every_s, recording.path().string(), recorded_s, suggested_interval(recorded_s, every_s)));
  }
}

std::uint64_t append_rows(std::string& text, const proto::StateRecord& state, const std::string& time,
                          Poses which) {
  const bool measured = which == Poses::kMeasured && state.measured_x_mm_size() == state.x_mm_size() &&
                        state.measured_y_mm_size() == state.x_mm_size() &&
                        state.measured_heading_rad_size() == state.x_mm_size();
  constexpr std::size_t kLongestNumbers = 80;
  const auto robots = static_cast<std::size_t>(state.x_mm_size());
  const std::size_t start = text.size();
  text.resize(start + robots * (time.size() + kLongestNumbers));
  char* to = text.data() + start;
  for (std::size_t i = 0; i < robots; ++i) {
    const int at = static_cast<int>(i);
    to = std::copy(time.begin(), time.end(), to);
    *to++ = ',';
    to = std::to_chars(to, to + 12, i).ptr;
    *to++ = ',';
    to = put_fixed<4>(to, measured ? state.measured_x_mm(at) : state.x_mm(at));
    *to++ = ',';
    to = put_fixed<4>(to, measured ? state.measured_y_mm(at) : state.y_mm(at));
    *to++ = ',';
    to = put_fixed<6>(to, measured ? state.measured_heading_rad(at) : state.heading_rad(at));
    *to++ = ',';
    const auto led = static_cast<unsigned char>(state.led()[i]);
    for (int channel = 0; channel < 3; ++channel) *to++ = static_cast<char>('0' + (led >> 2 * channel & 3));
    *to++ = '\n';
  }
  text.resize(static_cast<std::size_t>(to - text.data()));
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

/// Rows of the states that are wanted; `append` adds those of one state and says how many.
template <class Append>
std::uint64_t export_states(Reader& recording, const std::filesystem::path& csv, double every_s,
                            const char* columns, Append append) {
  if (!(every_s >= 1e-3 && every_s <= 1e9)) {
    throw UserError(fmt::format("--every {}: out of range; expected 0.001 to 1e9 seconds", every_s));
  }
  const RecordingSchedule wanted(recording.tick_length(), every_s);
  check_interval(recording, wanted, every_s);
  OutputFile output(csv, OutputFile::Existing::kReplace);
  output.buffer() = columns;
  Tick next = wanted.at_or_after(Tick{recording.header().first_tick()});
  std::uint64_t rows = 0;
  while (const proto::StateRecord* state = recording.next_state()) {
    const Tick tick{state->tick()};
    if (tick < next) continue;
    rows += append(output.buffer(), *state, exact_seconds(tick, recording.tick_length()));
    output.flush_if_above(kWriteAbove_bytes);
    next = wanted.at_or_after(tick + 1);
  }
  output.close();
  return rows;
}

}  // namespace

std::uint64_t export_trajectories(Reader& recording, const std::filesystem::path& csv, double every_s,
                                  Poses which) {
  return export_states(recording, csv, every_s, "time_s,robot,x_mm,y_mm,heading_rad,led\n",
                       [which](std::string& text, const proto::StateRecord& state, const std::string& time) {
                         return append_rows(text, state, time, which);
                       });
}

std::uint64_t export_bodies(Reader& recording, const std::filesystem::path& csv, double every_s) {
  if (recording.header().movable_size() == 0) {
    throw UserError(fmt::format("{}: no movable bodies; the experiment names none", recording.path().string()));
  }
  return export_states(recording, csv, every_s, "time_s,body,x_mm,y_mm,heading_rad\n", append_body_rows);
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
  // Of several counts of a pair the last one holds: equal pairs keep their order, and the last is printed.
  const auto pair = [](const Row& row) { return std::pair(row.receiver, row.sender); };
  std::stable_sort(rows.begin(), rows.end(), [&](const Row& a, const Row& b) { return pair(a) < pair(b); });
  OutputFile output(csv, OutputFile::Existing::kReplace);
  output.buffer() = "receiver,sender,count\n";
  std::uint64_t written = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (i + 1 < rows.size() && pair(rows[i]) == pair(rows[i + 1])) continue;
    fmt::format_to(std::back_inserter(output.buffer()), "{},{},{}\n", rows[i].receiver, rows[i].sender,
                   rows[i].count);
    output.flush_if_above(kWriteAbove_bytes);
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
  OutputFile output(csv, OutputFile::Existing::kReplace);
  output.buffer() = "robot,attempted,sent,received,collided,backed_off\n";
  for (int i = 0; i < radio.attempted_size(); ++i) {
    fmt::format_to(std::back_inserter(output.buffer()), "{},{},{},{},{},{}\n", i, radio.attempted(i), radio.sent(i),
                   radio.received(i), radio.collided(i), radio.backed_off(i));
    output.flush_if_above(kWriteAbove_bytes);
  }
  output.close();
  return static_cast<std::uint64_t>(radio.attempted_size());
}

}  // namespace kilotwin::recorder
