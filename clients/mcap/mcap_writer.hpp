/// McapWriter: files of the format MCAP (mcap.dev): messages in chunks with an index, and a summary at the end. Chunks are not
/// compressed. A file that is cut off loses its last chunk and its summary; readers that stream still get the chunks before.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/os/files.hpp"

namespace kilotwin::mcap {

/// Time stamps: simulated ns since tick 0.
using Time_ns = std::uint64_t;

class McapWriter {
 public:
  /// Creates the file, or replaces it. Throws RunError, as all functions do, if it cannot be written.
  McapWriter(const std::filesystem::path& file, std::string_view library);
  McapWriter(const McapWriter&) = delete;

  /// `encoding` of the schema, such as "protobuf", and its data.
  [[nodiscard]] std::uint16_t add_schema(std::string_view name, std::string_view encoding, std::string_view data);
  [[nodiscard]] std::uint16_t add_channel(std::uint16_t schema, std::string_view topic, std::string_view encoding);
  /// Appends a message. A chunk ends after kChunk_bytes or kChunk_ns.
  void write(std::uint16_t channel, Time_ns time, std::string_view message);
  /// Writes the summary and closes the file.
  void close();
  [[nodiscard]] std::uint64_t messages() const { return messages_; }

  static constexpr std::size_t kChunk_bytes = 1 << 20;
  static constexpr Time_ns kChunk_ns = 1'000'000'000;

 private:
  struct ChunkIndex {
    Time_ns first = 0, last = 0;
    std::uint64_t offset = 0, length = 0;
    std::map<std::uint16_t, std::uint64_t> message_indexes;  // channel: offset of its index
    std::uint64_t message_index_length = 0, size = 0;
  };

  void put(std::string_view record);
  void end_chunk();
  [[nodiscard]] std::string chunk_index_record(const ChunkIndex&) const;
  [[nodiscard]] std::string statistics_record() const;

  os::OutputFile output_;
  std::uint64_t offset_ = 0;
  std::vector<std::string> schemas_, channels_;  // their records, for the summary
  std::string chunk_;
  Time_ns chunk_first_ = 0, chunk_last_ = 0, first_ = 0, last_ = 0;
  std::map<std::uint16_t, std::vector<std::pair<Time_ns, std::uint64_t>>>
      chunk_messages_;  // time, offset in the chunk
  std::vector<ChunkIndex> chunks_;
  std::map<std::uint16_t, std::uint64_t> counts_;
  std::uint64_t messages_ = 0;
};

}  // namespace kilotwin::mcap
