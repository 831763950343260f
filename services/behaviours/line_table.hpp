/// Maps instructions to source lines by the line tables of DWARF, versions 2 to 5.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace kilotwin::behaviours {

/// The line tables' sections of a program. Their content is not trusted: damaged tables give no result.
struct LineTables {
  std::string debug_line, debug_line_str, debug_str;

  struct Place {
    std::string file;  ///< name of the source without directories
    std::uint32_t line = 0;
  };
  /// The source line of the instruction at this offset in the image. Parses the tables on each call, because faults are rare.
  [[nodiscard]] std::optional<Place> find(std::uint64_t offset) const;
};

}  // namespace kilotwin::behaviours
