#include "clients/mcap/export_mcap.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <string>

#include "clients/foxglove/topics.hpp"
#include "clients/mcap/mcap_writer.hpp"
#include "clients/mcap/printed_lines.hpp"
#include "core/base/error.hpp"

namespace kilotwin::mcap {
namespace {

World world_of(const proto::RecordingHeader& header) {
  proto::Experiment experiment;
  if (header.has_arena()) {
    *experiment.mutable_arena() = header.arena();
  } else {
    experiment.mutable_arena()->set_width_mm(header.arena_width_mm());
    experiment.mutable_arena()->set_height_mm(header.arena_height_mm());
  }
  *experiment.mutable_obstacle() = header.obstacle();
  *experiment.mutable_movable() = header.movable();
  return World(experiment);
}

/// Channels of the file.
class FileSink final : public foxglove::Sink {
 public:
  explicit FileSink(const std::filesystem::path& file) : out_(file, "kilotwin") {}
  [[nodiscard]] std::uint16_t add_channel(std::string_view topic, std::string_view schema_name,
                                          std::string_view schema, std::size_t) override {
    return out_.add_channel(out_.add_schema(schema_name, "protobuf", schema), topic, "protobuf");
  }
  void write(std::uint16_t channel, Time_ns time, std::string_view message) override {
    out_.write(channel, time, message);
  }
  void close() { out_.close(); }

 private:
  McapWriter out_;
};

std::span<const std::uint8_t> octets(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

std::span<const double> numbers(const google::protobuf::RepeatedField<double>& field) {
  return {field.data(), static_cast<std::size_t>(field.size())};
}

/// Writes the topics.
class Exporter {
 public:
  Exporter(const recorder::Reader& recording, const std::filesystem::path& file)
      : length_(recording.tick_length()),
        variables_(recording.header().variable().begin(), recording.header().variable().end()),
        printed_(recording.path().parent_path(), recording.header().robots()),
        sink_(file),
        topics_(sink_, world_of(recording.header())) {}

  void state(const proto::StateRecord& record) {
    ++states_;
    printed_before(length_.seconds_at(Tick{record.tick()}));
    foxglove::State state;
    state.time = time_of(record.tick());
    state.x_mm = numbers(record.x_mm());
    state.y_mm = numbers(record.y_mm());
    state.heading_rad = numbers(record.heading_rad());
    state.led = octets(record.led());
    state.life_cycle = octets(record.life_cycle());
    state.movable_x_mm = numbers(record.movable_x_mm());
    state.movable_y_mm = numbers(record.movable_y_mm());
    state.movable_heading_rad = numbers(record.movable_heading_rad());
    topics_.state(state);
  }

  void variable(const proto::VariableRecord& record) {
    const proto::VariableColumn& column = variables_.at(record.variable());
    const std::vector<double> value = column.integer()
                                          ? std::vector<double>(record.integer().begin(), record.integer().end())
                                          : std::vector<double>(record.number().begin(), record.number().end());
    topics_.variable(time_of(record.tick()), column.name(),
                     {record.robot().data(), static_cast<std::size_t>(record.robot_size())}, value);
  }

  void input(const proto::InputRecord& input) {
    topics_.log(time_of(input.tick()), foxglove::Topics::Level::kInfo,
                fmt::format("input {}: {}", input.sequence_number(), proto::InputRecord::Kind_Name(input.kind())));
  }

  void end(const proto::EndRecord& end) {
    const bool failed = !end.failure().empty();
    topics_.log(time_of(end.tick()), failed ? foxglove::Topics::Level::kError : foxglove::Topics::Level::kInfo,
                failed ? end.failure() : fmt::format("end of the run, state hash {:016x}", end.state_hash()));
  }

  std::uint64_t close() {
    printed_before(std::numeric_limits<double>::infinity());
    sink_.close();
    return states_;
  }

 private:
  [[nodiscard]] Time_ns time_of(std::int64_t tick) const {
    return static_cast<Time_ns>(std::llround(length_.seconds_at(Tick{tick}) * 1e9));
  }

  void printed_before(double end_s) {
    while (const PrintedLines::Line* const line = printed_.next_before(end_s))
      topics_.log(static_cast<Time_ns>(std::llround(std::max(0.0, line->time_s) * 1e9)),
                  foxglove::Topics::Level::kInfo, line->text, fmt::format("robot {}", line->robot));
  }

  const TickLength length_;
  const std::vector<proto::VariableColumn> variables_;
  PrintedLines printed_;
  FileSink sink_;
  foxglove::Topics topics_;
  std::uint64_t states_ = 0;
};

}  // namespace

std::uint64_t export_mcap(recorder::Reader& recording, const std::filesystem::path& file, double every_s) {
  if (!(every_s >= 0.001)) throw UserError(fmt::format("--every {}: expected a time of at least 0.001 s", every_s));
  const recorder::RecordingSchedule schedule(recording.tick_length(), every_s);
  Exporter exporter(recording, file);
  Tick due{0};
  while (const proto::Record* const record = recording.next()) {
    if (record->has_state() && Tick{record->state().tick()} >= due) {
      exporter.state(record->state());
      due = schedule.at_or_after(Tick{record->state().tick()} + 1);
    }
    if (record->has_variable()) exporter.variable(record->variable());
    if (record->has_input()) exporter.input(record->input());
    if (record->has_end()) exporter.end(record->end());
  }
  const std::uint64_t states = exporter.close();
  if (states == 0) throw UserError(fmt::format("{}: has no state", recording.path().string()));
  return states;
}

}  // namespace kilotwin::mcap
