/// Writer: the recording of a run, as the run goes. One thread.
///
/// What is older than about a second, or more than 256 KiB, is in the kernel and outlives a killed process. Time is
/// looked at in each call; a run that makes none for long, because it is paused or waits, calls flush_if_due()
/// while it waits.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "core/os/files.hpp"
#include "clients/recorder/recording.hpp"

namespace kilotwin::recorder {

/// All robots at one instant, ids ascending from 0.
struct StateView {
  Tick tick;
  std::span<const double> x_mm, y_mm, heading_rad;
  std::span<const std::uint8_t> led;                                              ///< r | g << 2 | b << 4
  std::span<const std::uint8_t> life_cycle;                                       ///< LifeCycle
  std::span<const double> movable_x_mm{}, movable_y_mm{}, movable_heading_rad{};  ///< per movable body, from 0
  /// As a tracker sees them; empty where that is how they are.
  std::span<const double> measured_x_mm = {}, measured_y_mm = {}, measured_heading_rad = {};
};

/// Every function throws RunError where the file cannot be written, e.g. on a full disk: "FILE: cannot be written:
/// reason".
class Writer {
 public:
  /// Creates the file, which must not exist, and writes the header at once.
  Writer(std::filesystem::path file, const proto::RecordingHeader& header);

  /// A state, or a state hash H(tick). Ticks at or before the last one recorded are passed over: a run that went
  /// back to a checkpoint repeats them, bit for bit.
  void state(const StateView& state);
  void hash(Tick tick, std::uint64_t chain);
  void input(const proto::InputRecord& input);
  /// Counts since the start; they take the place of what was recorded for the same pairs before.
  void messages(const proto::MessagesRecord& messages);
  /// One entry per robot in every field.
  void radio(const proto::RadioRecord& radio);
  /// The last record of all, where the run came to its end. `failure`: one line, empty where it ended well. Closes
  /// the file.
  void end(Tick tick, std::uint64_t state_hash, const std::string& failure = {});

  /// Hands everything to the kernel.
  void flush();
  /// The same, where the last time lies half a second back or much waits.
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
  proto::Record state_, hashes_, other_;  // kept, so that their memory serves again
};

}  // namespace kilotwin::recorder
