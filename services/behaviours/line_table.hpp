/// Which line of the source an instruction comes from: the line tables of DWARF, versions 2 to 5.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace kilotwin::behaviours {

/// The sections of a program that hold its line tables. May hold anything: what is damaged is not found.
struct LineTables {
  std::string debug_line, debug_line_str, debug_str;

  struct Place {
    std::string file;  ///< as the compiler was told, without directories
    std::uint32_t line = 0;
  };
  /// Of the instruction at this offset in the image. Reads the tables anew each time: faults are rare.
  [[nodiscard]] std::optional<Place> find(std::uint64_t offset) const;
};

}  // namespace kilotwin::behaviours
