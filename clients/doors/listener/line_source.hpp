/// Lines of a serial port, a pseudo-terminal, a pipe or a file that grows.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/os/descriptor.hpp"

namespace kilotwin::doors {

class LineSource {
 public:
  /// Opens it; a terminal is set to `baud`, 8N1, raw. Throws UserError where it cannot be opened, or has no such speed.
  LineSource(std::filesystem::path place, int baud);

  /// Whole lines that have come, without their ends; waits for some `seconds` at most. A line beyond 4096 octets is cut.
  /// A port that vanishes is said once, and opened again when it is back.
  [[nodiscard]] std::vector<std::string> read(double seconds);
  /// Whether everything has been read: a file's end, until it grows.
  [[nodiscard]] bool at_end() const { return at_end_; }
  /// The text after the last line's end.
  [[nodiscard]] const std::string& rest() const { return line_; }

 private:
  [[nodiscard]] std::string open();
  void lose();
  void take(const char* octets, std::size_t count, std::vector<std::string>& lines);

  std::filesystem::path place_;
  int baud_;
  os::Descriptor port_;
  bool is_file_ = false, at_end_ = false;
  std::string line_;
};

}  // namespace kilotwin::doors
