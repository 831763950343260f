/// A listener: a real robot that prints a line per message that it hears. Its lines become messages of the robots that sent
/// them.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "clients/doors/door.hpp"
#include "core/experiment/line_pattern.hpp"
#include "core/federation/topics.hpp"
#include "core/frames/tracker_sample.hpp"

namespace kilotwin::doors {

class Listener {
 public:
  /// `door`: of kind listener, as open_door() gives it.
  explicit Listener(const Door& door);

  /// The message that a line tells of; nothing where it tells of none, or of one of a robot that is not tracked.
  [[nodiscard]] std::optional<HeardMessage> heard(std::string_view line);
  /// "120 messages; 4 other lines (the first: "battery 3.9"), 1 message of no tracked robot (the first: number 77)".
  [[nodiscard]] std::string in_words() const;

 private:
  const Door& door_;
  LinePattern pattern_;
  std::uint64_t messages_ = 0, other_lines_ = 0, strangers_ = 0;
  std::string first_other_, first_stranger_;
};

/// Publishes topic kilotwin/heard_messages.
class HeardWriter {
 public:
  /// `source`: at most 63 characters.
  HeardWriter(const dds::Participant& participant, std::string source);
  /// Throws RunError where DDS refuses the sample.
  void write(const HeardMessage& message);
  [[nodiscard]] std::uint32_t readers() const { return writer_.readers(); }
  /// Waits until all readers have all messages; false after `seconds`.
  [[nodiscard]] bool flush(double seconds) const { return writer_.flush(seconds); }

 private:
  std::string source_;
  std::uint64_t number_ = 0;
  dds::Writer<PublicHeardMessage> writer_;
};

}  // namespace kilotwin::doors
