/// Reader: the records of a recording, in order. It checks every record before returning it. It therefore also reads
/// recordings that are still growing, cut off or damaged.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "clients/recorder/recording.hpp"

namespace kilotwin::recorder {

/// Bounds of valid recordings.
inline constexpr std::uint32_t kMostRobots = 100'000;  ///< idl/experiment.proto
inline constexpr double kFarthest_mm = 1e7;            ///< largest distance of a robot from the origin

class Reader {
 public:
  /// Opens a file and reads its header. Throws UserError: "FILE: cannot be read: reason", or
  /// "FILE: not a Kilotwin recording; ..." for other files and newer formats.
  explicit Reader(std::filesystem::path file);
  ~Reader();
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;

  [[nodiscard]] const proto::RecordingHeader& header() const { return header_; }
  [[nodiscard]] TickLength tick_length() const { return TickLength{header_.tick_cycles()}; }
  [[nodiscard]] const std::filesystem::path& path() const { return file_; }

  /// The next record after the header, valid until the next call; nullptr at the end. If the file has grown, a later call
  /// continues. The reader guarantees: states have one entry per robot in every field, finite poses and ascending ticks;
  /// messages, variables and events have valid robot ids, and columns that suit their kind.
  [[nodiscard]] const proto::Record* next();
  /// The next state among the records, nullptr at the end.
  [[nodiscard]] const proto::StateRecord* next_state();
  /// Returns to the first record after the header.
  void rewind();
  /// Continues with the record whose frame begins at `offset`: StateIndex knows where. The check of ascending ticks restarts.
  void go_to(std::uint64_t offset);

  /// After next() returned nullptr: whether the end mark of the run was reached. Without end mark and warning, the run was
  /// killed or is still running.
  [[nodiscard]] bool ended() const { return ended_; }
  /// After next() returned nullptr: empty, or one line that says where and how the file breaks off:
  /// "FILE: cut off at byte N; read up to there".
  [[nodiscard]] const std::string& warning() const { return warning_; }
  /// After next() returned nullptr: whether the warning is about bytes that changed after they were written. A file that is
  /// only cut off, e.g. of a killed run, is not damaged.
  [[nodiscard]] bool damaged() const { return damaged_; }

 private:
  [[nodiscard]] bool fill(std::size_t bytes);
  [[nodiscard]] bool read_record();
  [[nodiscard]] const char* defect_of_record() const;
  [[nodiscard]] const char* defect_of_variable(const proto::VariableRecord& variable) const;
  [[nodiscard]] const char* defect_of_event(const proto::EventRecord& event) const;
  [[nodiscard]] const char* defect_of_sample(const proto::TrackerRecord& sample) const;
  [[nodiscard]] std::span<const std::uint8_t> waiting() const;
  void warn(std::string_view what);
  void warn_of_damage(std::string_view what = {});
  [[nodiscard]] bool begins_as_format_1();

  std::filesystem::path file_;
  int descriptor_ = -1;
  proto::RecordingHeader header_;
  proto::Record record_;
  std::string warning_;
  bool ended_ = false, damaged_ = false;
  std::uint64_t offset_ = 0;         // of the next frame in the file
  std::uint64_t records_from_ = 0;   // offset of the first frame after the header
  std::int64_t last_state_ = 0;      // tick of the last state that next() returned
  std::vector<std::uint8_t> block_;  // bytes of the file from block_from_ on
  std::uint64_t block_from_ = 0;
};

}  // namespace kilotwin::recorder
