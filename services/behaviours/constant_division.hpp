/// Divisions by constants in a compiler's assembly. Compilers for x86-64 replace them by multiplications with a reciprocal (Granlund
/// and Montgomery 1994). The robot's compiler calls a division routine.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "services/behaviours/assembly.hpp"

namespace kilotwin::behaviours {

/// Statement `i` of a basic block: the cycles of the robot's routine if it is the multiplication of such a division, else nothing. A
/// quotient and a remainder count once. A test whether a number is divisible counts as a division, too.
[[nodiscard]] std::optional<unsigned> constant_division_cycles(std::span<const Statement> block, std::uint32_t i);

}  // namespace kilotwin::behaviours
