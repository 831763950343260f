#include "services/behaviours/constant_division.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "services/behaviours/cycle_counters.hpp"

namespace kilotwin::behaviours {
namespace {

constexpr int kNoRegister = -1;
/// Instructions between the multiplication and the shift that takes its upper half.
constexpr std::size_t kReach = 12;

/// The operands, at most three, in AT&T order: the destination is the last.
struct Operands {
  std::array<std::string_view, 3> word;
  std::size_t count = 0;
  [[nodiscard]] std::string_view last() const { return count == 0 ? std::string_view() : word[count - 1]; }
};

Operands split(std::string_view text) {
  Operands result;
  int depth = 0;
  std::size_t begin = 0;
  for (std::size_t at = 0; at <= text.size() && result.count < result.word.size(); ++at) {
    if (at < text.size() && text[at] == '(') ++depth;
    if (at < text.size() && text[at] == ')') --depth;
    if (at < text.size() && (text[at] != ',' || depth > 0)) continue;
    std::string_view word = text.substr(begin, at - begin);
    while (!word.empty() && (word.front() == ' ' || word.front() == '\t')) word.remove_prefix(1);
    while (!word.empty() && (word.back() == ' ' || word.back() == '\t')) word.remove_suffix(1);
    if (!word.empty()) result.word[result.count++] = word;
    begin = at + 1;
  }
  return result;
}

/// The number of the general-purpose register that the operand is, in whatever width.
int register_of(std::string_view operand) {
  if (operand.size() < 3 || operand.front() != '%') return kNoRegister;
  operand.remove_prefix(1);
  if (operand.front() == 'r' && operand[1] >= '0' && operand[1] <= '9')
    return static_cast<int>(std::strtol(operand.data() + 1, nullptr, 10));
  const bool is_lowest = operand.back() == 'l' && operand.size() == 3;  // dil
  if (operand.size() == 3 && !is_lowest) operand.remove_prefix(1);      // rax, eax
  constexpr std::array<std::string_view, 16> kNames{"ax", "al", "cx", "cl", "dx", "dl", "bx", "bl",
                                                    "si", "si", "di", "di", "bp", "bp", "sp", "sp"};
  const auto found = std::find(kNames.begin(), kNames.end(), operand.substr(0, 2));
  return found == kNames.end() ? kNoRegister : 100 + static_cast<int>(found - kNames.begin()) / 2;
}

/// The constant that the operand is.
std::optional<std::int64_t> constant_of(std::string_view operand) {
  if (operand.size() < 2 || operand.front() != '$') return std::nullopt;
  const std::string digits(operand.substr(1));
  char* end = nullptr;
  const long long value = std::strtoll(digits.c_str(), &end, 0);
  return *end == '\0' ? std::optional<std::int64_t>(value) : std::nullopt;
}

/// The instructions after `i` that may belong to its division.
std::vector<std::reference_wrapper<const Statement>> instructions_after(std::span<const Statement> block,
                                                                        std::uint32_t i) {
  std::vector<std::reference_wrapper<const Statement>> result;
  for (++i; i < block.size() && result.size() < kReach; ++i)
    if (block[i].kind == Statement::Kind::kInstruction) result.emplace_back(block[i]);
  return result;
}

/// The last instruction before `i` that writes to the register; null: the block has none.
const Statement* writer_of(std::span<const Statement> block, std::uint32_t i, int of) {
  while (of != kNoRegister && i-- > 0) {
    const Statement& s = block[i];
    if (s.kind != Statement::Kind::kInstruction || s.name.starts_with("cmp") || s.name.starts_with("test"))
      continue;
    const bool extends_rax = s.name == "cltq" && of == register_of("%rax");
    if (extends_rax || register_of(split(s.operands).last()) == of) return &s;
  }
  return nullptr;
}

/// The constant that the register holds at `i`, if the block says so.
std::optional<std::int64_t> constant_in(std::span<const Statement> block, std::uint32_t i, int of) {
  const Statement* const writer = writer_of(block, i, of);
  return writer != nullptr && writer->name.starts_with("mov") ? constant_of(split(writer->operands).word[0])
                                                              : std::nullopt;
}

/// Whether the register holds a number with a sign at `i`: what wrote it extends one.
bool is_extended(std::span<const Statement> block, std::uint32_t i, int of) {
  const Statement* const writer = writer_of(block, i, of);
  return writer != nullptr && (writer->name == "cltq" || writer->name.starts_with("movs"));
}

/// A shift to the right of a register by a constant.
struct Shift {
  unsigned bits = 0;
  bool is_signed = false;
};

/// The first shift to the right of the register by at least `least` bits, in the instructions after `i`; the register may be copied
/// before. One that takes the sign alone does not count.
std::optional<Shift> shift_of(std::span<const Statement> block, std::uint32_t i, int of, unsigned least,
                              unsigned width) {
  std::array<int, 2> values{of, kNoRegister};
  for (const Statement& s : instructions_after(block, i)) {
    const Operands operands = split(s.operands);
    const int to = register_of(operands.last());
    const auto is_value = [&](int r) { return r != kNoRegister && (r == values[0] || r == values[1]); };
    if (s.name.starts_with("mov") && operands.count == 2 && is_value(register_of(operands.word[0])) &&
        to != kNoRegister && !is_value(to)) {
      values[1] = to;
      continue;
    }
    if (!is_value(to)) continue;
    if ((s.name.starts_with("shr") || s.name.starts_with("sar")) && operands.count == 2) {
      const auto bits = constant_of(operands.word[0]);
      if (!bits) return std::nullopt;
      if (*bits == width - 1) continue;
      if (*bits < least) return std::nullopt;
      return Shift{static_cast<unsigned>(*bits), s.name.starts_with("sar")};
    }
    if (s.name.starts_with("cmp") || s.name.starts_with("test")) continue;
    values[to == values[0] ? 0 : 1] = kNoRegister;  // it is overwritten
  }
  return std::nullopt;
}

/// Whether a product with `factor`, shifted by `bits`, is a quotient by a constant, of numbers of at least 11 bits: compilers first
/// shift a dividend by the zeros at the divisor's end.
bool is_reciprocal(std::uint64_t factor, unsigned bits) {
  constexpr unsigned kPrecision = 11;
  constexpr std::uint64_t kLeastFactor = 1024, kMostDivisor = 4096;
  if (bits < kPrecision || bits > 40 || factor < kLeastFactor) return false;
  const std::uint64_t one = std::uint64_t{1} << bits, divisor = (one + factor - 1) / factor;
  const std::uint64_t excess = divisor * factor - one;
  return divisor >= 3 && divisor <= kMostDivisor && excess > 0 && excess <= one >> kPrecision;
}

/// The same for a factor of 8 bits, of numbers of at least 7 bits.
bool is_short_reciprocal(std::uint64_t factor, unsigned bits) {
  const std::uint64_t one = std::uint64_t{1} << bits,
                      divisor = (one + factor - 1) / std::max<std::uint64_t>(factor, 1);
  const std::uint64_t excess = divisor * factor - one;
  return bits <= 16 && divisor >= 3 && divisor <= 255 && excess > 0 && excess <= one >> 7;
}

/// The same for a factor of 32 or 33 bits, of numbers of at least 24 bits. `bits`: of the first shift; a second one may follow.
bool is_long_reciprocal(std::int64_t factor, unsigned bits) {
  constexpr unsigned kPrecision = 24, kMostMore = 18, kMostBits = 52;
  constexpr std::uint64_t kMostDivisor = 1 << 20;
  const std::uint64_t low = static_cast<std::uint64_t>(factor) & 0xffffffff;
  for (const std::uint64_t candidate : {low, low | std::uint64_t{1} << 32}) {
    for (unsigned b = bits; candidate > 1024 && b <= std::min(bits + kMostMore, kMostBits); ++b) {
      const std::uint64_t one = std::uint64_t{1} << b, divisor = (one + candidate - 1) / candidate;
      const std::uint64_t excess = divisor * candidate - one;
      if (divisor >= 3 && divisor <= kMostDivisor && excess > 0 && excess <= one >> kPrecision) return true;
    }
  }
  return false;
}

/// Whether an instruction after `i` adds the register, or the dividend to it, as a factor of 17 bits needs.
bool is_corrected(std::span<const Statement> block, std::uint32_t i, int of, std::string_view by) {
  for (const Statement& s : instructions_after(block, i)) {
    const Operands operands = split(s.operands);
    if (operands.count == 2 && s.name.starts_with(by) &&
        (register_of(operands.word[0]) == of || (by == "add" && register_of(operands.word[1]) == of)))
      return true;
  }
  return false;
}

/// The inverse of an odd number modulo 2^32 (Newton).
std::uint32_t inverse(std::uint32_t odd) {
  std::uint32_t x = odd;
  for (int n = 0; n < 4; ++n) x *= 2 - odd * x;
  return x;
}

/// A product that, after an addition and a rotation, is compared: this tells whether a number is divisible.
struct Comparison {
  unsigned bits;
  bool adds;
};
std::optional<Comparison> comparison_of(std::span<const Statement> block, std::uint32_t i, int of) {
  bool adds = false;
  for (const Statement& s : instructions_after(block, i)) {
    const Operands operands = split(s.operands);
    if (register_of(operands.last()) != of) continue;
    if (s.name.starts_with("cmp"))
      return Comparison{s.name.back() == 'b' ? 8u : s.name.back() == 'w' ? 16u : 32u, adds};
    if (s.name.starts_with("add")) adds = true;
    if (!s.name.starts_with("add") && !s.name.starts_with("ro")) return std::nullopt;
  }
  return std::nullopt;
}

/// The product of 32 bits with the constant `factor`.
std::optional<unsigned> short_division_cycles(std::span<const Statement> block, std::uint32_t i, int to,
                                              std::int64_t factor) {
  if (const auto shift = shift_of(block, i, to, 16, 32)) {
    const auto low = static_cast<std::uint64_t>(factor) & 0xffff;
    const bool is_signed = shift->is_signed || factor < 0;
    if (factor > 0 && is_reciprocal(static_cast<std::uint64_t>(factor), shift->bits))
      return is_signed ? kSignedDivision16 : kDivision16;
    if (shift->bits == 16 && is_corrected(block, i, to, factor < 0 ? "add" : "sub")) {
      for (unsigned more = 1; more <= 12; ++more) {
        if (is_reciprocal(factor < 0 ? low : low + 0x10000, 16 + more))
          return is_signed ? kSignedDivision16 : kDivision16;
      }
    }
  }
  const auto compared = comparison_of(block, i, to);
  if (!compared || (factor & 1) == 0) return std::nullopt;
  // The factor is the divisor's inverse.
  const std::uint32_t divisor =
      inverse(static_cast<std::uint32_t>(factor)) & (0xffffffffu >> (32 - compared->bits));
  const std::uint32_t most = compared->bits == 32 ? 8192 : compared->bits == 16 ? 1024 : 127;
  if (divisor < 3 || divisor > most) return std::nullopt;
  switch (compared->bits) {
    case 8: return compared->adds ? kSignedDivision8 : kDivision8;
    case 16: return compared->adds ? kSignedDivision16 : kDivision16;
    default: return compared->adds ? kSignedDivision16 : kDivision32;
  }
}

}  // namespace

std::optional<unsigned> constant_division_cycles(std::span<const Statement> block, std::uint32_t i) {
  const Statement& s = block[i];
  const Operands operands = split(s.operands);
  if (s.name == "mulb" || s.name == "imulb") {
    const auto shift = shift_of(block, i, register_of("%rax"), 8, 16);
    std::optional<std::int64_t> by = constant_in(block, i, register_of(operands.last()));
    if (!by) by = constant_in(block, i, register_of("%rax"));
    if (!shift || !by || !is_short_reciprocal(static_cast<std::uint64_t>(*by) & 0xff, shift->bits))
      return std::nullopt;
    return s.name == "mulb" ? kDivision8 : kSignedDivision8;
  }
  if (!s.name.starts_with("imul") || operands.count < 2) return std::nullopt;
  const int to = register_of(operands.last());
  if (to == kNoRegister) return std::nullopt;
  const std::optional<std::int64_t> factor = constant_of(operands.word[0]);
  if (s.name == "imulq") {
    const auto shift = shift_of(block, i, to, 32, 64);
    if (!shift) return std::nullopt;
    const int from = register_of(operands.word[factor ? 1 : 0]);
    // A factor that the block does not load is one that the compiler has taken out of a loop.
    std::optional<std::int64_t> known = factor;
    if (!known) known = constant_in(block, i, from);
    if (!known) known = constant_in(block, i, to);
    if (known && !is_long_reciprocal(*known, shift->bits)) return std::nullopt;
    const bool is_signed =
        shift->is_signed || (factor && *factor < 0) || is_extended(block, i, from) || is_extended(block, i, to);
    // Of an int, which has 16 bits on the robot, or of an int32_t: nothing here tells. Programs have more of the first.
    return is_signed ? kSignedDivision16 : kDivision32;
  }
  if (!factor || (s.name != "imull" && s.name != "imulw")) return std::nullopt;
  return short_division_cycles(block, i, to, *factor);
}

}  // namespace kilotwin::behaviours
