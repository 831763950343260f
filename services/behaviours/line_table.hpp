/// Source line of an instruction, from a program's DWARF line tables. libdw (elfutils) reads them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace kilotwin::behaviours {

/// The line tables of a program.
struct LineTables {
  std::string elf;  ///< the program's ELF file; it may be damaged

  struct Place {
    std::string file;  ///< name of the source without directories
    std::uint32_t line = 0;
  };
  /// The line of the instruction at this offset in the image; nullopt if the tables are missing, damaged, or do not cover it.
  /// Reads the tables on every call, in some 0.2 ms: faults are rare.
  [[nodiscard]] std::optional<Place> find(std::uint64_t offset) const;
};

}  // namespace kilotwin::behaviours
