#include "services/behaviours/division.hpp"

#include <array>
#include <cstdint>
#include <cstring>

namespace kilotwin::behaviours {
namespace {

/// General-purpose registers in the order of the instruction encoding.
constexpr std::array<int, 16> kRegisters{REG_RAX, REG_RCX, REG_RDX, REG_RBX, REG_RSP, REG_RBP, REG_RSI, REG_RDI,
                                         REG_R8,  REG_R9,  REG_R10, REG_R11, REG_R12, REG_R13, REG_R14, REG_R15};

class Division {
 public:
  explicit Division(gregset_t& registers)
      : registers_(registers), at_(static_cast<std::uint64_t>(registers[REG_RIP])) {}

  bool emulate() {
    std::uint8_t octet = fetch();
    for (; octet == 0x66; octet = fetch()) width_ = 16;
    if (octet >= 0x40 && octet <= 0x4f) {
      rex_ = octet;
      octet = fetch();
    }
    if ((octet & 0xfe) != 0xf6) return false;
    if ((rex_ & 8) != 0) width_ = 64;
    if (octet == 0xf6) width_ = 8;
    const std::uint8_t modrm = fetch();
    const bool is_signed = (modrm >> 3 & 7) == 7;
    if (!is_signed && (modrm >> 3 & 7) != 6) return false;
    const std::uint64_t divisor = operand(modrm) & mask();
    const std::uint64_t dividend = value(REG_RAX) & mask();
    const bool negative = is_signed && (dividend >> (width_ - 1) & 1) != 0;
    if (divisor == 0) {
      store(negative ? 1 : mask(), dividend);
    } else if (is_signed && divisor == mask() && dividend == std::uint64_t{1} << (width_ - 1)) {
      store(dividend, 0);
    } else {
      return false;
    }
    registers_[REG_RIP] = static_cast<greg_t>(at_);
    return true;
  }

 private:
  std::uint64_t value(int which) const { return static_cast<std::uint64_t>(registers_[which]); }
  std::uint64_t mask() const { return ~std::uint64_t{0} >> (64 - width_); }

  template <class T> T load(std::uint64_t address) const {
    T result;
    std::memcpy(&result, reinterpret_cast<const void*>(address), sizeof result);  // NOLINT
    return result;
  }
  template <class T> T take() {
    const T result = load<T>(at_);
    at_ += sizeof result;
    return result;
  }
  std::uint8_t fetch() { return take<std::uint8_t>(); }

  std::uint64_t operand(std::uint8_t modrm) {
    const std::size_t low = modrm & 7u, base_bit = (rex_ & 1u) << 3, index_bit = (rex_ & 2u) << 2;
    const unsigned mode = modrm >> 6;
    if (mode == 3) {
      // Without a REX prefix, octet registers 4 to 7 are the second octets of registers 0 to 3 (%ah, %ch, %dh, %bh).
      if (width_ == 8 && rex_ == 0 && low >= 4) return value(kRegisters[low - 4]) >> 8;
      return value(kRegisters[low + base_bit]);
    }
    std::uint64_t address = 0;
    bool from_next = false;
    if (low == 4) {
      const std::uint8_t sib = fetch();
      const std::size_t index = (sib >> 3 & 7u) + index_bit, base = sib & 7u;
      if (index != 4) address += value(kRegisters[index]) << (sib >> 6);
      if (base == 5 && mode == 0)
        address += static_cast<std::uint64_t>(take<std::int32_t>());
      else
        address += value(kRegisters[base + base_bit]);
    } else if (low == 5 && mode == 0) {
      address = static_cast<std::uint64_t>(take<std::int32_t>());
      from_next = true;
    } else {
      address = value(kRegisters[low + base_bit]);
    }
    if (mode == 1) address += static_cast<std::uint64_t>(take<std::int8_t>());
    if (mode == 2) address += static_cast<std::uint64_t>(take<std::int32_t>());
    if (from_next) address += at_;
    switch (width_) {
      case 8: return load<std::uint8_t>(address);
      case 16: return load<std::uint16_t>(address);
      case 32: return load<std::uint32_t>(address);
      default: return load<std::uint64_t>(address);
    }
  }

  void store(std::uint64_t quotient, std::uint64_t remainder) {
    switch (width_) {
      case 8: set(REG_RAX, 0xffff, quotient | remainder << 8); break;
      case 16:
        set(REG_RAX, 0xffff, quotient);
        set(REG_RDX, 0xffff, remainder);
        break;
      default:
        registers_[REG_RAX] = static_cast<greg_t>(quotient);
        registers_[REG_RDX] = static_cast<greg_t>(remainder);
    }
  }
  void set(int which, std::uint64_t mask, std::uint64_t bits) {
    registers_[which] = static_cast<greg_t>((value(which) & ~mask) | bits);
  }

  gregset_t& registers_;
  std::uint64_t at_;
  unsigned rex_ = 0, width_ = 32;
};

}  // namespace

bool divide_as_robot(gregset_t& registers) { return Division(registers).emulate(); }

}  // namespace kilotwin::behaviours
