#include <algorithm>
#include <array>
#include <cstdlib>
#include <string>

#include "services/behaviours/cycle_counters.hpp"

namespace kilotwin::behaviours {
namespace {

struct Cost {
  std::string_view start;  ///< beginning of the mnemonic
  unsigned cycles;
};

/// Octets that an instruction moves from or to memory, by the size in its name. Quadwords are pointers, which have two octets on the
/// robot.
unsigned octets_of(std::string_view name) {
  constexpr std::size_t kSourceSize = 4;  // movzbl, movswl
  const bool extends = name.starts_with("movz") || name.starts_with("movs");
  if (name.ends_with("ss") || name.ends_with("sd") || name.ends_with("ps") || name.ends_with("pd")) return 4;
  switch (extends && name.size() > kSourceSize ? name[kSourceSize] : name.back()) {
    case 'b': return 1;
    case 'l': return 4;
    default: return 2;
  }
}

}  // namespace

unsigned avr_cycles(std::string_view name, std::string_view operands) {
  // The first entry whose beginning matches applies. Moves between memory and registers take no cycles besides those of the memory.
  static constexpr std::array kCosts{
      Cost{"call", 8},
      Cost{"ret", 4},
      Cost{"push", 2},
      Cost{"pop", 2},
      Cost{"lea", 2},
      Cost{"nop", 0},
      Cost{"cltq", 0},
      Cost{"cltd", 0},
      Cost{"cqto", 0},
      Cost{"movs", 1},
      Cost{"movz", 1},
      Cost{"jmp", 2},
      Cost{"j", 2},
      Cost{"divs", 480},
      Cost{"divb", kDivision8},
      Cost{"divw", kDivision16},
      Cost{"divl", kDivision32},
      Cost{"divq", kDivision64},
      Cost{"idivb", kSignedDivision8},
      Cost{"idivq", kDivision64},
      Cost{"idiv", kSignedDivision16},
      Cost{"imulq", 180},
      Cost{"imul", 40},
      Cost{"muls", 140},
      Cost{"mul", 8},
      Cost{"set", 2},
      Cost{"cmov", 3},
      Cost{"xchg", 2},
      Cost{"adds", 110},
      Cost{"subs", 110},
      Cost{"sqrts", 370},
      Cost{"ucomis", 50},
      Cost{"comis", 50},
      Cost{"cvt", 60},
      Cost{"mova", 2},
      Cost{"pxor", 1},
  };
  // By a constant of 16 bits: nearly always the index of an array, a pointer's 16 bits. A product of 64 bits is underestimated.
  constexpr unsigned kIndex = 12;
  constexpr long long kMostIndexed = 65535;
  if (name == "imulq" && operands.starts_with('$') &&
      std::strtoll(std::string(operands.substr(1)).c_str(), nullptr, 10) <= kMostIndexed)
    return kIndex;
  unsigned cycles = 2;
  for (const Cost& cost : kCosts) {
    if (name.starts_with(cost.start)) {
      cycles = cost.cycles;
      break;
    }
  }
  if (operands.find('(') == std::string_view::npos || name.starts_with("lea")) return cycles;
  // LDS, STS, LD and ST take two cycles per octet. An instruction that changes memory loads and stores it.
  const unsigned transfer = 2 * octets_of(name);
  if (name.starts_with("mov")) return transfer;
  const bool changes = operands.ends_with(')') && !name.starts_with("cmp") && !name.starts_with("test");
  return cycles + (changes ? 2 : 1) * transfer;
}

}  // namespace kilotwin::behaviours
