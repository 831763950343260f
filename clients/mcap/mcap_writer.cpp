#include "clients/mcap/mcap_writer.hpp"

#include <algorithm>

#include "core/os/crc32.hpp"

namespace kilotwin::mcap {
namespace {

constexpr std::string_view kMagic("\x89MCAP0\r\n", 8);

enum class Opcode : std::uint8_t {
  kHeader = 1,
  kFooter = 2,
  kSchema = 3,
  kChannel = 4,
  kMessage = 5,
  kChunk = 6,
  kMessageIndex = 7,
  kChunkIndex = 8,
  kStatistics = 0x0b,
  kSummaryOffset = 0x0e,
  kDataEnd = 0x0f
};

/// Little-endian numbers, strings with their length.
class Content {
 public:
  template <class Number> Content& number(Number value) {
    for (std::size_t i = 0; i < sizeof value; ++i) bytes_ += static_cast<char>(value >> (8 * i) & 255u);
    return *this;
  }
  Content& text(std::string_view value) {
    number(static_cast<std::uint32_t>(value.size()));
    bytes_ += value;
    return *this;
  }
  Content& raw(std::string_view value) {
    bytes_ += value;
    return *this;
  }
  [[nodiscard]] const std::string& bytes() const { return bytes_; }
  /// As a record: opcode, length, content.
  [[nodiscard]] std::string record(Opcode opcode) const {
    Content whole;
    whole.number(static_cast<std::uint8_t>(opcode)).number(static_cast<std::uint64_t>(bytes_.size())).raw(bytes_);
    return whole.bytes_;
  }

 private:
  std::string bytes_;
};

/// A map whose length is counted in octets.
template <class Map> Content& add_map(Content& to, const Map& map) {
  Content entries;
  for (const auto& [key, value] : map) entries.number(key).number(value);
  return to.text(entries.bytes());
}

}  // namespace

McapWriter::McapWriter(const std::filesystem::path& file, std::string_view library)
    : output_(file, os::OutputFile::Existing::kReplace) {
  put(kMagic);
  put(Content().text("").text(library).record(Opcode::kHeader));
}

void McapWriter::put(std::string_view record) {
  output_.buffer() += record;
  offset_ += record.size();
  output_.flush_if_above(kChunk_bytes);
}

std::uint16_t McapWriter::add_schema(std::string_view name, std::string_view encoding, std::string_view data) {
  const auto id = static_cast<std::uint16_t>(schemas_.size() + 1);
  schemas_.push_back(Content().number(id).text(name).text(encoding).text(data).record(Opcode::kSchema));
  put(schemas_.back());
  return id;
}

std::uint16_t McapWriter::add_channel(std::uint16_t schema, std::string_view topic, std::string_view encoding) {
  const auto id = static_cast<std::uint16_t>(channels_.size() + 1);
  channels_.push_back(
      Content().number(id).number(schema).text(topic).text(encoding).text("").record(Opcode::kChannel));
  put(channels_.back());
  return id;
}

void McapWriter::write(std::uint16_t channel, Time_ns time, std::string_view message) {
  if (!chunk_.empty() && (chunk_.size() >= kChunk_bytes || time >= chunk_first_ + kChunk_ns)) end_chunk();
  if (chunk_.empty()) chunk_first_ = chunk_last_ = time;
  chunk_first_ = std::min(chunk_first_, time);
  chunk_last_ = std::max(chunk_last_, time);
  first_ = messages_ == 0 ? time : std::min(first_, time);
  last_ = std::max(last_, time);
  chunk_messages_[channel].emplace_back(time, chunk_.size());
  const std::uint64_t number = counts_[channel]++;
  chunk_ += Content()
                .number(channel)
                .number(static_cast<std::uint32_t>(number))
                .number(time)
                .number(time)
                .raw(message)
                .record(Opcode::kMessage);
  ++messages_;
}

void McapWriter::end_chunk() {
  if (chunk_.empty()) return;
  ChunkIndex index;
  index.first = chunk_first_;
  index.last = chunk_last_;
  index.offset = offset_;
  index.size = chunk_.size();
  put(Content()
          .number(chunk_first_)
          .number(chunk_last_)
          .number(index.size)
          .number(os::crc32(chunk_))
          .text("")
          .number(index.size)
          .raw(chunk_)
          .record(Opcode::kChunk));
  index.length = offset_ - index.offset;
  const std::uint64_t indexes_from = offset_;
  for (const auto& [channel, messages] : chunk_messages_) {
    index.message_indexes[channel] = offset_;
    Content record;
    record.number(channel);
    put(add_map(record, messages).record(Opcode::kMessageIndex));
  }
  index.message_index_length = offset_ - indexes_from;
  chunks_.push_back(std::move(index));
  chunk_.clear();
  chunk_messages_.clear();
}

std::string McapWriter::chunk_index_record(const ChunkIndex& index) const {
  Content record;
  record.number(index.first).number(index.last).number(index.offset).number(index.length);
  add_map(record, index.message_indexes);
  return record.number(index.message_index_length)
      .text("")
      .number(index.size)
      .number(index.size)
      .record(Opcode::kChunkIndex);
}

std::string McapWriter::statistics_record() const {
  Content record;
  record.number(messages_)
      .number(static_cast<std::uint16_t>(schemas_.size()))
      .number(static_cast<std::uint32_t>(channels_.size()))
      .number(std::uint32_t{0})
      .number(std::uint32_t{0})
      .number(static_cast<std::uint32_t>(chunks_.size()))
      .number(first_)
      .number(last_);
  return add_map(record, counts_).record(Opcode::kStatistics);
}

void McapWriter::close() {
  end_chunk();
  put(Content().number(std::uint32_t{0}).record(Opcode::kDataEnd));
  const std::uint64_t summary_from = offset_;
  std::string summary, offsets;
  const auto add_group = [&](Opcode opcode, const std::vector<std::string>& records) {
    const std::uint64_t from = summary_from + summary.size();
    for (const std::string& record : records) summary += record;
    offsets += Content()
                   .number(static_cast<std::uint8_t>(opcode))
                   .number(from)
                   .number(summary_from + summary.size() - from)
                   .record(Opcode::kSummaryOffset);
  };
  std::vector<std::string> indexes;
  for (const ChunkIndex& chunk : chunks_) indexes.push_back(chunk_index_record(chunk));
  add_group(Opcode::kSchema, schemas_);
  add_group(Opcode::kChannel, channels_);
  if (!indexes.empty()) add_group(Opcode::kChunkIndex, indexes);
  add_group(Opcode::kStatistics, {statistics_record()});
  const std::uint64_t offsets_from = summary_from + summary.size();
  summary += offsets;
  // The checksum covers the footer up to itself.
  Content footer;
  footer.number(summary_from).number(offsets_from);
  constexpr std::uint64_t kFooter_bytes = 20;
  const std::string before = Content()
                                 .number(static_cast<std::uint8_t>(Opcode::kFooter))
                                 .number(kFooter_bytes)
                                 .raw(footer.bytes())
                                 .bytes();
  put(summary);
  put(Content().raw(before).number(os::crc32(before, os::crc32(summary))).bytes());
  put(kMagic);
  output_.close();
}

}  // namespace kilotwin::mcap
