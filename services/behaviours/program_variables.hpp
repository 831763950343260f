/// Variables of a compiled program, found by name in its DWARF debug information. libdw (elfutils) reads it. Programs for
/// simulation and firmware are read alike.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "services/behaviours/variable_path.hpp"

namespace kilotwin::behaviours {

/// Where a value lies in the program's memory.
struct ScalarVariable {
  enum class Kind : std::uint8_t { kSigned, kUnsigned, kFloat };
  std::string name;                              ///< with fields and indices: "table[3].x"
  std::uint64_t address = 0;                     ///< with a pointer: relative to what it points to
  std::uint64_t pointer = 0;                     ///< address of the pointer
  std::uint32_t octets = 0, pointer_octets = 0;  ///< pointer_octets: 0 without a pointer
  std::uint32_t bit_offset = 0, bits = 0;        ///< of a bit field; bits: 0 where it is none
  Kind kind = Kind::kSigned;
};

inline constexpr std::size_t kMostScalars = 1024;

/// The scalars of which the variable consists. Empty if the program has no variable of that name. Throws UserError, a line
/// without a place, if the path does not fit the variable's type, or the name is ambiguous; if the compiler keeps the variable nowhere,
/// or there are more than kMostScalars.
[[nodiscard]] std::vector<ScalarVariable> find_variable(const std::string& elf, const VariablePath& path);

/// Names of the global and static variables of the program's own sources, ascending.
[[nodiscard]] std::vector<std::string> variable_names(const std::string& elf);

}  // namespace kilotwin::behaviours
