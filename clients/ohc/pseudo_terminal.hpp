/// A pseudo-terminal that other programs open as a serial port.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/os/descriptor.hpp"

namespace kilotwin::ohc {

class PseudoTerminal {
 public:
  /// A new one, raw, at 38400 baud. Throws RunError where the machine has none left.
  PseudoTerminal();

  /// Path of the side that others open.
  [[nodiscard]] const std::string& path() const { return path_; }
  /// Waits up to `seconds` for octets, and returns what has come; empty after the time, or upon a signal.
  [[nodiscard]] std::vector<std::uint8_t> read(double seconds);
  /// While held back, writers wait as they do for a line that is busy.
  void hold_back(bool held);
  /// Undoes what one program leaves to the next: exclusive use. Returns the speed that is set, baud; 0: not known.
  int tidy();

 private:
  os::Descriptor own_, other_;  ///< the other side stays open, so that programs may close it
  std::string path_;
  bool held_ = false;
};

/// Makes `link` a symbolic link to `path`. Throws UserError where something is there that is no link to nowhere.
void make_link(const std::filesystem::path& link, const std::string& path);
/// Removes the link, if it leads to `path`.
void remove_link(const std::filesystem::path& link, const std::string& path);

}  // namespace kilotwin::ohc
