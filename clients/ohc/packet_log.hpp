/// The lines about packets that a user of `kilotwin ohc` sees: a line where their kind changes, and counts at the end.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "core/frames/overhead_packet.hpp"

namespace kilotwin::ohc {

class PacketLog {
 public:
  /// Prints a line on stdout where the packet's kind is another than that of the one before. `time_s`: since the start.
  void note(const OverheadPacket& packet, double time_s);
  /// "7 packets (2 stop, 5 repeated)".
  [[nodiscard]] std::string counts() const;
  /// Whether the controller's own LED was left on.
  [[nodiscard]] bool led() const { return led_; }

 private:
  std::string kind_;
  std::array<std::uint64_t, 7> count_{};
  bool led_ = false;
};

/// "RUN, repeated", "pages of a program", ...
[[nodiscard]] std::string kind_in_words(const OverheadPacket& packet);

}  // namespace kilotwin::ohc
