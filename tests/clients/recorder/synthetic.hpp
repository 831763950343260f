/// Recordings and scratch folders that the tests of this folder share.
#pragma once

#include <stdlib.h>
#include <unistd.h>
#include <zlib.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "clients/recorder/recording.hpp"
#include "clients/recorder/writer.hpp"

namespace kilotwin::recorder {

/// A scratch folder that is removed with the object. It is in memory if possible: disk file systems write a file that was
/// truncated and rewritten to the disk when it is closed, and thousands of those take minutes.
class Scratch {
 public:
  Scratch() {
    const bool memory = ::access("/dev/shm", W_OK) == 0;
    const std::filesystem::path folder = memory ? "/dev/shm" : std::filesystem::temp_directory_path();
    std::string pattern = (folder / "kilotwin-recorder-XXXXXX").string();
    path_ = ::mkdtemp(pattern.data());
  }
  ~Scratch() {
    std::error_code none;
    std::filesystem::remove_all(path_, none);
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  [[nodiscard]] std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

inline std::string content(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

inline void put_content(const std::filesystem::path& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary | std::ios::trunc) << bytes;
}

inline proto::RecordingHeader synthetic_header(std::uint32_t robots, double every_s = 1) {
  proto::RecordingHeader header;
  header.set_format(kRecordingFormat);
  header.set_run(0x1234);
  header.set_name("synthetic");
  header.set_seed(42);
  header.set_tick_cycles(262144);
  header.set_robots(robots);
  header.set_every_s(every_s);
  header.set_arena_width_mm(2000);
  header.set_arena_height_mm(1000);
  header.set_messages(true);
  header.set_first_tick(0);
  header.set_first_hash(0);
  return header;
}

/// Robot i < 100 starts at (10 i, -5 i) and moves by (0.5, 0.25 i) mm per tick; heading 0.1 i; led i; the last
/// robot has failed.
struct SyntheticState {
  std::vector<double> x_mm, y_mm, heading_rad;
  std::vector<std::uint8_t> led, life_cycle;
  SyntheticState(std::uint32_t robots, Tick tick) {
    for (std::uint32_t i = 0; i < robots; ++i) {
      const auto t = static_cast<double>(tick.count());
      x_mm.push_back(10.0 * (i % 100) + 0.5 * t);
      y_mm.push_back(-5.0 * (i % 100) + 0.25 * (i % 100) * t);
      heading_rad.push_back(0.1 * (i % 30));
      led.push_back(static_cast<std::uint8_t>(i % 64));
      life_cycle.push_back(i + 1 == robots ? 255 : 4);
    }
  }
  [[nodiscard]] StateView view(Tick tick) const { return {tick, x_mm, y_mm, heading_rad, led, life_cycle}; }
};

inline std::uint64_t synthetic_hash(std::int64_t tick) {
  return static_cast<std::uint64_t>(tick) * 0x9e3779b97f4a7c15u;
}

/// A complete run: scheduled states and one at the end, a hash per tick, an input, messages, an end mark.
inline void write_synthetic(const std::filesystem::path& file, const proto::RecordingHeader& header,
                            std::int64_t ticks) {
  Writer writer(file, header);
  const RecordingSchedule schedule(TickLength{header.tick_cycles()}, header.every_s());
  for (std::int64_t t = header.first_tick(); t <= ticks; ++t) {
    if (schedule.due(Tick{t}) || t == ticks) writer.state(SyntheticState(header.robots(), Tick{t}).view(Tick{t}));
    writer.hash(Tick{t}, synthetic_hash(t));
    if (t == 3) {
      proto::InputRecord input;
      input.set_sequence_number(1);
      input.set_tick(3);
      input.set_kind(proto::InputRecord::PAUSE);
      writer.input(input);
    }
  }
  if (header.messages()) {
    proto::MessagesRecord messages;
    for (const auto& [receiver, sender, count] : {std::array{1u, 0u, 7u}, {0u, 0u, 9u}, {0u, 1u, 4u}}) {
      messages.add_receiver(receiver);
      messages.add_sender(sender);
      messages.add_count(count);
    }
    writer.messages(messages);
  }
  writer.end(Tick{ticks}, synthetic_hash(ticks));
}

/// A frame: length, checksums, record.
inline std::string framed(const std::string& record) {
  const auto length = static_cast<std::uint32_t>(record.size());
  const auto crc = static_cast<std::uint32_t>(
      ::crc32_z(0, reinterpret_cast<const unsigned char*>(record.data()), record.size()));
  std::string out;
  const auto put = [&out](std::uint32_t word) {
    for (int i = 0; i < 4; ++i) out += static_cast<char>(word >> 8 * i & 0xff);
  };
  put(length);
  put(crc);
  put(static_cast<std::uint32_t>(::crc32_z(0, reinterpret_cast<const unsigned char*>(out.data()), out.size())));
  return out + record;
}

}  // namespace kilotwin::recorder
