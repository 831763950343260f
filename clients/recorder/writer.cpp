#include "clients/recorder/writer.hpp"

#include <time.h>
#include <zlib.h>

#include <utility>

#include "core/base/error.hpp"

namespace kilotwin::recorder {
namespace {

/// Half of the promised second: a record shortly after a flush waits for the next call.
constexpr std::int64_t kFlushEvery_ns = 500'000'000;
/// Hashes in one record.
constexpr int kHashesPerRecord = 4096;
/// The promised 256 KiB minus the hashes that may be in the buffer.
constexpr std::size_t kMostUnflushed_bytes = 256 * 1024 - kHashesPerRecord * sizeof(std::uint64_t);

/// Wall time. The coarse clock, with a resolution of about 4 ms, costs 5 ns per call, which matters in runs of a few robots.
std::int64_t now_ns() {
  timespec t{};
  ::clock_gettime(CLOCK_MONOTONIC_COARSE, &t);
  return static_cast<std::int64_t>(t.tv_sec) * 1'000'000'000 + t.tv_nsec;
}

void put_u32(char* to, std::uint32_t value) {
  for (int i = 0; i < 4; ++i) to[i] = static_cast<char>(value >> 8 * i & 0xffu);
}

void assign(google::protobuf::RepeatedField<double>* field, std::span<const double> values) {
  field->Clear();
  field->Add(values.begin(), values.end());
}

void assign(std::string* field, std::span<const std::uint8_t> values) {
  field->assign(values.begin(), values.end());
}

}  // namespace

Writer::Writer(std::filesystem::path file, const proto::RecordingHeader& header)
    : output_(std::move(file), os::OutputFile::Existing::kRefuse),
      robots_(header.robots()),
      movables_(static_cast<std::size_t>(header.movable_size())),
      last_state_(header.first_tick() - 1),
      last_hash_(header.first_tick() - 1) {
  *other_.mutable_header() = header;
  append(other_);
  flush();
}

void Writer::append(const proto::Record& record) {
  const std::size_t length = record.ByteSizeLong();
  KILOTWIN_DEMAND(length <= kLongestRecord_bytes);
  std::string& buffer = output_.buffer();
  const std::size_t start = buffer.size();
  buffer.resize(start + kFramePrefix_bytes + length);
  char* const frame = buffer.data() + start;
  auto* const body = reinterpret_cast<std::uint8_t*>(frame + kFramePrefix_bytes);
  record.SerializeWithCachedSizesToArray(body);
  put_u32(frame, static_cast<std::uint32_t>(length));
  put_u32(frame + 4, static_cast<std::uint32_t>(::crc32_z(0, body, length)));
  put_u32(frame + 8, static_cast<std::uint32_t>(::crc32_z(0, reinterpret_cast<std::uint8_t*>(frame), 8)));
  bytes_ += kFramePrefix_bytes + length;
}

void Writer::append_hashes() {
  if (hashes_.hash().chain_size() == 0) return;
  append(hashes_);
  hashes_.mutable_hash()->mutable_chain()->Clear();
}

void Writer::state(const StateView& state) {
  if (state.tick.count() <= last_state_) return;
  KILOTWIN_DEMAND(state.x_mm.size() == robots_ && state.y_mm.size() == robots_ &&
                  state.heading_rad.size() == robots_ && state.led.size() == robots_ &&
                  state.life_cycle.size() == robots_ && state.movable_x_mm.size() == movables_ &&
                  state.movable_y_mm.size() == movables_ && state.movable_heading_rad.size() == movables_ &&
                  state.measured_y_mm.size() == state.measured_x_mm.size() &&
                  state.measured_heading_rad.size() == state.measured_x_mm.size() &&
                  (state.measured_x_mm.empty() || state.measured_x_mm.size() == robots_));
  last_state_ = state.tick.count();
  proto::StateRecord& record = *state_.mutable_state();
  record.set_tick(state.tick.count());
  assign(record.mutable_x_mm(), state.x_mm);
  assign(record.mutable_y_mm(), state.y_mm);
  assign(record.mutable_heading_rad(), state.heading_rad);
  assign(record.mutable_led(), state.led);
  assign(record.mutable_life_cycle(), state.life_cycle);
  assign(record.mutable_movable_x_mm(), state.movable_x_mm);
  assign(record.mutable_movable_y_mm(), state.movable_y_mm);
  assign(record.mutable_movable_heading_rad(), state.movable_heading_rad);
  assign(record.mutable_measured_x_mm(), state.measured_x_mm);
  assign(record.mutable_measured_y_mm(), state.measured_y_mm);
  assign(record.mutable_measured_heading_rad(), state.measured_heading_rad);
  append(state_);
  flush_if_due();
}

void Writer::hash(Tick tick, std::uint64_t chain) {
  if (tick.count() <= last_hash_) return;
  proto::HashRecord& record = *hashes_.mutable_hash();
  const int waiting = record.chain_size();
  if (waiting > 0 && (waiting == kHashesPerRecord || tick.count() != last_hash_ + 1)) append_hashes();
  if (record.chain_size() == 0) record.set_first_tick(tick.count());
  record.add_chain(chain);
  last_hash_ = tick.count();
  flush_if_due();
}

void Writer::input(const proto::InputRecord& input) {
  *other_.mutable_input() = input;
  append(other_);
  flush_if_due();
}

void Writer::tracker(const proto::TrackerRecord& sample) {
  *other_.mutable_tracker() = sample;
  append(other_);
  flush_if_due();
}

void Writer::messages(const proto::MessagesRecord& messages) {
  KILOTWIN_DEMAND(messages.receiver_size() == messages.sender_size() &&
                  messages.sender_size() == messages.count_size());
  *other_.mutable_messages() = messages;
  append(other_);
  other_.clear_messages();
  flush_if_due();
}

void Writer::radio(const proto::RadioRecord& radio) {
  const auto robots = static_cast<int>(robots_);
  KILOTWIN_DEMAND(radio.attempted_size() == robots && radio.sent_size() == robots &&
                  radio.received_size() == robots && radio.collided_size() == robots &&
                  radio.backed_off_size() == robots);
  *other_.mutable_radio() = radio;
  append(other_);
  other_.clear_radio();
  flush_if_due();
}

void Writer::floor(const proto::FloorRecord& floor) {
  *other_.mutable_floor() = floor;
  append(other_);
  other_.clear_floor();
}

void Writer::variable(const proto::VariableRecord& variable) {
  KILOTWIN_DEMAND(variable.integer_size() + variable.number_size() == variable.robot_size());
  *other_.mutable_variable() = variable;
  append(other_);
  other_.clear_variable();
  flush_if_due();
}

void Writer::event(const proto::EventRecord& event) {
  *other_.mutable_event() = event;
  append(other_);
  other_.clear_event();
  flush_if_due();
}

void Writer::end(Tick tick, std::uint64_t state_hash, const std::string& failure) {
  append_hashes();
  proto::EndRecord& record = *other_.mutable_end();
  record.set_tick(tick.count());
  record.set_state_hash(state_hash);
  record.set_failure(failure);
  append(other_);
  output_.close();
}

void Writer::flush() {
  append_hashes();
  output_.flush();
  flushed_ns_ = now_ns();
}

void Writer::flush_if_due() {
  if (output_.buffer().size() >= kMostUnflushed_bytes || now_ns() - flushed_ns_ >= kFlushEvery_ns) flush();
}

}  // namespace kilotwin::recorder
