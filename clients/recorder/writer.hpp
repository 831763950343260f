/// Writer: writes the recording of a run as it proceeds. For one thread.
///
/// If the process is killed, about one second or 256 KiB of records are lost at most: every call checks both limits. A run
/// that records nothing for long, because it is paused or waits, must call flush_if_due() in the meantime.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "clients/recorder/recording.hpp"
#include "core/os/files.hpp"

namespace kilotwin::recorder {

/// State of all robots at one tick, ids ascending from 0.
struct StateView {
  Tick tick;
  std::span<const double> x_mm, y_mm, heading_rad;
  std::span<const std::uint8_t> led;                                              ///< r | g << 2 | b << 4
  std::span<const std::uint8_t> life_cycle;                                       ///< LifeCycle
  std::span<const double> movable_x_mm{}, movable_y_mm{}, movable_heading_rad{};  ///< per movable body, from 0
  /// Poses as a tracker measures them; empty if the model has no effects on measurement.
  std::span<const double> measured_x_mm = {}, measured_y_mm = {}, measured_heading_rad = {};
};

/// Every function throws RunError if the file cannot be written, e.g. on a full disk: "FILE: cannot be written: reason".
class Writer {
 public:
  /// Creates the file, which must not exist, and writes the header at once.
  Writer(std::filesystem::path file, const proto::RecordingHeader& header);

  /// Appends a state, or a state hash H(tick). Ticks up to the last recorded one are ignored: after its return to a
  /// checkpoint, a run repeats them with the same bits.
  void state(const StateView& state);
  void hash(Tick tick, std::uint64_t chain);
  void input(const proto::InputRecord& input);
  void tracker(const proto::TrackerRecord& sample);
  /// Counts since the start. They replace earlier counts of the same pair.
  void messages(const proto::MessagesRecord& messages);
  /// One entry per robot in every field.
  void radio(const proto::RadioRecord& radio);
  void floor(const proto::FloorRecord& floor);
  void variable(const proto::VariableRecord& variable);
  void event(const proto::EventRecord& event);
  /// The end mark of a run that reached its end. `failure`: one line, empty if the run succeeded. Closes the file.
  void end(Tick tick, std::uint64_t state_hash, const std::string& failure = {});

  /// Writes the buffer to the file.
  void flush();
  /// As flush(), if the last flush was half a second ago or the buffer is long.
  void flush_if_due();
  /// Bytes recorded so far.
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }

 private:
  void append(const proto::Record& record);  // to the buffer only
  void append_hashes();

  os::OutputFile output_;
  const std::uint32_t robots_;
  const std::size_t movables_;
  std::int64_t last_state_, last_hash_;
  std::int64_t flushed_ns_ = 0;
  std::uint64_t bytes_ = 0;
  proto::Record state_, hashes_, other_;  // reused: they keep their memory
};

}  // namespace kilotwin::recorder
